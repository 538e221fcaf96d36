"""How well the primitives approximate bodies that no training saw: eq. 9 by part, and body against mesh.

usage: python -m tools.train.evaluate_primitives UNSEEN.npz DIRECT.npz [--seconds 540]

UNSEEN is what `tools/make/shape_space.py --full` wrote: bodies at full resolution and their shape parameters.
DIRECT keeps the direct fits between runs, a few seconds each; when all are done the tables are printed.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from simrecon.body import fitting, frames, pieces, shape, shaped_primitives, sizes, surface, targets
from simrecon.body.skeleton import template
from simrecon.body.targets import Target
from simrecon.types import Array

SAMPLES = 20000


def main() -> None:
    """Fit what is not fitted yet, then print."""
    parser = argparse.ArgumentParser(description="Evaluate models/body/primitives.npz.")
    parser.add_argument("unseen", type=Path)
    parser.add_argument("direct", type=Path)
    parser.add_argument("--seconds", type=float, default=540.0)
    options = parser.parse_args()
    with np.load(options.unseen) as data:
        unseen = {key: data[key] for key in data.files}
    betas = np.clip(unseen["betas"], -shape.BETA_MAX, shape.BETA_MAX)
    done = (
        np.load(options.direct)["sizes"]
        if options.direct.is_file()
        else np.zeros((0, len(sizes.layout().lower)))
    )
    begin = time.perf_counter()
    while len(done) < len(betas) and time.perf_counter() - begin < options.seconds:
        b = betas[len(done)]
        goals = targets.of_shape(shape.space(), b)
        done = np.vstack((done, fitting.fit(goals, fitting.start(shape.stature_m(b)))))
    np.savez(options.direct, sizes=done)
    spent = time.perf_counter() - begin
    print(f"{len(done)} of {len(betas)} direct fits, this run {spent:.0f} s")
    if len(done) == len(betas):
        _by_part(betas, done)
        _whole(unseen, betas, done)


def _by_part(betas: Array, direct: Array) -> None:
    """Mean of both directions of eq. 9 by segment; and regressed against direct primitives, by primitive."""
    layout = sizes.layout()
    distances: dict[str, list[tuple[float, float]]] = {}
    apart: dict[str, list[float]] = {name: [] for name in layout.names}
    for b, one in zip(betas, direct, strict=True):
        fast = sizes.regress(b)
        for name, goal in targets.of_shape(shape.space(), b).items():
            distances.setdefault(name, []).append((_eq9(name, goal, one), _eq9(name, goal, fast)))
        for i, name in enumerate(layout.names):
            points, area, _ = surface.samples(layout.kinds[i], sizes.values(fast)[i])
            far = np.abs(surface.distance(layout.kinds[i], sizes.values(one)[i], points)[0])
            apart[name].append(float(area @ far / area.sum()))
    print("mm, mean of both directions       direct  regressed")
    for name, pairs in distances.items():
        print(f"{name:32s} {1e3 * np.mean(pairs, axis=0)[0]:8.2f} {1e3 * np.mean(pairs, axis=0)[1]:8.2f}")
    every = np.mean([np.mean(pairs, axis=0) for pairs in distances.values()], axis=0) * 1e3
    print(f"{'mean of the segments':32s} {every[0]:8.2f} {every[1]:8.2f}")
    print("surface of the regressed primitive to the direct one, mm, mean and 95 %")
    for name, values in apart.items():
        print(f"{name:32s} {1e3 * np.mean(values):8.2f} {1e3 * np.percentile(values, 95):8.2f}")


def _eq9(name: str, goal: Target, psi: Array) -> float:
    rows = [i for i, segment in enumerate(sizes.layout().segments) if segment == name]
    return 0.5 * fitting.loss(goal, rows, psi)


def _whole(unseen: dict[str, Array], betas: Array, direct: Array) -> None:
    """All 26 primitives against the mesh at full resolution: mean distance both ways, m."""
    for label, psi in (("direct", direct), ("regressed", np.stack([sizes.regress(b) for b in betas]))):
        distances = np.array([_body_to_mesh(unseen, i, psi[i]) for i in range(len(betas))]) * 1e3  # (N, 2)
        both = distances.mean(axis=1)
        print(
            f"{label}: mesh to body {distances[:, 0].mean():.2f} mm, "
            f"body to mesh {distances[:, 1].mean():.2f} mm, "
            f"both {both.mean():.2f} mm (worst body {both.max():.2f})"
        )


def _body_to_mesh(unseen: dict[str, Array], i: int, psi: Array) -> tuple[float, float]:
    """Mean distance of the mesh's surface to the body's, and of the body's to the mesh's."""
    names, faces = template().names, unseen["faces"].astype(np.int64)
    space = shape.space()
    points = dict(zip(space.point_names, unseen["points_m"][i].astype(float), strict=True))
    origins = np.stack([points[name] for name in names])
    axes = frames.segment_frames(names, points)
    skin = unseen["vertices_m"][i].astype(float)
    used = np.unique(faces)
    weight = pieces.vertex_areas(skin, faces)[used]
    _, segments, kinds, values = shaped_primitives.both_sides(sizes.values(psi))
    parts = []
    for segment, kind, row in zip(segments, kinds, values, strict=True):
        s = names.index(segment)
        on, area, _ = surface.samples(kind, row)
        parts.append((s, kind, row, on @ axes[s].T + origins[s], area))

    def signed(places: Array, skip: int) -> Array:
        distances = [
            surface.distance(kind, row, (places - origins[s]) @ axes[s])[0]
            for k, (s, kind, row, _, _) in enumerate(parts)
            if k != skip
        ]
        return np.asarray(np.min(distances, axis=0))

    forth = float(weight @ np.abs(signed(skin[used], -1)) / weight.sum())
    mesh = skin[faces]
    area = 0.5 * np.linalg.norm(np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0]), axis=1)
    rng = np.random.default_rng(i)
    chosen = rng.choice(len(faces), SAMPLES, p=area / area.sum())
    u = np.sort(rng.random((SAMPLES, 2)), axis=1)
    share = np.column_stack((u[:, 0], u[:, 1] - u[:, 0], 1 - u[:, 1]))
    cloud = cKDTree(np.concatenate((np.einsum("sk,ski->si", share, mesh[chosen]), skin[used])))
    back, total = 0.0, 0.0
    for k, (_, _, _, on, its) in enumerate(parts):
        outside = its * (signed(on, k) > 0)
        back += float(outside @ cloud.query(on)[0])
        total += float(outside.sum())
    return forth, back / total


if __name__ == "__main__":
    main()
