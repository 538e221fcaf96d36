"""GVHMR `hmr4d_results.pt` and GEM/GENMO `smpl_params.pt`: SMPL-X parameters in the world and in the camera.

GEM-X writes the same groups for the SOMA body: `body_pose` of the 76 joints after the hips,
whose axes in the T-pose are those of the world as SMPL's are, `transl` of the hips (`SomaLayer` of GEM-X,
`SOMALayer.pose` of SOMA-X).

Both worlds are aligned with gravity, y up. `K_fullimg` is the lens, its principal point the middle. The
person in the world and in the camera places the camera.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import carried
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.evidence.values import branch
from simrecon.io.arrays import Arrays
from simrecon.types import Array, Camera, Evidence

GROUPS = {"gvhmr": "smpl_params", "gem": "body_params"}
SOMA_JOINTS = 76
"""Of SOMA's 77, all but the hips."""


def matches_gvhmr(content: Content) -> bool:
    """Whether the file is GVHMR's."""
    return _matches(content, GROUPS["gvhmr"])


def matches_gem(content: Content) -> bool:
    """Whether the file is GEM's or GENMO's."""
    return _matches(content, GROUPS["gem"])


def _matches(content: Content, group: str) -> bool:
    tree = content.tree
    return isinstance(tree, Mapping) and (f"{group}_global" in tree or f"{group}_incam" in tree)


def read_gvhmr(content: Content, options: Options) -> Evidence:
    """Evidence of the person in a GVHMR file."""
    return _read(content, options, GROUPS["gvhmr"])


def read_gem(content: Content, options: Options) -> Evidence:
    """Evidence of the person in a GEM or GENMO file."""
    return _read(content, options, GROUPS["gem"])


def _read(content: Content, options: Options, group: str) -> Evidence:
    frame = options.frame or ("world" if f"{group}_global" in content.tree else "camera")
    motion = _motion(content, options, group, frame)
    camera, path, notes = options.camera, None, ""
    if camera is None and "K_fullimg" in content.tree:
        camera = _lens(content)
        notes = f"focal length {camera.lens.matrix_px[0, 0]:.0f} px"
    if camera is not None and {f"{group}_global", f"{group}_incam"} <= set(content.tree):
        world, seen = (_motion(content, options, group, name) for name in ("world", "camera"))
        between = carried.between(world, seen)
        if moves := carried.turning(between):
            reason = carried.fault(between, world) if frame == "world" else carried.EACH_FRAME
            camera, path, note = carried.choose(camera, between, moves, reason)
            notes = note if camera is None else "; ".join(filter(None, (notes, note)))
        elif frame == "world" and camera.path is None and not options.landmarks:
            path, note = carried.placed(world, seen, camera)
            notes = "; ".join(filter(None, (notes, note)))
    return smpl.to_evidence(content, motion, options, up="y", camera=camera, path=path, notes=notes)


def _motion(content: Content, options: Options, group: str, frame: str) -> SmplMotion:
    key = f"{group}_{'global' if frame == 'world' else 'incam'}"
    arrays = branch(content, content.tree.get(key), f"{key}.")
    root = smpl.pose_vectors(arrays, f"{key}.global_orient", 1)
    model, body = _body(arrays, f"{key}.body_pose")
    return SmplMotion(
        model=model,
        frame=frame,
        times_s=times_s(content.source, np.arange(len(root)), options.rate_hz),
        rotations=np.concatenate((root, body), axis=1),
        trans_m=smpl.translation(arrays, f"{key}.transl"),
    )


def _body(arrays: Arrays, key: str) -> tuple[str, Array]:
    """The model, and its joints' rotations after the root's (T, B - 1, 4)."""
    if int(np.prod(arrays.array(key).shape[1:])) != 3 * SOMA_JOINTS:
        return "smplx", smpl.pose_vectors(arrays, key, 21)
    numbers = np.array(smpl.soma_numbers()[1:]) - 1
    return "soma", smpl.pose_vectors(arrays, key, SOMA_JOINTS)[:, numbers]


def _lens(content: Content) -> Camera:
    arrays = branch(content, content.tree, "")
    three = arrays.array("K_fullimg").ndim == 3
    matrices = arrays.finite("K_fullimg", ("Tk", 3, 3)) if three else arrays.finite("K_fullimg", (3, 3))[None]
    matrix = np.median(matrices, axis=0)
    if matrix[0, 0] <= 0 or matrix[0, 2] <= 0 or matrix[1, 2] <= 0:
        arrays.fail("K_fullimg", str(matrix.tolist()), "[[f, 0, cx], [0, f, cy], [0, 0, 1]] in pixels")
    return smpl.lens(float(matrix[0, 0]), matrix[:2, 2])
