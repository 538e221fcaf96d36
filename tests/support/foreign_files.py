"""Files in the layouts of other projects, made without these projects; and the motion that they hold."""

from __future__ import annotations

import io
import json
import pickle
import sys
import types
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from simrecon.evidence.keypoints import layouts
from simrecon.geometry import rotations
from tests.support import people

T = 12
FPS = 30.0


def poses(seed: int = 0, frames: int = T, joints: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Smooth rotation vectors (T, joints, 3) of an upright person, y up, and translations (T, 3)."""
    rng = np.random.default_rng(seed)
    phase = np.linspace(0, 2, frames)[:, None, None]
    vectors = 0.15 * np.sin(phase + rng.uniform(0, 6, (1, joints, 3)))
    vectors[:, 0] = [0.05, 0.6, -0.04] + 0.1 * np.sin(phase[:, 0])
    place = np.array([0.3, 0.9, 2.0]) + np.linspace(0, 1, frames)[:, None] * [0.5, 0.02, -0.4]
    return vectors, place


def carried(
    vectors: np.ndarray, place: np.ndarray, pelvis: np.ndarray, pan_rad: float = 0.5, move_m: float = 0.4
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A camera that pans and moves before a person, y up: its axes (T, 3, 3) and places (T, 3) in the world.

    Then what it sees, in its own frame: rotation vectors (T, joints, 3) and translations (T, 3), of a body
    with its pelvis at (3,) at rest.
    """
    share = np.linspace(-0.5, 0.5, len(vectors))[:, None]
    ahead = np.diag([-1.0, -1.0, 1.0])  # x right, y down, z forward, along the world's z
    axes = rotations.matrix(rotations.exp(pan_rad * share * [0.0, 1.0, 0.0])) @ ahead
    places = np.array([0.2, 1.3, -2.0]) + move_m * share * [1.0, 0.2, 0.5]
    back = np.swapaxes(axes, 1, 2)
    seen = vectors.copy()
    root = back @ rotations.matrix(rotations.exp(vectors[:, 0]))
    seen[:, 0] = rotations.log(rotations.from_matrix(root))
    there = (back @ (place + pelvis - places)[..., None])[..., 0] - pelvis
    return axes, places, seen, there


# --- SMPL by textbook: 4x4 matrices down the tree, another way than the package's


def smpl_joints(table: dict[str, Any], model: str, vectors: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Joint centres (T, J, 3) by homogeneous matrices; `table` is `models/body/smpl.toml`."""
    names, parents = table["names"], table["parents"]
    count = vectors.shape[1]
    centres = np.zeros((len(vectors), count, 3))
    for t, pose in enumerate(vectors):
        chain: list[np.ndarray] = []
        for j in range(count):
            side = names[j].startswith("right_")
            offset = np.array(table[model][names[j].replace("right_", "left_", 1)])
            local = np.eye(4)
            local[:3, :3] = rotations.matrix(rotations.exp(pose[j]))
            local[:3, 3] = offset * [-1 if side else 1, 1, 1]
            chain.append(local if parents[j] < 0 else chain[parents[j]] @ local)
            centres[t, j] = chain[j][:3, 3] + place[t]
    return centres


def y_to_z(points: np.ndarray) -> np.ndarray:
    """From y up to z up, by hand."""
    return np.stack((points[..., 0], -points[..., 2], points[..., 1]), axis=-1)


# --- torch and joblib without torch and joblib


@contextmanager
def fake_modules() -> Iterator[tuple[Any, Any]]:
    """Modules named like torch's and joblib's, for pickles that name their functions."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")
    joblib, numpy_pickle = types.ModuleType("joblib"), types.ModuleType("joblib.numpy_pickle")

    def _rebuild_tensor_v2(*_: Any) -> None:
        raise AssertionError("never called")

    class FloatStorage:
        pass

    class DoubleStorage:
        pass

    class NumpyArrayWrapper:
        pass

    _rebuild_tensor_v2.__module__, _rebuild_tensor_v2.__qualname__ = "torch._utils", "_rebuild_tensor_v2"
    utils._rebuild_tensor_v2 = _rebuild_tensor_v2  # type: ignore[attr-defined]
    for kind in (FloatStorage, DoubleStorage):
        kind.__module__, kind.__qualname__ = "torch", kind.__name__
        setattr(torch, kind.__name__, kind)
    NumpyArrayWrapper.__module__, NumpyArrayWrapper.__qualname__ = "joblib.numpy_pickle", "NumpyArrayWrapper"
    numpy_pickle.NumpyArrayWrapper = NumpyArrayWrapper  # type: ignore[attr-defined]
    torch._utils = utils  # type: ignore[attr-defined]
    stand_ins = {"torch": torch, "torch._utils": utils, "joblib": joblib, "joblib.numpy_pickle": numpy_pickle}
    before = {name: sys.modules.get(name) for name in stand_ins}
    sys.modules.update(stand_ins)
    try:
        yield torch, numpy_pickle
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


class _TorchPickler(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, torch: Any, claim: int | None) -> None:
        super().__init__(stream, protocol=2)
        self.torch, self.claim = torch, claim
        self.storages: list[bytes] = []

    def persistent_id(self, obj: Any) -> Any:
        if isinstance(obj, tuple) and obj and isinstance(obj[0], str) and obj[0] == "a storage":
            return ("storage", *obj[1:])
        return None

    def reducer_override(self, obj: Any) -> Any:
        if not isinstance(obj, np.ndarray):
            return NotImplemented
        double = obj.dtype == np.float64
        values = np.ascontiguousarray(obj, np.float64 if double else np.float32)
        self.storages.append(values.tobytes())
        kind = self.torch.DoubleStorage if double else self.torch.FloatStorage
        count = self.claim if self.claim is not None else values.size
        storage = ("a storage", kind, str(len(self.storages) - 1), "cpu", count)
        stride = tuple(step // values.itemsize for step in values.strides)
        shape = (count,) if self.claim is not None else values.shape
        stride = (1,) if self.claim is not None else stride
        return self.torch._utils._rebuild_tensor_v2, (storage, 0, shape, stride, False, {})


def save_torch(path: Any, tree: Any, claim: int | None = None) -> Any:
    """A file as of `torch.save`, with arrays as tensors; `claim`: elements that each says it has."""
    stream = io.BytesIO()
    with fake_modules() as (torch, _):
        pickler = _TorchPickler(stream, torch, claim)
        pickler.dump(tree)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("archive/data.pkl", stream.getvalue())
        archive.writestr("archive/byteorder", "little")
        for i, content in enumerate(pickler.storages):
            archive.writestr(f"archive/data/{i}", content)
        archive.writestr("archive/version", "3\n")
    return path


_PythonPickler: Any = pickle._Pickler  # has `framer`, which that in C hasn't


class _JoblibPickler(_PythonPickler):  # type: ignore[misc]
    """joblib's layout: a wrapper in the pickle, the array's bytes behind it."""

    def __init__(self, stream: io.BytesIO, wrapper: Any, claim: tuple[int, ...] | None) -> None:
        super().__init__(stream, protocol=4)
        self.stream, self.wrapper, self.claim = stream, wrapper, claim

    def save(self, obj: Any, save_persistent_id: bool = True) -> None:
        if type(obj) is not np.ndarray or obj.dtype.hasobject:
            super().save(obj, save_persistent_id)
            return
        order: Literal["C", "F"] = "F" if obj.flags.f_contiguous and not obj.flags.c_contiguous else "C"
        wrapper = self.wrapper()
        wrapper.__dict__.update(
            subclass=np.ndarray, shape=self.claim or obj.shape, order=order, dtype=obj.dtype,
            allow_mmap=True, numpy_array_alignment_bytes=16,
        )  # fmt: skip
        super().save(wrapper, save_persistent_id)
        self.framer.commit_frame(force=True)
        padding = -(self.stream.tell() + 1) % 16
        self.stream.write(bytes([padding]) + b"\xff" * padding + obj.tobytes(order))


def save_joblib(
    path: Path, tree: Any, claim: tuple[int, ...] | None = None, *, compress: bool = False
) -> Path:
    """A file as of `joblib.dump`."""
    stream = io.BytesIO()
    with fake_modules() as (_, numpy_pickle):
        _JoblibPickler(stream, numpy_pickle.NumpyArrayWrapper, claim).dump(tree)
    content = stream.getvalue()
    path.write_bytes(zlib.compress(content) if compress else content)
    return path


def save_pickle(path: Path, tree: Any, protocol: int = 4) -> Path:
    path.write_bytes(pickle.dumps(tree, protocol))
    return path


def save_json(path: Path, tree: Any) -> Path:
    path.write_text(json.dumps(tree))
    return path


# --- landmarks in the image


USUAL = {len(layouts.layout(name)): name for name in reversed(layouts.all_names())}
"""By number of landmarks the first layout that has so many."""


def landmarks(count: int, frames: int = T, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Landmarks (T, J, 2), px, of a walk, or of nobody without a layout, and scores (T, J)."""
    rng = np.random.default_rng(seed)
    scores = rng.uniform(0.4, 1, (frames, count))
    if count in USUAL:
        return people.landmarks(layouts.layout(USUAL[count]), frames, seed), scores
    start = rng.uniform(200, 400, (1, count, 2))
    drift = np.linspace(0, 30, frames)[:, None, None] * rng.uniform(0.5, 1, (1, count, 2))
    return start + drift, scores


# --- BVH by another route

BVH_JOINTS = (
    # name, parent, offset (cm)
    ("Hips", -1, (0, 0, 0)), ("Spine", 0, (0, 12, 0)), ("Neck", 1, (0, 38, 0)), ("Head", 2, (0, 12, 2)),
    ("LeftShoulder", 1, (3, 34, 0)), ("LeftArm", 4, (14, 0, 0)), ("LeftForeArm", 5, (27, 0, 0)),
    ("LeftHand", 6, (25, 0, 0)), ("RightShoulder", 1, (-3, 34, 0)), ("RightArm", 8, (-14, 0, 0)),
    ("RightForeArm", 9, (-27, 0, 0)), ("RightHand", 10, (-25, 0, 0)), ("LeftUpLeg", 0, (9, -4, 0)),
    ("LeftLeg", 12, (0, -41, 0)), ("LeftFoot", 13, (0, -41, 0)), ("LeftToeBase", 14, (0, -6, 13)),
    ("RightUpLeg", 0, (-9, -4, 0)), ("RightLeg", 16, (0, -41, 0)), ("RightFoot", 17, (0, -41, 0)),
    ("RightToeBase", 18, (0, -6, 13)),
)  # fmt: skip


def bvh(order: str = "ZXY", frames: int = T, scale: float = 1.0, seed: int = 2) -> tuple[str, np.ndarray]:
    """A BVH file and the joints' places (T, K, 3) in its unit, by homogeneous matrices."""
    rng = np.random.default_rng(seed)
    angles = 8 * np.sin(np.linspace(0, 2, frames)[:, None, None] + rng.uniform(0, 6, (1, len(BVH_JOINTS), 3)))
    place = scale * (np.array([5.0, 92.0, 20.0]) + np.linspace(0, 40, frames)[:, None] * [0.2, 0.01, 1.0])
    children = {i: [k for k, j in enumerate(BVH_JOINTS) if j[1] == i] for i in range(len(BVH_JOINTS))}

    def write(i: int, depth: int) -> str:
        name, parent, offset = BVH_JOINTS[i]
        pad = "\t" * depth
        channels = " ".join(f"{axis}rotation" for axis in order)
        more = "Xposition Yposition Zposition " if parent < 0 else ""
        body = "".join(write(k, depth + 1) for k in children[i])
        body = body or f"{pad}\tEnd Site\n{pad}\t{{\n{pad}\t\tOFFSET 0 0 {scale}\n{pad}\t}}\n"
        head = "ROOT" if parent < 0 else "JOINT"
        line = " ".join(f"{scale * x:.9g}" for x in offset)
        return (
            f"{pad}{head} {name}\n{pad}{{\n{pad}\tOFFSET {line}\n"
            f"{pad}\tCHANNELS {6 if parent < 0 else 3} {more}{channels}\n{body}{pad}}}\n"
        )

    sequence: list[int] = []

    def walk(i: int) -> None:
        sequence.append(i)
        for k in children[i]:
            walk(k)

    walk(0)
    rows = []
    for t in range(frames):
        row = list(place[t]) + [x for i in sequence for x in angles[t, i]]
        rows.append(" ".join(f"{x:.9f}" for x in row))
    text = (
        f"HIERARCHY\n{write(0, 0)}MOTION\nFrames: {frames}\nFrame Time: 0.0333333\n" + "\n".join(rows) + "\n"
    )
    places = np.zeros((frames, len(BVH_JOINTS), 3))
    axes = {"X": [1.0, 0, 0], "Y": [0, 1.0, 0], "Z": [0, 0, 1.0]}
    for t in range(frames):
        chain: dict[int, np.ndarray] = {}
        for i in sequence:
            _, parent, offset = BVH_JOINTS[i]
            local = np.eye(4)
            local[:3, 3] = place[t] if parent < 0 else scale * np.array(offset)
            for axis, angle in zip(order, angles[t, i], strict=True):
                turn = np.eye(4)
                turn[:3, :3] = rotations.matrix(rotations.exp(np.radians(angle) * np.array(axes[axis])))
                local = local @ turn
            chain[i] = local if parent < 0 else chain[parent] @ local
            places[t, i] = chain[i][:3, 3]
    return text, places


# --- markers

MARKERS = {
    "C7": (0.0, 1.45, -0.06), "L_Shoulder": (0.19, 1.42, 0.0), "R_Shoulder": (-0.19, 1.42, 0.0),
    "L_HJC": (0.09, 0.9, 0.0), "R_HJC": (-0.09, 0.9, 0.0), "L_knee": (0.145, 0.48, 0.0),
    "r_knee": (-0.145, 0.48, 0.0), "L_ankle": (0.132, 0.08, 0.0), "r_ankle": (-0.132, 0.08, 0.0),
    "L_toe": (0.1, 0.03, 0.15), "r_toe": (-0.1, 0.03, 0.15), "L_calc": (0.09, 0.03, -0.07),
    "r_calc": (-0.09, 0.03, -0.07), "L_elbow_lat": (0.28, 1.1, 0.0), "L_elbow_med": (0.2, 1.1, 0.0),
    "R_elbow_lat": (-0.28, 1.1, 0.0), "R_elbow_med": (-0.2, 1.1, 0.0),
}  # fmt: skip


def markers(frames: int = T) -> tuple[list[str], np.ndarray]:
    """Markers of a standing person who slides along z, y up, m: labels and places (T, M, 3)."""
    places = np.array(list(MARKERS.values()))[None] + np.linspace(0, 1, frames)[:, None, None] * [
        0.0,
        0.0,
        1.0,
    ]
    return list(MARKERS), places


def trc(labels: list[str], places: np.ndarray, units: str = "mm") -> str:
    """A TRC file at 100 Hz."""
    frames, count = places.shape[:2]
    head = [
        "PathFileType\t4\t(X/Y/Z)\tmade.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"100\t100\t{frames}\t{count}\t{units}\t100\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(labels),
        "\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(count) for axis in "XYZ"),
    ]
    rows = [
        f"{t + 1}\t{t / 100:.4f}\t" + "\t".join("" if np.isnan(x) else f"{x:.6f}" for x in places[t].ravel())
        for t in range(frames)
    ]
    return "\n".join([*head, "", *rows]) + "\n"
