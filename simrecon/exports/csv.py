"""Tables for spreadsheets: motion, forces of the scene, moments and powers of joints; names carry their unit.

World z up, metres, N; quaternions x y z w, as in the other tables of robots. One row a frame.
"""

from __future__ import annotations

import numpy as np

from simrecon.exports import tables
from simrecon.exports.view import ResultView
from simrecon.metrics import filters
from simrecon.replay.moments import CUTOFF_HZ
from simrecon.types import Array

XYZW = [1, 2, 3, 0]


def write(view: ResultView) -> dict[str, bytes]:
    """`motion.csv`; `forces.csv` of a simulation, or a plan with forces; `moments.csv` of a simulation."""
    skeleton, count = view.body.skeleton, len(view.times_s)
    time = view.times_s - view.times_s[0]
    quats = view.qpos[:, 3:].reshape(count, -1, 4)[..., XYZW]
    names = ["time_s", *(f"com_{axis}_m" for axis in "xyz"), *(f"root_{axis}_m" for axis in "xyz")]
    names += [f"{joint}_q{axis}" for joint in skeleton.names for axis in "xyzw"]
    names += [f"{point}_{axis}_m" for point in skeleton.point_names for axis in "xyz"]
    files = {"motion.csv": _table(names, [time, view.com_m, view.qpos[:, :3], quats, view.points_m])}
    if view.choices.of == "simulation" and view.choices.legs == 1.0 and view.result.motion.knows_forces:
        files["forces.csv"] = _forces(view, time)
        if not view.result.motion.is_planned:
            files["moments.csv"] = _moments(view, time)
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


def _moments(view: ResultView, time: Array) -> bytes:
    """Moment and power of each joint, and what is left at the root, low-passed below what a column says."""
    asked_hz = view.choices.cutoff_hz or CUTOFF_HZ
    found = view.result.moments(filters.possible_hz(asked_hz, view.interval_s))

    def shown(values: Array) -> Array:
        """Rows (T, n) at the times that are exported."""
        own = view.result.motion.times_s
        return np.stack([np.interp(view.times_s, own, column) for column in values.T], axis=1)

    names = ["time_s", "cutoff_Hz"]
    columns = [time, np.full(len(time), found.cutoff_hz)]
    for row, joint in enumerate(found.joints):
        names += [f"{joint}_moment_{axis}_Nm" for axis in "xyz"] + [f"{joint}_power_W"]
        columns += [shown(found.moment_Nm[:, row]), shown(found.power_W[:, [row]])]
    for word, unit, values in (("force", "N", found.root_force_N), ("moment", "Nm", found.root_moment_Nm)):
        names += [f"root_residual_{word}_{axis}_{unit}" for axis in "xyz"]
        columns.append(shown(values))
    return _table(names, columns)


def _table(names: list[str], columns: list[Array]) -> bytes:
    rows = tables.rows(columns, between=",")
    return tables.lines([",".join(names)], [row.replace("nan", "") for row in rows])
