"""Whether evidence can be that of a person, whatever file it was read from.

What can't be is refused; what is odd becomes a line of the reading. Every line says what was found and what
is valid.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon import trust
from simrecon.body import names
from simrecon.errors import InputError
from simrecon.evidence import flight
from simrecon.evidence.keypoints import pixels
from simrecon.types import Array, Evidence

STATURE_M = (0.4, 2.6)
BELIEVED_M = (0.1, 10.0)
"""Of a doll or a giant whose unit the user says."""
ENOUGH = 3
"""Lengths of the body that tell its stature."""
SPEED_MPS = 15.0
"""Of the hips; a sprinter reaches 12.4 m/s."""
ACCELERATION_MPS2 = 80.0
"""Of the hips over `ACCELERATION_S`; who lands from 2 m and stops within that has 60."""
ACCELERATION_S = 0.1
RATE_HZ = (12.0, 1000.0)
ACROSS_SHARE = 0.9
"""Someone who is not upright in more frames than this lies, or the image is turned."""
FLOOR_M = (-0.1, 0.25)
"""Of the lowest joint of a clip of motion capture over its floor: ankles alone are 0.1 m over the sole."""
FEET = ("ankle", "heel", "toe", "mtp")
_FLOOR = "floor: found the lowest of the feet at "


def checked(evidence: Evidence, source: str, *, unit_given: bool = False) -> Evidence:
    """Evidence with a line of its reading for everything that is odd.

    Args:
        evidence: in metres.
        source: name of the file, for messages.
        unit_given: whether the user says what its unit is, who is believed as far as a body can be made.

    Raises:
        InputError: no person has such a stature, and the source is one that knows it.
    """
    lines = [_rate(evidence), _across(evidence)]
    if evidence.joint_names and {name.lower() for name in evidence.joint_names} <= set(names.valid_names()):
        tall = _stature(evidence, BELIEVED_M if unit_given else STATURE_M)
        if tall and trust.of(evidence).metric:
            how = "another --unit" if unit_given else "--unit says what the file's lengths are in"
            raise InputError(f"{source}: {tall}{', or ' if unit_given else '; '}{how}")
        tall = tall or _stature(evidence, STATURE_M)
        lines.append(tall)
        if evidence.joints_frame == "world":
            lines += [_root(evidence), _floor(evidence)]
            lines += [flight.check(evidence)] if trust.of(evidence).metric else []
    found = [line for line in lines if line]
    return replace(evidence, reading="\n".join(filter(None, [evidence.reading, *found])))


def with_items(evidence: Evidence, count: int) -> Evidence:
    """Evidence without the line of its reading that asks for a scene, if there is one with items."""
    if not count:
        return evidence
    kept = [line for line in evidence.reading.split("\n") if not line.startswith(_FLOOR)]
    return replace(evidence, reading="\n".join(kept))


def _stature(evidence: Evidence, bounds: tuple[float, float]) -> str:
    lengths = bodies.measure(evidence)
    height = bodies.stature_m(bodies.scaled(lengths))
    low, high = bounds
    if len(lengths) < ENOUGH or low <= height <= high:
        return ""
    return f"stature: found {height:.3g} m; valid: {low:g} to {high:g} m"


def _rate(evidence: Evidence) -> str:
    if len(evidence.times_s) < 2:
        return ""
    rate = 1.0 / float(np.median(np.diff(evidence.times_s)))
    low, high = RATE_HZ
    if low <= rate <= high:
        return ""
    return f"frame rate: found {rate:.3g} Hz; valid: {low:g} to {high:g} Hz, or motion in between is lost"


def _across(evidence: Evidence) -> str:
    """Whether the person hardly ever stands upright in the image: they lie there, or the image is turned.

    A camera whose place is known may be held in any way.
    """
    if not evidence.keypoint_names or (evidence.camera is not None and evidence.camera.path is not None):
        return ""
    up = pixels.upright(evidence.keypoints_px, evidence.keypoint_names)
    x, y = up[np.isfinite(up).all(axis=-1)].T
    found = {
        90: ("lies across the image, with the head to the left", -x > np.abs(y)),
        270: ("lies across the image, with the head to the right", x > np.abs(y)),
        180: ("stands on the head in the image", y > np.abs(x)),
    }
    for turn, (how, frames) in found.items():
        if len(frames) and frames.mean() > ACROSS_SHARE:
            hint = f"if the video is turned, --rotate {turn} makes it upright"
            return f"the person {how} in {frames.mean():.0%} of the frames: {hint}"
    return ""


def _points(evidence: Evidence, wanted: tuple[str, ...]) -> list[Array]:
    """Places (T, 3) of points of the body, those that there are."""
    index = [point["name"] for point in names.points()]
    where = {index[point]: k for k, point in enumerate(names.resolve(evidence.joint_names)) if point >= 0}
    return [evidence.joints_m[:, where[name]] for name in wanted if name in where]


def _root(evidence: Evidence) -> str:
    """Whether the hips are faster than any, or are shaken by more than any."""
    hips = _points(evidence, ("left_hip", "right_hip")) or _points(evidence, ("pelvis",))
    if not hips:
        return ""
    place = np.mean(hips, axis=0)
    there = np.isfinite(place).all(axis=-1)
    place, times = place[there], evidence.times_s[there]
    if len(times) < 2:
        return ""
    speed = np.linalg.norm(np.diff(place, axis=0), axis=-1) / np.diff(times)
    if speed.max() > SPEED_MPS:
        at, often = times[int(np.argmax(speed))], int(np.sum(speed > SPEED_MPS))
        found = f"found {speed.max():.3g} m/s at {at:.2f} s, too fast in {often} of {len(speed)} frames"
        return f"speed of the hips: {found}; valid: up to {SPEED_MPS:g} m/s, as with the right frame rate"
    step = float(np.median(np.diff(times)))
    apart = max(round(ACCELERATION_S / step), 1)
    if len(times) <= 2 * apart or np.ptp(np.diff(times)) > 0.1 * step:
        return ""
    second = place[2 * apart :] - 2 * place[apart:-apart] + place[: -2 * apart]
    shaken = np.linalg.norm(second, axis=-1) / (apart * step) ** 2
    if shaken.max() <= ACCELERATION_MPS2:
        return ""
    at = times[apart + int(np.argmax(shaken))]
    found = f"found {shaken.max():.3g} m/s² at {at:.2f} s"
    return f"acceleration of the hips: {found}; valid: up to {ACCELERATION_MPS2:g} m/s², where nothing jumps"


def _floor(evidence: Evidence) -> str:
    """Whether the floor of motion capture is where the feet are."""
    if trust.of(evidence).floor == "unknown":
        return ""
    feet = _points(evidence, tuple(f"{side}_{point}" for point in FEET for side in ("left", "right")))
    heights = np.stack(feet)[..., 2] if feet else np.empty((0, 0))
    if not np.isfinite(heights).any():
        return ""
    lowest = float(np.nanmin(heights))
    low, high = FLOOR_M
    if low <= lowest <= high:
        return ""
    valid = f"{low:g} to {high:g} m, or a scene with what they stand on; without one it is laid there"
    return f"{_FLOOR}{lowest:.2f} m; valid: {valid}"
