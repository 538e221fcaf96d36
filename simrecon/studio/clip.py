"""What is seen of a motion: poses, forces and contacts by frame, of a result or of a kinematic fit.

T frames, S segments of the body, C primitives that the scene pushes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simrecon.results import Result, contacts
from simrecon.results.kinematic import coordinates
from simrecon.scene.mjcf import ITEM_PREFIX
from simrecon.sim.models import compile_text
from simrecon.sim.poses import posed
from simrecon.types import Array, Body, Interval, KinematicFit, Motion, Scene


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the segments of a body are: places (T, S, 3) m, orientations (T, S, 4)."""

    places_m: Array
    turns: Array


@dataclass(frozen=True, eq=False)
class Clip:
    """A motion in a scene.

    Attributes:
        title: for people.
        body: the person; scene: that the motion was simulated or fitted in.
        times_s: (T,).
        qpos: (T, 7 + 4 * 16) of what was simulated, or of the fit.
        fit_qpos: (T, 7 + 4 * 16) the kinematic fit beside a simulation; None: there is none.
        motion: what was simulated; None of a fit alone.
        touched: when each part touched, s, by name.
        moved: (T, 7) poses of movable items, by name.
    """

    title: str
    body: Body
    scene: Scene
    times_s: Array
    qpos: Array
    fit_qpos: Array | None = None
    motion: Motion | None = None
    touched: Mapping[str, tuple[Interval, ...]] = field(default_factory=dict)
    moved: Mapping[str, Array] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self.times_s)

    @property
    def asked_qpos(self) -> Array:
        """The motion that a run is to follow: the fit, where it is known."""
        return self.qpos if self.fit_qpos is None else self.fit_qpos

    def frame_at(self, time_s: float) -> int:
        """The frame nearest to a time."""
        return int(np.abs(self.times_s - time_s).argmin())

    def force_N(self) -> Array:
        """Vertical force of the scene on the person (T,); NaN where there is none."""
        if self.motion is None:
            return np.full(self.frames, np.nan)
        force = self.motion.grf_N[:, 2].astype(float)
        return np.where(self.motion.loaded, force, np.nan)

    def pelvis_m(self) -> Array:
        """Height of the pelvis (T,)."""
        return np.asarray(self.qpos[:, 2])


def of_result(result: Result, title: str = "") -> Clip:
    """What a finished result shows."""
    motion, body = result.motion, result.body
    count = coordinates(body)
    fit = None if motion.kinematic_qpos is None else motion.kinematic_qpos[:, :count]
    return Clip(
        title or result.folder.name,
        body,
        result.scene,
        motion.times_s,
        motion.qpos[:, :count],
        fit,
        motion,
        contacts.spans(body, result.scene, motion),
        _moved(result),
    )


def of_fit(fit: KinematicFit, title: str) -> Clip:
    """What a kinematic fit shows."""
    return Clip(title, fit.body, fit.scene, fit.times_s, fit.qpos)


def _moved(result: Result) -> dict[str, Array]:
    """Poses (T, 7) of the movable items of a result: a free joint has the name of its item."""
    model, moved = result.model, {}
    for item in result.scene.items:
        if item.mass_kg is not None:
            first = int(model.joint(ITEM_PREFIX + item.name).qposadr[0])
            moved[item.name] = result.motion.qpos[:, first : first + 7]
    return moved


def poses(body: Body, qpos: Array) -> Poses:
    """Where the segments are in configurations (T, 7 + 4 * 16)."""
    model = compile_text(body.mjcf)
    rows = [model.body(name).id for name in body.skeleton.names]
    places, turns = np.empty((len(qpos), len(rows), 3)), np.empty((len(qpos), len(rows), 4))
    for frame, data in enumerate(posed(model, qpos)):
        places[frame], turns[frame] = data.xpos[rows], data.xquat[rows]
    return Poses(places, turns)
