"""All scores that joints allow: of an estimate, a simulated motion, another method or the reference itself.

Every motion of a clip is taken at the same times and gets the same capsules, so that all stand in one table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simrecon.metrics import bodies, contact, dynamics, pose, touch
from simrecon.metrics.contact import Flags
from simrecon.metrics.statistics import Series, of_frames
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, at, canonical, check_names, covered_times
from simrecon.types import Array, Scene

PAPER_HZ = 30.0
"""Rate of the papers whose scores count steps from frame to frame: Rempe 2020, WHAM, GVHMR."""
H36M_HZ = 25.0
"""Gärtner 2022, appendix D: "downsampled from 50 to 25 FPS"; Xie 2021, table 3, likewise."""


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


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of one motion.

    Attributes:
        series: those that are means over frames, which have intervals.
        numbers: the others.
    """

    series: dict[str, Series] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """All scores that are known, by name."""
        found = {name: series.value for name, series in self.series.items()} | self.numbers
        return {name: value for name, value in found.items() if np.isfinite(value)}

    def __or__(self, other: Scores) -> Scores:
        """Both together."""
        return Scores(self.series | other.series, self.numbers | other.numbers)


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
class Clip:
    """What all motions of a clip are compared on.

    Attributes:
        truth: the reference; scene: what the person may touch.
        times_s: (T,) of the reference that the result covers; slow_s: (S,) the same at `PAPER_HZ`.
        feet: foot points that the reference has and that are compared.
        parts: capsules around bones.
        contacts: (S, F) where the reference's foot points rest; flight: (T,) where it touches nothing.
        touching: (T, C) which of its capsules touch; near: (T, P) which parts are within 2 cm of the scene.
    """

    truth: Track
    scene: Scene
    times_s: Array
    slow_s: Array
    feet: tuple[str, ...]
    parts: bodies.Bones
    contacts: Flags
    flight: Flags
    touching: Flags
    near: Flags

    @property
    def interval_s(self) -> float:
        """Between frames."""
        return float(np.median(np.diff(self.times_s)))

    def parts_of(self, motion: Track) -> bodies.Bones:
        """The capsules, with a motion's own resting heights of foot points."""
        own = [motion.rest_m.get(*pair) for pair in zip(self.parts.names, self.parts.radii_m, strict=True)]
        return replace(self.parts, radii_m=np.array(own))

    def height(self, motion: Track, points_m: Array) -> Array:
        """Height of its foot points over where they rest, (T, F, 3) → (T, F); F as `feet`."""
        rest = self.parts_of(motion).radii_m[-len(self.feet) :]
        return np.asarray(bodies.over(self.scene, points_m) - rest)


def clip(
    truth: Track,
    times_s: Array,
    scene: Scene,
    feet: Sequence[str] = FOOT_POINTS,
    radii_m: Mapping[str, float] | None = None,
) -> Clip:
    """Lay out a clip.

    Args:
        truth: the reference.
        times_s: (T,) of it, from `covered_times`.
        scene: what the person may touch.
        feet: foot points to compare; those that the reference lacks are left out.
        radii_m: of the person's primitives; None: those of an average person of the reference's stature.
    """
    feet = tuple(point for point in FOOT_POINTS if point in feet and point in truth.names)
    names = (*BODY_JOINTS, *feet)
    joints = truth.at(times_s, names)
    interval = float(np.median(np.diff(times_s)))
    slow = every(times_s, PAPER_HZ)
    resting = (
        contact.reference_contacts(truth.at(slow, feet), 1 / PAPER_HZ) if feet else np.zeros((1, 0), bool)
    )
    parts = bodies.bones(names, joints, scene, radii_m)
    clearance = bodies.bone_clearance(parts, names, joints, scene)
    return Clip(
        truth=truth,
        scene=scene,
        times_s=times_s,
        slow_s=slow,
        feet=feet,
        parts=parts,
        contacts=contact.frame_contacts(resting),
        flight=dynamics.flight_frames(clearance),
        touching=bodies.touching(parts, names, joints, clearance, interval),
        near=touch.near(clearance, parts.names),
    )


def every(times_s: Array, rate_hz: float) -> Array:
    """Times over the same span at another rate, at least three."""
    count = max(3, int(np.floor((times_s[-1] - times_s[0]) * rate_hz + 1e-6)) + 1)
    return np.asarray(times_s[0] + np.arange(count, dtype=np.float64) / rate_hz)


def resampled(times_s: Array, values: Array, rate_hz: float) -> Array:
    """Values (T, ...) at another rate, by linear interpolation, (N, ...); times as `every` gives them."""
    return at(every(times_s, rate_hz), times_s, values)


def accuracy(motion: Track, on: Clip) -> Scores:
    """Errors against the reference; docs/metrics.md defines each.

    Args:
        motion: with all of `BODY_JOINTS`.
        on: the clip.
    """
    a, b = (x.at(on.times_s, BODY_JOINTS) for x in (motion, on.truth))  # (T, 12, 3)
    root, truth_root = a[:, :2].mean(1), b[:, :2].mean(1)  # (T, 3) between the hips, which come first
    local, truth_local = a - root[:, None], b - truth_root[:, None]
    dt = on.interval_s
    series = {
        "mpjpe_g_mm": of_frames(pose.distances(a, b), scale=1e3),
        "mpjpe_mm": of_frames(pose.distances(local, truth_local), scale=1e3),
        "mpjpe_pa_mm": of_frames(pose.distances(_procrustes(a, b), b), scale=1e3),
        "mpjpe_g_align1_mm": of_frames(
            pose.distances(a - root[:1, None], b - truth_root[:1, None]), scale=1e3
        ),
        "mpjpe_g_rigid1_mm": of_frames(pose.distances(pose.first_frame_aligned(a, b), b), scale=1e3),
        "root_mm": of_frames(np.linalg.norm(root - truth_root, axis=-1), scale=1e3),
        "velocity_mps": of_frames(pose.distances(np.diff(a, axis=0), np.diff(b, axis=0)), scale=1 / dt),
        "accel_mps2": of_frames(
            pose.distances(np.diff(a, 2, axis=0), np.diff(b, 2, axis=0)), scale=1 / dt**2
        ),
        "pck_pct": _pck(local, truth_local),
        **_world(motion, on),
        **_slow(motion, on),
    }
    rte = pose.root_translation_error_pct(root, truth_root) if np.isfinite(root).all() else np.nan
    return Scores(series, {"rte_pct": float(rte)}) | _feet(motion, on)


def _pck(local: Array, truth: Array) -> Series:
    distance = pose.distances(local, truth)
    return of_frames(np.where(np.isfinite(distance), distance < pose.PCK_M, np.nan), scale=100.0)


def _procrustes(a: Array, b: Array) -> Array:
    """`pose.procrustes` of the frames (T, J, 3) in which every joint is known; NaN in the others."""
    moved = np.full_like(a, np.nan)
    known = np.isfinite(a).all((1, 2))
    moved[known] = pose.procrustes(a[known], b[known])
    return moved


def _world(motion: Track, on: Clip) -> dict[str, Series]:
    """W- and WA-MPJPE at 30 frames a second; none if a joint is unknown."""
    a, b = (x.at(on.slow_s, BODY_JOINTS) for x in (motion, on.truth))
    if not np.isfinite(a).all():
        return {}
    found = {}
    for name, first in (("w_mpjpe", True), ("wa_mpjpe", False)):
        for ending, with_scale in (("mm", True), ("rigid_mm", False)):
            moved = pose.chunked(a, b, first=first, with_scale=with_scale)
            found[f"{name}_{ending}"] = of_frames(pose.distances(moved, b), scale=1e3)
    return found


def _slow(motion: Track, on: Clip) -> dict[str, Series]:
    """Gärtner 2022 eq. 10 in m/s and Xie 2021 in mm, at 25 frames a second."""
    times = every(on.times_s, H36M_HZ)
    a, b = (x.at(times, BODY_JOINTS) for x in (motion, on.truth))
    error = np.abs(contact.steps(a) - contact.steps(b))
    found = {
        "velocity_gartner_mps": of_frames(error, scale=H36M_HZ),
        "e_smooth_mm": of_frames(error, scale=1e3),
    }
    feet = [point for point in on.feet if point in motion.names]
    if feet:
        a, b = (x.at(times, feet) for x in (motion, on.truth))
        found["e_foot_z_mm"] = of_frames(np.abs(a[..., 2] - b[..., 2]), scale=1e3)
        step, truth_step = np.diff(a[..., :2], axis=0), np.diff(b[..., :2], axis=0)
        found["e_foot_vxy_mm"] = of_frames(pose.distances(step, truth_step), scale=1e3)
    return found


def _feet(motion: Track, on: Clip) -> Scores:
    """`contact.foot_metrics` as series."""
    feet = [point for point in on.feet if point in motion.names]
    if not feet:
        return Scores()
    a, b = (x.at(on.times_s, feet) for x in (motion, on.truth))
    resting = contact.reference_contacts(b, on.interval_s)  # (T-1, F)
    if resting.sum() < contact.CONTACTS_MIN:
        return Scores()
    speed, truth_speed = (contact.steps(x) / on.interval_s for x in (a, b))
    fast = np.where(np.isfinite(speed), speed > contact.SKATE_SPEED_MPS, np.nan)
    height = np.abs(a[1:, :, 2] - b[1:, :, 2])
    series = {
        "footskate_pct": of_frames(fast, resting, scale=100.0),
        "foot_slide_mps": of_frames(speed, resting),
        "foot_slide_truth_mps": of_frames(truth_speed, resting),
        "foot_height_err_mm": of_frames(height, resting, scale=1e3),
    }
    return Scores(series, {"foot_contact_frames": float(resting.sum())})


def evaluate(
    motion_times_s: Array,
    motion_names: Sequence[str],
    motion_joints_m: Array,
    truth_times_s: Array,
    truth_names: Sequence[str],
    truth_joints_m: Array,
) -> dict[str, float]:
    """`accuracy` on a level floor; both are taken at the reference's times that the motion covers.

    Args:
        motion_times_s: (T,) increasing.
        motion_names: K names.
        motion_joints_m: (T, K, 3) in the world.
        truth_times_s: (S,) increasing.
        truth_names: L names, in any order.
        truth_joints_m: (S, L, 3) in the world.

    Returns:
        By name with unit: `covered` (share of the reference's frames), then the scores of `accuracy`.

    Raises:
        InputError: joints of `BODY_JOINTS` are missing, or fewer than three frames are covered.
    """
    motion = track(motion_times_s, motion_names, motion_joints_m, "motion")
    truth = track(truth_times_s, truth_names, truth_joints_m, "reference")
    times = covered_times(motion.times_s, truth.times_s)
    on = clip(truth, times, Scene(), [point for point in FOOT_POINTS if point in motion.names])
    return {"covered": len(times) / len(truth_times_s), **accuracy(motion, on).values}
