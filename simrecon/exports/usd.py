"""USD: the person's skin on their skeleton (UsdSkel), with floor and items, which move where they move.

World as in the result: z up, metres; one time code a frame. Needs Pixar's library (extra `usd`).
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.body import clothed
from simrecon.body.clothed import Skin
from simrecon.drawing import pieces
from simrecon.exports import rigs
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.sim.poses import posed
from simrecon.system import extras
from simrecon.types import Array, IntArray

SKIN_RGB = (0.72, 0.74, 0.78)
INFLUENCES = 4


def write(view: ResultView) -> dict[str, bytes]:
    """The motion as a binary USD.

    Raises:
        InputError: usd-core is not installed.
    """
    extras.load("pxr", "usd", "--to usd")
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(view.times_s) - 1)
    stage.SetTimeCodesPerSecond(view.rate_hz)
    stage.SetFramesPerSecond(view.rate_hz)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    _add_person(stage, view)
    _add_scene(stage, view)
    with tempfile.TemporaryDirectory(prefix="simrecon-") as folder:
        path = Path(folder) / "motion.usdc"
        stage.GetRootLayer().Export(str(path))
        return {"motion.usd": path.read_bytes()}


def _add_person(stage: Any, view: ResultView) -> None:
    """Skeleton, its animation, and the skin bound to it."""
    from pxr import Gf, UsdSkel, Vt

    skin, names = clothed.skin(view.body), _paths(view)
    root = UsdSkel.Root.Define(stage, "/World/person")
    skeleton = UsdSkel.Skeleton.Define(stage, "/World/person/skeleton")
    skeleton.CreateJointsAttr(names)
    parents = view.body.skeleton.parents
    world = [_matrix(Gf, axes, place) for axes, place in zip(skin.axes, skin.origins_m, strict=True)]
    rest = [
        own if parent < 0 else own * world[parent].GetInverse()
        for own, parent in zip(world, parents.tolist(), strict=True)
    ]
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(world))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray(rest))
    animation = UsdSkel.Animation.Define(stage, "/World/person/motion")
    animation.CreateJointsAttr(names)
    animation.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1, 1, 1)] * len(names)))
    moves, turns = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    quats = view.qpos[:, 3:].reshape(len(view.qpos), -1, 4)
    local = rotations.multiply(view.body.skeleton.rest, quats)
    offsets = view.body.skeleton.offsets_m.copy()
    for frame, turned in enumerate(local.tolist()):
        offsets[0] = view.qpos[frame, :3]
        moves.Set(Vt.Vec3fArray.FromNumpy(offsets.astype(np.float32)), frame)
        turns.Set(Vt.QuatfArray([Gf.Quatf(w, x, y, z) for w, x, y, z in turned]), frame)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    _add_skin(stage, skin, skeleton)


def _add_skin(stage: Any, skin: Skin, skeleton: Any) -> None:
    from pxr import UsdSkel, Vt

    mesh = _mesh(stage, "/World/person/skin", skin.vertices_m, skin.faces, SKIN_RGB)
    order, weights = skin.strongest(INFLUENCES)
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateJointIndicesPrimvar(False, INFLUENCES).Set(
        Vt.IntArray.FromNumpy(order.astype(np.int32).ravel())
    )
    binding.CreateJointWeightsPrimvar(False, INFLUENCES).Set(
        Vt.FloatArray.FromNumpy(weights.astype(np.float32).ravel())
    )
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])


def _add_scene(stage: Any, view: ResultView) -> None:
    """Floor and items; those that move have a transform at each frame."""
    from pxr import Gf, UsdGeom

    model, qpos = view.result.model, view.whole_qpos
    found = list(pieces.of_scene(model, view.result.scene, qpos[:, :2]))
    bodies = [piece.body for piece in found]
    frames = qpos if model.body_weldid[bodies].any() else qpos[:1]
    poses = [
        [(data.xmat[body].reshape(3, 3).copy(), data.xpos[body].copy()) for body in bodies]
        for data in posed(model, frames)
    ]
    for column, piece in enumerate(found):
        path = f"/World/scene/{_identifier(piece.name)}_{column}"
        mesh = _mesh(stage, path, piece.points_m, piece.faces, piece.rgb)
        placed = UsdGeom.Xformable(mesh.GetPrim()).AddTransformOp()
        if len(poses) == 1 or not model.body_weldid[piece.body]:
            placed.Set(_matrix(Gf, *poses[0][column]))
            continue
        for frame, row in enumerate(poses):
            placed.Set(_matrix(Gf, *row[column]), frame)


def _mesh(stage: Any, path: str, points_m: Array, faces: IntArray, rgb: Any) -> Any:
    from pxr import Gf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points_m, np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*(float(value) for value in rgb))])
    return mesh


def _paths(view: ResultView) -> list[str]:
    """Joints as USD names them: by the way from the root."""
    skeleton = view.body.skeleton
    paths: list[str] = []
    for name, parent in zip(rigs.names(view.choices.rig, skeleton.names), skeleton.parents, strict=True):
        own = _identifier(name)
        paths.append(own if parent < 0 else f"{paths[parent]}/{own}")
    return paths


def _identifier(name: str) -> str:
    """A name of letters, digits and underscores, which USD asks for."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"_{plain}"


def _matrix(gf: Any, axes: Array, place: Array) -> Any:
    """A transform as USD has it: rows are the axes, then the place."""
    rows = np.eye(4)
    rows[:3, :3], rows[3, :3] = np.asarray(axes).T, place
    return gf.Matrix4d(rows.tolist())
