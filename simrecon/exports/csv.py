"""Tables for spreadsheets: the motion, and the forces of the scene; names carry their unit.

World z up, metres, N; quaternions x y z w, as in the other tables of robots. One row a frame.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import tables
from simrecon.exports.view import ResultView
from simrecon.types import Array

XYZW = [1, 2, 3, 0]


def write(view: ResultView) -> dict[str, bytes]:
    """`motion.csv`, and `forces.csv` where the motion is as simulated, or as planned with forces."""
    skeleton, count = view.body.skeleton, len(view.times_s)
    time = view.times_s - view.times_s[0]
    quats = view.qpos[:, 3:].reshape(count, -1, 4)[..., XYZW]
    names = ["time_s", *(f"com_{axis}_m" for axis in "xyz"), *(f"root_{axis}_m" for axis in "xyz")]
    names += [f"{joint}_q{axis}" for joint in skeleton.names for axis in "xyzw"]
    names += [f"{point}_{axis}_m" for point in skeleton.point_names for axis in "xyz"]
    files = {"motion.csv": _table(names, [time, view.com_m, view.qpos[:, :3], quats, view.points_m])}
    if view.choices.of == "simulation" and view.choices.legs == 1.0 and view.result.motion.knows_forces:
        files["forces.csv"] = _forces(view, time)
    return files


def _forces(view: ResultView, time: Array) -> bytes:
    """Force, centre of pressure, and moment about it of what is pushed: means around each frame."""
    loads = view.forces.at(view.times_s, view.interval_s)
    pushed = np.flatnonzero(np.abs(loads.force_N).max(axis=(0, 2)) > 0)
    names, columns = ["time_s"], [time]
    for row in pushed:
        segment = view.forces.segments[row]
        for word, unit, values in (
            ("force", "N", loads.force_N),
            ("centre", "m", loads.centre_m),
            ("moment", "Nm", loads.moment_Nm),
        ):
            names += [f"{segment}_{word}_{axis}_{unit}" for axis in "xyz"]
            columns.append(values[:, row])
    return _table(names, columns)


def _table(names: list[str], columns: list[Array]) -> bytes:
    rows = tables.rows(columns, between=",")
    return tables.lines([",".join(names)], [row.replace("nan", "") for row in rows])
