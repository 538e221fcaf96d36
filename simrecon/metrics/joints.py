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
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, SIDES, at, canonical, check_names, covered_times
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


def plausibility(motion: Track, on: Clip) -> Scores:
    """Scores of contact, jitter and implied force that every motion has, the reference too.

    Args:
        motion: with all of `BODY_JOINTS`.
        on: the clip; its reference says only where feet rest, at which height, and where nothing touches.
    """
    body = motion.at(on.slow_s, BODY_JOINTS)  # (S, 12, 3)
    third = np.linalg.norm(np.diff(body, 3, axis=0), axis=-1) * PAPER_HZ**3
    series = {"jitter_10mps3": of_frames(third, scale=0.1)}
    found = Scores(series | _threshold(motion, on)) | _implied(motion, on) | _rempe(motion, on)
    if not set(on.feet) <= set(motion.names):
        return found
    names = (*BODY_JOINTS, *on.feet)
    joints = motion.at(on.times_s, names)
    if not np.isfinite(joints).all():
        return found
    clearance = bodies.bone_clearance(on.parts_of(motion), names, joints, on.scene)  # (T, C)
    deep = np.asarray((clearance < -contact.PENETRATION_TOLERANCE_M).any(-1))
    depth = np.maximum(-clearance, 0.0).max(-1)
    touching = bodies.touching(on.parts, names, joints, clearance, on.interval_s)
    f1 = contact.contact_f1(touching, on.touching)
    series = {
        "body_penetration_mean_mm": of_frames(depth, scale=1e3),
        "body_penetration_pct": of_frames(deep.astype(np.float64), scale=100.0),
    }
    numbers = {"body_penetration_max_mm": 1e3 * float(depth.max())}
    numbers |= {f"f1_{part}": float(score) for part, score in zip(on.parts.names, f1, strict=True)}
    numbers["contact_f1"] = float(pose.mean_known(f1, (0,)))
    numbers |= touch.scores(touch.near(clearance, on.parts.names), on.near)
    return found | Scores(series, numbers)


def _rempe(motion: Track, on: Clip) -> Scores:
    """Rempe 2020 and WHAM on heels and toes, and Gärtner 2022's counts with annotations."""
    feet = [point for point in on.feet if point in motion.names]
    if len(feet) < len(on.feet) or not feet:
        return Scores()
    points, truth = motion.at(on.slow_s, feet), on.truth.at(on.slow_s, feet)  # (S, F, 3)
    height = on.height(motion, points)  # (S, F)
    step, resting = contact.steps(points), contact.both(on.contacts)
    known, moves = np.isfinite(height), np.where(np.isfinite(step), step > contact.SKATE_MIN_M, np.nan)
    still = contact.steps(truth) < contact.RESTING_STEP_M
    annotated = np.where(np.isfinite(step), resting & (step > contact.SKATE_MIN_M), np.nan)
    lowest = _lowest(height, feet)  # (S, 2)
    labelled = _lowest(-on.contacts.astype(np.float64), feet) < 0  # (S, 2) heel or toe rests
    hovers = np.where(np.isfinite(lowest), labelled & (lowest > contact.CONTACT_KINEMATICS_M), np.nan)
    return Scores(
        {
            "footskate_annotated_pct": of_frames(annotated.max(-1), scale=100.0),
            "float_annotated_pct": of_frames(hovers.max(-1), scale=100.0),
            "floating_rempe_pct": of_frames(
                1.0 * (height > contact.FLOATING_MIN_M), on.contacts & known, scale=100.0
            ),
            "penetration_rempe_pct": of_frames(
                1.0 * (height < -contact.PENETRATION_MIN_M), known, scale=100.0
            ),
            "skate_rempe_pct": of_frames(moves, resting, scale=100.0),
            "skate_wham_mm": of_frames(step, still, scale=1e3),
        }
    )


def _threshold(motion: Track, on: Clip) -> dict[str, Series]:
    """Gärtner 2022's footskate and float of heels and toes at 25 frames a second, without annotations."""
    feet = [point for point in on.feet if point in motion.names]
    if len(feet) < len(on.feet) or not feet:
        return {}
    points = motion.at(every(on.times_s, H36M_HZ), feet)  # (S, F, 3)
    if not np.isfinite(points).all():
        return {}
    height = on.height(motion, points)  # (S, F)
    floats = contact.float_frames(_lowest(height, feet))
    return {
        "footskate_points_pct": of_frames(1.0 * contact.footskate_steps(points, height), scale=100.0),
        "float_points_pct": of_frames(1.0 * floats, scale=100.0),
    }


def _lowest(height: Array, feet: Sequence[str]) -> Array:
    """The lower of heel and toe of each foot that has one, (S, F) → (S, 2)."""
    sides = [[k for k, point in enumerate(feet) if point.startswith(side)] for side in SIDES]
    return np.stack([height[:, columns].min(-1) for columns in sides if columns], axis=-1)


def _implied(motion: Track, on: Clip) -> Scores:
    """The force that the motion asks for (Rempe 2020), at 30 frames a second; none if a joint is unknown."""
    joints = motion.at(on.slow_s, BODY_JOINTS)
    if not np.isfinite(joints).all():
        return Scores()
    force = dynamics.implied_grf(bodies.centre_of_mass(BODY_JOINTS, joints), 1.0, 1 / PAPER_HZ)  # (S-2, 3)
    flight = at(on.slow_s[1:-1], on.times_s, on.flight.astype(np.float64)) > 0.5
    numbers = {
        "implied_grf_mean_pct": float(dynamics.mean_grf_pct(force, 1.0)),
        "implied_grf_max_pct": float(dynamics.max_grf_pct(force, 1.0)),
        "implied_grf_ballistic_pct": dynamics.ballistic_grf_pct(force, flight, 1.0),
    }
    return Scores({}, numbers)


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
