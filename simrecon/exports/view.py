"""What every writer is given: the motion of a result at a uniform frame rate, with its body and contacts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simrecon import kinematics
from simrecon.errors import InputError
from simrecon.exports import contacts, legs, segments
from simrecon.exports.forces import Forces, steps
from simrecon.exports.segments import Segments
from simrecon.metrics import filters
from simrecon.results import Result, kinematic
from simrecon.types import Array, Body, Flags

SOURCES = ("simulation", "fit")
RIGS = ("simrecon", "mixamo", "lafan1", "rokoko")
FPS_RANGE_HZ = (1.0, 1000.0)
LEGS_RANGE = (0.5, 2.0)
CUTOFF_RANGE_HZ = (0.5, 500.0)


@dataclass(frozen=True, kw_only=True)
class Choices:
    """What of a result is exported, and how.

    Attributes:
        fps: frame rate, Hz; None: that of the result.
        of: `simulation`, or `fit`: the kinematic fit.
        rig: whose joint names a skeleton gets, one of `RIGS`.
        legs: length of the rig's legs over that of the person's; feet stay where they stand.
        cutoff_hz: of a zero-lag low-pass filter for motion and forces alike, brought down to what the frame
            rate allows (`filters.possible_hz`) in a view; None: none.
        body_model: where the body model of the person's shape is; None: where the job says.

    Raises:
        InputError: a value is none of these.
    """

    fps: float | None = None
    of: str = "simulation"
    rig: str = "simrecon"
    legs: float = 1.0
    cutoff_hz: float | None = None
    body_model: str | None = None

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        for name, value, valid in (("of", self.of, SOURCES), ("rig", self.rig, RIGS)):
            if value not in valid:
                raise InputError(f"--{name}: found {value!r}; valid: {', '.join(valid)}")
        numbers = (
            ("fps", self.fps, FPS_RANGE_HZ),
            ("legs", self.legs, LEGS_RANGE),
            ("cutoff", self.cutoff_hz, CUTOFF_RANGE_HZ),
        )
        for name, number, (low, high) in numbers:
            if number is not None and not low <= number <= high:
                raise InputError(f"--{name}: found {number:g}; valid: {low:g} to {high:g}")


@dataclass(frozen=True, eq=False)
class ResultView:
    """The motion that is exported; G frames, world z up, metres.

    Attributes:
        result: whose motion it is.
        choices: what was asked for.
        body: the person, or one with other legs.
        times_s: (G,) uniform, on the clock of the result.
        qpos: (G, nq) place of the root, then a quaternion w x y z of each segment.
    """

    result: Result
    choices: Choices
    body: Body
    times_s: Array
    qpos: Array

    @property
    def is_as_simulated(self) -> bool:
        """Whether it is the simulated motion of the person, at the result's own rate."""
        asked = self.choices
        return asked == replace(Choices(), rig=asked.rig, body_model=asked.body_model)

    @cached_property
    def whole_qpos(self) -> Array:
        """Configurations (G, nq) of the model: the person's, and those of items that move."""
        motion, own = self.result.motion, self.qpos.shape[1]
        before = motion.qpos if self.choices.of == "simulation" else motion.kinematic_qpos
        items = np.zeros((len(motion.times_s), 0)) if before is None else before[:, own:]
        moved = [np.interp(self.times_s, motion.times_s, column) for column in items.T]
        return np.column_stack([self.qpos, *moved])

    @property
    def interval_s(self) -> float:
        """Between frames."""
        return float(self.times_s[-1] - self.times_s[0]) / (len(self.times_s) - 1)

    @property
    def rate_hz(self) -> float:
        """Frames a second."""
        return 1.0 / self.interval_s

    @cached_property
    def segments(self) -> Segments:
        """Origins and axes of the segments in all frames."""
        return segments.of(self.body.skeleton, self.qpos)

    @cached_property
    def points_m(self) -> Array:
        """Landmarks and joint centres (G, M, 3) of `body.skeleton.point_names`."""
        return segments.points(self.body.skeleton, self.segments)

    @cached_property
    def com_m(self) -> Array:
        """Centre of mass (G, 3)."""
        return kinematics.configurations(self.body, self.qpos)[0]

    @cached_property
    def touching(self) -> Flags:
        """Which segments (G, S) the scene pushes, or in the fit rest on it."""
        return contacts.touching(self.result, self.choices.of, self.times_s)

    @cached_property
    def forces(self) -> Forces:
        """Forces of the scene on the person, step by step.

        Raises:
            InputError: the motion that is exported is not the one that was simulated.
        """
        asked = self.choices
        if asked.of != "simulation" or asked.legs != 1.0:
            flag = f"--of {asked.of}" if asked.of != "simulation" else f"--legs {asked.legs:g}"
            raise InputError(f"{flag}: forces belong to the simulation of the person; valid: leave it out")
        forces = steps(self.result)
        return forces if asked.cutoff_hz is None else forces.low_passed(asked.cutoff_hz)


def of(result: Result, choices: Choices) -> ResultView:
    """The view of a result.

    Raises:
        InputError: the result holds no kinematic fit, and that is asked for.
    """
    motion, body = result.motion, result.body
    own = motion.qpos if choices.of == "simulation" else motion.kinematic_qpos
    if own is None:
        raise InputError(f"{result.folder}: kinematic_qpos: found none; valid: a result that holds it")
    times_s = clock(motion.times_s, choices.fps)
    qpos = kinematic.on_clock(motion.times_s, own[:, : kinematic.coordinates(body)], times_s)
    if choices.cutoff_hz is not None:
        frame_s = interval_s(result, choices.fps)
        cutoff_hz = filters.possible_hz(choices.cutoff_hz, frame_s)
        choices = replace(choices, cutoff_hz=cutoff_hz)
        qpos = filters.low_passed_poses(qpos, frame_s, cutoff_hz)
    view = ResultView(result, choices, body, times_s, qpos)
    if choices.legs == 1.0:
        return view
    loaded = legs.feet(view.body.skeleton, view.touching)
    body, qpos = legs.on_other_legs(body, qpos, choices.legs, loaded, result.scene, view.interval_s)
    return ResultView(result, choices, body, times_s, qpos)


def interval_s(result: Result, fps: float | None) -> float:
    """Between the frames of a result's view at a frame rate, or at its own."""
    times_s = clock(result.motion.times_s, fps)
    return float(times_s[1] - times_s[0])


def clock(times_s: Array, fps: float | None) -> Array:
    """Uniform times from the first to the last (T,), at the motion's own rate or another one."""
    if fps is None:
        return kinematic.uniform(times_s)[0].times_s
    count = int(np.floor((times_s[-1] - times_s[0]) * fps + 1e-6)) + 1
    if count < 2:
        length = times_s[-1] - times_s[0]
        raise InputError(f"--fps: found {fps:g}, one frame of {length:.3g} s; valid: two frames or more")
    return np.asarray(times_s[0] + np.arange(count) / fps)
