"""A result in notebooks: curves over time by matplotlib, and a table for pandas (extra `plot`)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np

from simrecon.contact import rules
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.io.messages import hint
from simrecon.replay import SIMULATED
from simrecon.replay.moments import Moments
from simrecon.system import extras
from simrecon.types import Array, Body, Motion

GRAVITY_MPS2 = 9.81
AXES = "xyz"


def rotation_vectors(body: Body, qpos: Array) -> Mapping[str, Array]:
    """Angles (T, 3), rad, of each joint from the middle of its range: components of its rotation vector."""
    turns = qpos[:, 3 : 3 + 4 * len(body.skeleton.names)].reshape(len(qpos), -1, 4)
    return {name: rotations.log(turns[:, row]) for row, name in enumerate(body.skeleton.names) if row}


class Plots:
    """`result.plot`: each call draws one figure and returns its axes."""

    def __init__(self, motion: Motion, body: Body, moments: Callable[[], Moments]) -> None:
        """Hold what is drawn, and what makes the moments."""
        self._motion, self._body, self._moments = motion, body, moments

    def forces(self, axes: Any = None) -> Any:
        """Vertical forces of the scene on each foot and on the whole person, percent of body weight.

        With their 90 % bands (`Motion.band_feet_N`, `band_grf_N`), where the motion has any.

        Args:
            axes: matplotlib's, to draw on; None: of a new figure.

        Raises:
            InputError: matplotlib is not installed.
        """
        axes = _axes(axes)
        motion, share = self._motion, 100.0 / (GRAVITY_MPS2 * self._body.mass_kg)
        if motion.band_feet_N is not None and motion.band_grf_N is not None:
            bands = (*np.moveaxis(motion.band_feet_N, 1, 0), motion.band_grf_N)
            for band, colour in zip(bands, ("C0", "C1", "k"), strict=True):
                low, high = share * band[:, 2].T
                axes.fill_between(motion.times_s, low, high, color=colour, alpha=0.15, lw=0)
        for side in ("left", "right"):
            columns = self._of_segment(f"{side}_ankle")
            axes.plot(
                motion.times_s,
                share * motion.contact_force_N[:, columns, 2].sum(axis=1),
                label=f"{side} foot",
            )
        axes.plot(motion.times_s, share * motion.grf_N[:, 2], "k", lw=0.7, label="all contacts")
        axes.set(xlabel="time, s", ylabel="vertical force, % of body weight")
        axes.legend()
        return axes

    def contacts(self, axes: Any = None) -> Any:
        """When the scene pushes each part, as bars; parts that it never does are left out.

        Args:
            axes: as of `forces`.

        Raises:
            InputError: matplotlib is not installed.
        """
        axes = _axes(axes)
        motion = self._motion
        pushed = rules.loaded(np.linalg.norm(motion.contact_force_N, axis=-1)) & motion.kept[:, None]
        parts = [part for part, flags in zip(motion.contact_body, pushed.T, strict=True) if flags.any()]
        step = float(np.median(np.diff(motion.times_s)))
        for row, part in enumerate(parts):
            edges = np.diff(
                np.concatenate(([0], pushed[:, motion.contact_body.index(part)], [0])).astype(int)
            )
            begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
            spans = [
                (motion.times_s[a] - step / 2, motion.times_s[b] - motion.times_s[a] + step)
                for a, b in zip(begins, ends, strict=True)
            ]
            axes.broken_barh(spans, (row - 0.4, 0.8))
        axes.set_yticks(range(len(parts)), [part.replace("_", " ") for part in parts])
        axes.set(xlabel="time, s", xlim=(motion.times_s[0], motion.times_s[-1]))
        return axes

    def angles(self, joints: Sequence[str] = ("left_knee", "right_knee"), axes: Any = None) -> Any:
        """Joint angles, degrees: components x, y, z of the rotation vector from the middle of the range.

        Args:
            joints: names of joints, such as `left_hip`.
            axes: as of `forces`.

        Raises:
            InputError: there is no such joint, or matplotlib is not installed.
        """
        known = rotation_vectors(self._body, self._motion.qpos)
        _check(joints, known)
        axes = _axes(axes)
        for joint in joints:
            for letter, column in zip(AXES, known[joint].T, strict=True):
                axes.plot(
                    self._motion.times_s, np.degrees(column), label=f"{joint.replace('_', ' ')} {letter}"
                )
        axes.set(xlabel="time, s", ylabel="angle, degrees")
        axes.legend()
        return axes

    def moments(self, joints: Sequence[str] = ("left_knee", "right_knee"), axes: Any = None) -> Any:
        """Joint moments, N m: components x, y, z of that of the upper segment on the lower one (`Moments`).

        Args:
            joints: as of `angles`.
            axes: as of `forces`.

        Raises:
            InputError: there is no such joint, nothing was simulated, or matplotlib is not installed.
        """
        _check(joints, self._body.skeleton.names[1:])
        found, axes = self._moments(), _axes(axes)
        for joint in joints:
            for letter, column in zip(AXES, found.moment_Nm[:, found.joints.index(joint)].T, strict=True):
                axes.plot(self._motion.times_s, column, label=f"{joint.replace('_', ' ')} {letter}")
        axes.set(xlabel="time, s", ylabel=f"moment below {found.cutoff_hz:.3g} Hz, N m")
        axes.legend()
        return axes

    def _of_segment(self, segment: str) -> list[int]:
        own = {part.name for part in self._body.primitives if part.segment == segment}
        return [row for row, part in enumerate(self._motion.contact_body) if part in own]


def _check(joints: Sequence[str], known: Collection[str]) -> None:
    for joint in joints:
        if joint not in known:
            valid = ", ".join(known)
            raise InputError(f"joints: found {joint!r}{hint(joint, list(known))}; valid: {valid}")


def _axes(axes: Any) -> Any:
    """The axes given, or those of a new figure."""
    if axes is not None:
        return axes
    extras.load("matplotlib", "plot", "plot")
    from matplotlib import pyplot

    return pyplot.subplots(figsize=(8, 3), layout="constrained")[1]


def table(motion: Motion, body: Body, motors: Sequence[str]) -> Any:
    """A pandas table of a motion, one row a frame; see `Result.to_pandas`.

    Args:
        motion: what was simulated.
        body: the person.
        motors: names of the nu motors.

    Raises:
        InputError: pandas is not installed.
    """
    pandas = extras.load("pandas", "plot", "to_pandas")
    columns: dict[str, Array] = {"simulated": motion.status == SIMULATED}

    def add(name: str, unit: str, values: Array) -> None:
        columns.update({f"{name}_{axis}_{unit}": values[:, row] for row, axis in enumerate(AXES)})

    add("com", "m", motion.com_m)
    add("root", "m", motion.qpos[:, :3])
    for name, angles in rotation_vectors(body, motion.qpos).items():
        add(name, "rad", angles)
    for row, name in enumerate(motion.joint_names):
        add(f"{name}", "m", motion.joints_m[:, row])
    for row, name in enumerate(motors):
        columns[f"{name}_Nm"] = motion.torque_Nm[:, row]
    add("grf", "N", motion.grf_N)
    for row, name in enumerate(motion.contact_body):
        add(f"{name}_force", "N", motion.contact_force_N[:, row])
        add(f"{name}_centre", "m", motion.contact_point_m[:, row])
    return pandas.DataFrame(columns, index=pandas.Index(motion.times_s, name="time_s"))
