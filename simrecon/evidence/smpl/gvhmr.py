"""GVHMR `hmr4d_results.pt` and GEM/GENMO `smpl_params.pt`: SMPL-X parameters in the world and in the camera.

Both worlds are aligned with gravity, y up. `K_fullimg` is the lens, its principal point the middle.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.content import Content, branch
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.geometry import rotations as turns
from simrecon.types import Array, Camera, Evidence

GROUPS = {"gvhmr": "smpl_params", "gem": "body_params"}
MOVING_RAD = np.radians(10.0)


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
    found = _motion(content, options, group, frame)
    camera, notes = options.camera, ""
    other = f"{group}_{'incam' if frame == 'world' else 'global'}"
    if camera is None and "K_fullimg" in content.tree:
        camera = _lens(content)
        notes = f"focal length {camera.lens.matrix_px[0, 0]:.0f} px"
    if camera is not None and other in content.tree:
        angle = _camera_turn(content, options, group)
        if angle > MOVING_RAD:
            camera, notes = (
                None,
                f"the camera turns by {np.degrees(angle):.0f} degrees, so its lens is not used",
            )
    return smpl.to_evidence(content, found, options, up="y", camera=camera, notes=notes)


def _motion(content: Content, options: Options, group: str, frame: str) -> SmplMotion:
    key = f"{group}_{'global' if frame == 'world' else 'incam'}"
    arrays = branch(content, content.tree.get(key), f"{key}.")
    root = smpl.pose_vectors(arrays, f"{key}.global_orient", 1)
    body = smpl.pose_vectors(arrays, f"{key}.body_pose", 21)
    return SmplMotion(
        model="smplx",
        frame=frame,
        times_s=times_s(content.source, np.arange(len(root)), options.rate_hz),
        rotations=np.concatenate((root, body), axis=1),
        trans_m=smpl.translation(arrays, f"{key}.transl"),
        betas=smpl.betas(arrays, f"{key}.betas"),
    )


def _lens(content: Content) -> Camera:
    arrays = branch(content, content.tree, "")
    three = arrays.array("K_fullimg").ndim == 3
    matrices = arrays.finite("K_fullimg", ("Tk", 3, 3)) if three else arrays.finite("K_fullimg", (3, 3))[None]
    matrix = np.median(matrices, axis=0)
    if matrix[0, 0] <= 0 or matrix[0, 2] <= 0 or matrix[1, 2] <= 0:
        arrays.fail("K_fullimg", str(matrix.tolist()), "[[f, 0, cx], [0, f, cy], [0, 0, 1]] in pixels")
    return smpl.lens(float(matrix[0, 0]), matrix[:2, 2])


def _camera_turn(content: Content, options: Options, group: str) -> float:
    """How far the camera turns during the clip, rad: the root in the camera against the root in the world."""
    roots: list[Array] = [
        _motion(content, options, group, frame).rotations[:, 0] for frame in ("camera", "world")
    ]
    world_to_camera = turns.multiply(roots[0], turns.conjugate(roots[1]))  # (T, 4)
    return float(np.quantile(turns.angle_between(world_to_camera, world_to_camera[:1]), 0.95))
