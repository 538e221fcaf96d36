"""An OpenSim model of simrecon's person, and inverse dynamics of an exported trial on it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from simrecon.exports.axes import TO_Y_UP
from simrecon.exports.mot import OTHERS
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.sim.models import compile_text
from simrecon.types import Array, Body

NAMES = {
    **{segment: name for segment, name in OTHERS.items() if name != "torso" or segment == "chest"},
    "left_ankle": "calcn_l",
    "right_ankle": "calcn_r",
}
"""Of the bodies that the exported forces act on."""
AXES = ("rx", "ry", "rz")


def model(opensim: Any, body: Body, path: Path) -> None:
    """Write an `.osim` with one body for each segment: a free pelvis, and ball joints."""
    made, whole = opensim.Model(), compile_text(body.mjcf)
    made.setName("person")
    made.set_gravity(opensim.Vec3(0, -9.81, 0))
    bodies: list[Any] = []
    turned = rotations.from_matrix(TO_Y_UP)  # of the pelvis, as we have z up
    for segment, name in enumerate(body.skeleton.names):
        bodies.append(_body(opensim, whole, name))
        made.addBody(bodies[-1])
        parent = int(body.skeleton.parents[segment])
        offset = body.skeleton.offsets_m[segment]
        before = made.getGround() if parent < 0 else bodies[parent]
        rest = euler_xyz(rotations.matrix(rotations.multiply(turned, body.skeleton.rest[segment])))
        turned = np.array([1.0, 0.0, 0.0, 0.0])
        at, turn = (opensim.Vec3(*vector.tolist()) for vector in (offset, rest))
        zero = opensim.Vec3(0)
        axes = _axes(opensim, name, 6 if parent < 0 else 3)
        made.addJoint(opensim.CustomJoint(f"joint_{name}", before, at, turn, bodies[-1], zero, zero, axes))
    skeleton = body.skeleton
    for name, segment, place in zip(
        skeleton.point_names, skeleton.point_segments, skeleton.point_offsets_m, strict=True
    ):
        made.addMarker(opensim.Marker(name, bodies[segment], opensim.Vec3(*place.tolist())))
    made.finalizeConnections()
    made.printToXML(str(path))


def _body(opensim: Any, whole: mujoco.MjModel, name: str) -> Any:
    own = whole.body(name)
    turn = rotations.matrix(own.iquat)
    inertia = turn @ np.diag(own.inertia) @ turn.T
    values = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    centre = opensim.Vec3(*own.ipos.tolist())
    return opensim.Body(NAMES.get(name, name), float(own.mass[0]), centre, opensim.Inertia(*values))


def _axes(opensim: Any, name: str, count: int) -> Any:
    """Rotations about x, y, z, then translations: their rates are the speeds, as tools take it."""
    transform = opensim.SpatialTransform()
    for axis in range(count):
        one = transform.updTransformAxis(axis)
        one.setCoordinateNames(opensim.ArrayStr(coordinate(name, axis), 1))
        direction = np.eye(3)[axis % 3].tolist()
        one.setAxis(opensim.Vec3(*direction))
        one.set_function(opensim.LinearFunction(1.0, 0.0))
    return transform


def coordinate(name: str, axis: int) -> str:
    return f"{name}_{(*AXES, 'tx', 'ty', 'tz')[axis]}"


def coordinates(view: ResultView, path: Path) -> None:
    """Write the motion's coordinates: rotations about x, y, z of the body, in this order, rad."""
    skeleton = view.body.skeleton
    local = view.qpos[:, 3:].reshape(len(view.qpos), -1, 4)  # counted from rest, far from gimbal lock
    angles = np.unwrap(euler_xyz(rotations.matrix(local)), axis=0)  # (G, S, 3)
    names, columns = ["time"], [view.times_s - view.times_s[0]]
    for segment, name in enumerate(skeleton.names):
        for axis in range(3):
            names.append(coordinate(name, axis))
            columns.append(angles[:, segment, axis])
    for axis in range(3):
        names.append(coordinate(skeleton.names[0], 3 + axis))
        columns.append(view.qpos[:, axis])  # in the turned frame of the joint
    head = [
        "coordinates",
        "version=1",
        f"nRows={len(view.times_s)}",
        f"nColumns={len(names)}",
        "inDegrees=no",
    ]
    rows = ["\t".join(f"{value:.9f}" for value in row) for row in np.stack(columns, axis=1)]
    path.write_text("\n".join([*head, "endheader", "\t".join(names), *rows, ""]))


def euler_xyz(m: Array) -> Array:
    """Angles a, b, c of R = R_x(a) R_y(b) R_z(c)."""
    b = np.arcsin(np.clip(m[..., 0, 2], -1, 1))
    a = np.arctan2(-m[..., 1, 2], m[..., 2, 2])
    return np.stack((a, b, np.arctan2(-m[..., 0, 1], m[..., 0, 0])), axis=-1)


def inverse_kinematics(
    opensim: Any, folder: Path, markers: Path, names: tuple[str, ...], span_s: float
) -> Array:
    """Distances (G,), m: the farthest that a marker of a TRC is from that of `model.osim` in each frame."""
    tool = opensim.InverseKinematicsTool()
    tool.set_model_file(str(folder / "model.osim"))
    tool.set_marker_file(str(markers))
    for name in names:
        task = opensim.IKMarkerTask()
        task.setName(name)
        task.setApply(True)
        task.setWeight(1.0)
        tool.upd_IKTaskSet().cloneAndAppend(task)
    tool.set_time_range(0, 0.0)
    tool.set_time_range(1, span_s)
    tool.setResultsDir(str(folder))
    tool.set_output_motion_file(str(folder / "inverse.mot"))
    tool.set_report_errors(True)
    assert tool.run()
    lines = next(folder.glob("*_ik_marker_errors.sto")).read_text().splitlines()
    begin = next(i for i, line in enumerate(lines) if line.strip() == "endheader")
    column = lines[begin + 1].split().index("marker_error_max")
    return np.array([float(line.split()[column]) for line in lines[begin + 2 :]])


def inverse_dynamics(
    opensim: Any, folder: Path, loads: Path, cutoff_hz: float, span_s: float
) -> dict[str, Array]:
    """Generalised forces over time by name, of `model.osim` and `coordinates.mot` in a folder."""
    tool = opensim.InverseDynamicsTool()
    tool.setModelFileName(str(folder / "model.osim"))
    tool.setCoordinatesFileName(str(folder / "coordinates.mot"))
    tool.setExternalLoadsFileName(str(loads))
    tool.setLowpassCutoffFrequency(cutoff_hz)
    tool.setStartTime(0.0)
    tool.setEndTime(span_s)
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("forces.sto")
    assert tool.run()
    lines = (folder / "forces.sto").read_text().splitlines()
    begin = next(i for i, line in enumerate(lines) if line.strip() == "endheader")
    names = lines[begin + 1].split()
    table = np.array([[float(word) for word in line.split()] for line in lines[begin + 2 :]])
    return dict(zip(names, table.T, strict=True))
