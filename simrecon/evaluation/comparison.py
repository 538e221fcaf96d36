"""What all motions of a clip are compared on: the same times, the same capsules, one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simrecon.contact import rules
from simrecon.evaluation import parts as body_parts
from simrecon.metrics import bones, clearance, contact, touch
from simrecon.metrics.rates import PAPER_HZ, at, every
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, Pushes, canonical, check_names
from simrecon.types import Array, Flags, Scene


@dataclass(frozen=True, eq=False)
class Track:
    """A motion as joints.

    Attributes:
        times_s: (T,) increasing.
        names: K names.
        joints_m: (T, K, 3) in the world, NaN = unknown.
        rest_m: height of foot points over the sole, by name, where it is known; elsewhere the height at which
            they rest in the reference is taken.
    """

    times_s: Array
    names: tuple[str, ...]
    joints_m: Array
    rest_m: Mapping[str, float] = field(default_factory=dict)

    def at(self, times_s: Array, names: Sequence[str]) -> Array:
        """The named joints at other times, (N, len(names), 3)."""
        columns = [self.names.index(name) for name in names]
        return at(times_s, self.times_s, self.joints_m[:, columns])


def track(
    times_s: Array,
    names: Sequence[str],
    joints_m: Array,
    whose: str,
    rest_m: Mapping[str, float] | None = None,
) -> Track:
    """A motion whose names are checked.

    Args:
        times_s: (T,) increasing.
        names: K names, in any order.
        joints_m: (T, K, 3) in the world.
        whose: for messages.
        rest_m: as in `Track`.

    Raises:
        InputError: joints of `BODY_JOINTS` are missing.
    """
    known = canonical(names)
    check_names(whose, known)
    return Track(times_s, known, joints_m, rest_m or {})


@dataclass(frozen=True, eq=False)
class Comparison:
    """What all motions of a clip are compared on.

    Attributes:
        truth: the reference; scene: what the person may touch.
        times_s: (T,) of the reference that the result covers; slow_s: (S,) the same at `PAPER_HZ`.
        feet: foot points that the reference has and that are compared.
        parts: capsules around bones.
        contacts: (S, F) where the reference's foot points rest; flight: (T,) where it touches nothing.
        touching: (T, C) which of its capsules touch; near: (T, P) which parts are within 2 cm of the scene.
        pushed: (T, Q) which parts (`evaluation.parts.known`) the scene pushes with more than 20 N, or None.
    """

    truth: Track
    scene: Scene
    times_s: Array
    slow_s: Array
    feet: tuple[str, ...]
    parts: bones.Bones
    contacts: Flags
    flight: Flags
    touching: Flags
    near: Flags
    pushed: Flags | None = None

    @property
    def interval_s(self) -> float:
        """Between frames."""
        return float(np.median(np.diff(self.times_s)))

    def feet_of(self, motion: Track) -> list[str]:
        """The foot points that a motion has too."""
        return [point for point in self.feet if point in motion.names]

    def has_feet(self, motion: Track) -> bool:
        """Whether there are foot points, and a motion has all of them."""
        return bool(self.feet) and len(self.feet_of(motion)) == len(self.feet)

    def parts_of(self, motion: Track) -> bones.Bones:
        """The capsules, with a motion's own resting heights of foot points."""
        own = [motion.rest_m.get(*pair) for pair in zip(self.parts.names, self.parts.radii_m, strict=True)]
        return replace(self.parts, radii_m=np.array(own))

    def height(self, motion: Track, points_m: Array) -> Array:
        """Height of its foot points over where they rest, (T, F, 3) → (T, F); F as `feet`."""
        rest = self.parts_of(motion).radii_m[-len(self.feet) :]
        return np.asarray(bones.over(self.scene, points_m) - rest)


def comparison(
    truth: Track,
    times_s: Array,
    scene: Scene,
    feet: Sequence[str] = FOOT_POINTS,
    radii_m: Mapping[str, float] | None = None,
    pushes: Pushes | None = None,
) -> Comparison:
    """Lay out what the motions of a clip are compared on.

    Args:
        truth: the reference.
        times_s: (T,) of it, from `rates.covered_times`.
        scene: what the person may touch.
        feet: foot points to compare; those that the reference lacks are left out.
        radii_m: of the person's primitives; None: those of an average person of the reference's stature.
        pushes: forces on the reference's primitives, if they are known.
    """
    feet = tuple(point for point in FOOT_POINTS if point in feet and point in truth.names)
    names = (*BODY_JOINTS, *feet)
    joints = truth.at(times_s, names)
    interval = float(np.median(np.diff(times_s)))
    slow = every(times_s, PAPER_HZ)
    resting = (
        contact.reference_contacts(truth.at(slow, feet), 1 / PAPER_HZ) if feet else np.zeros((1, 0), bool)
    )
    parts = bones.bones(names, joints, scene, radii_m)
    distance = bones.bone_clearance(parts, names, joints, scene)
    return Comparison(
        truth=truth,
        scene=scene,
        times_s=times_s,
        slow_s=slow,
        feet=feet,
        parts=parts,
        contacts=contact.frame_contacts(resting),
        flight=clearance.flight_frames(distance),
        touching=bones.touching(parts, names, joints, distance, interval),
        near=touch.near(distance, parts.names),
        pushed=None if pushes is None else _pushed(pushes, truth.times_s, times_s, parts.names),
    )


def _pushed(pushes: Pushes, truth_times_s: Array, times_s: Array, capsules: Sequence[str]) -> Flags:
    """Which parts with a capsule the scene pushes (`contact.rules.loaded`), (T, Q)."""
    loaded = rules.loaded(np.linalg.norm(at(times_s, truth_times_s, pushes.force_N), axis=-1))  # (T, C)
    return body_parts.of_primitives(loaded, pushes.names, body_parts.known(capsules))
