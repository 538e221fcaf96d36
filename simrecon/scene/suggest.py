"""Supports that a motion needs where the scene has none: a seat, a bed, a beam, a step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from simrecon.geometry import rotations
from simrecon.scene import geometry, schema
from simrecon.types import Array, Body, Scene, SceneItem

# What counts as rest, and as held up by something else than the feet.
REST_MPS, REST_LEAST_S, REST_TOTAL_S, SMOOTH_S = 0.25, 0.3, 0.7, 0.08
SEAT_LEAST_M, SEAT_MAX_OF_STATURE = 0.15, 0.42
LYING_RAD = np.deg2rad(55)
# What counts as a foot that stands on something over the floor.
FOOT_STILL_MPS, FOOT_LEAST_S, FOOT_LEAST_M, FOOT_TOTAL_S = 0.25, 0.12, 0.04, 0.3
FOOT_TILT_M = 0.09  # from the lowest corner of a sole to the highest: 20 degrees, which a fit is often off
SAME_PLACE_M, SAME_HEIGHT_M = 0.5, 0.06
BEAM_ASPECT, BEAM_WIDTH_MAX_M, MARGIN_M = 4.0, 0.25, 0.1
SEAT_BEHIND_M, SEAT_BEFORE_M, SEAT_LEAST_DEPTH_M, SEAT_WIDTH_M = 0.25, 0.15, 0.25, 0.9
SEAT_THICK_M = 0.12
# Of the heights at rest: flesh gives way, primitives don't, and who hovers over a seat squats.
SEAT_PERCENTILE = 75.0


@dataclass(frozen=True)
class Suggestion:
    """A support that the motion needs.

    Attributes:
        item: as it would stand in the scene file.
        why: one line with the evidence.
        spans: first and last frames that say so.
    """

    item: SceneItem
    why: str
    spans: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class _Motion:
    """What the rules look at.

    Attributes:
        times_s: (T,).
        pelvis_m: (T, 3); facing: (T, 2) unit; upright_rad: (T,) angle of the trunk with the vertical.
        under_m: (T,) lowest point of pelvis and buttocks.
        soles_m: (2, T, 4, 3) corners of both soles.
    """

    times_s: Array
    pelvis_m: Array
    facing: Array
    upright_rad: Array
    under_m: Array
    soles_m: Array


def suggest(person: Body, scene: Scene, times_s: Array, qpos: Array) -> tuple[Suggestion, ...]:
    """Supports under a pelvis at rest, and under feet that stand over the floor.

    Args:
        person: whose motion it is.
        scene: floor and things that are known already; nothing is suggested where they bear.
        times_s: (T,) uniform.
        qpos: (T, 7 + 4 * 16) kinematic motion, fitted without the things that are missing.
    """
    motion = _measure(person, times_s, qpos)
    found = [*_seats(motion, scene, person.height_m), *_stands(motion, scene)]
    taken = {item.name for item in scene.items}
    named = []
    for suggestion in found:
        name, count = suggestion.item.name, 2
        while name in taken:
            name, count = f"{suggestion.item.name}_{count}", count + 1
        taken.add(name)
        named.append(replace(suggestion, item=replace(suggestion.item, name=name)))
    return tuple(named)


def _measure(person: Body, times_s: Array, qpos: Array) -> _Motion:
    model = mujoco.MjModel.from_xml_string(person.mjcf)
    data = mujoco.MjData(model)
    seat = [model.geom(name).id for name in ("pelvis", "left_buttock", "right_buttock")]
    feet = [model.geom(f"{side}_foot").id for side in ("left", "right")]
    chest = model.body("neck").id
    frames = len(qpos)
    under, soles, trunk = np.empty(frames), np.empty((2, frames, 4, 3)), np.empty((frames, 3))
    signs = np.array([[x, y, -1.0] for x in (-1, 1) for y in (-1, 1)])
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        axes = data.geom_xmat.reshape(-1, 3, 3)
        reach = model.geom_size[seat, 0] + model.geom_size[seat, 1] * np.abs(axes[seat, 2, 2])
        under[frame] = (data.geom_xpos[seat, 2] - reach).min()
        for side, foot in enumerate(feet):
            soles[side, frame] = data.geom_xpos[foot] + (signs * model.geom_size[foot]) @ axes[foot].T
        trunk[frame] = data.xpos[chest] - qpos[frame, :3]
    forward = rotations.matrix(qpos[:, 3:7])[:, :2, 0]  # (T, 2)
    facing = forward / np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-9)
    tilt = np.arccos(np.clip(trunk[:, 2] / np.linalg.norm(trunk, axis=1), -1, 1))
    return _Motion(times_s, qpos[:, :3], facing, tilt, under, soles)


def _speed(places_m: Array, times_s: Array) -> Array:
    """Smoothed speeds (T,) of points (T, 3)."""
    interval = float(times_s[1] - times_s[0])
    smooth = gaussian_filter1d(places_m, SMOOTH_S / interval, axis=0, mode="nearest")
    return np.asarray(np.linalg.norm(np.gradient(smooth, interval, axis=0), axis=1))


def _spans(chosen: NDArray[np.bool_], times_s: Array, least_s: float) -> list[tuple[int, int]]:
    """Runs of frames, first and last, that are long enough."""
    edges = np.diff(np.concatenate(([0], chosen.astype(np.int8), [0])))
    runs = zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1, strict=True)
    return [(int(a), int(b)) for a, b in runs if times_s[b] - times_s[a] >= least_s]


def _seats(motion: _Motion, scene: Scene, stature_m: float) -> list[Suggestion]:
    """Seats and beds: a pelvis at rest, too low to stand and too high to lie on the floor."""
    known = geometry.support_height(scene, motion.pelvis_m[:, :2])
    over = motion.under_m - known
    held = (over > SEAT_LEAST_M) & (over < SEAT_MAX_OF_STATURE * stature_m)
    still = _speed(motion.pelvis_m, motion.times_s) < REST_MPS
    found = []
    for group in _together(_spans(held & still, motion.times_s, REST_LEAST_S), motion):
        frames = np.concatenate([np.arange(first, last + 1) for first, last in group])
        if sum(motion.times_s[last] - motion.times_s[first] for first, last in group) >= REST_TOTAL_S:
            found.append(_seat(motion, scene, group, frames))
    return found


def _together(spans: list[tuple[int, int]], motion: _Motion) -> list[list[tuple[int, int]]]:
    """Spans by place: those whose pelvis rests within `SAME_PLACE_M` of each other."""
    groups: list[list[tuple[int, int]]] = []
    places: list[Array] = []
    for first, last in spans:
        here = np.median(motion.pelvis_m[first : last + 1], axis=0)
        near = [i for i, place in enumerate(places) if np.linalg.norm(here - place) < SAME_PLACE_M]
        if near:
            groups[near[0]].append((first, last))
        else:
            groups.append([(first, last)])
            places.append(here)
    return groups


def _seat(
    motion: _Motion, scene: Scene, spans: list[tuple[int, int]], frames: NDArray[np.int64]
) -> Suggestion:
    top = float(np.percentile(motion.under_m[frames], SEAT_PERCENTILE))
    place = np.median(motion.pelvis_m[frames], axis=0)
    facing = motion.facing[frames].mean(axis=0)
    facing /= max(float(np.linalg.norm(facing)), 1e-9)
    yaw = float(np.arctan2(facing[1], facing[0]))
    floor = float(geometry.ground_height(scene.ground, place[:2]))
    lying = bool(np.median(motion.upright_rad[frames]) > LYING_RAD)
    half = 1.0
    name, kind, front = "bed", "box", 1.0
    if not lying:
        # the front edge lies under the thigh, and behind the heels
        soles = motion.soles_m[:, frames][..., :2] - place[:2]  # (2, F, 4, 2)
        heels = float(np.median((soles @ facing).min(axis=-1)))
        name, kind, front = (
            "seat",
            "chair",
            min(SEAT_BEFORE_M, max(heels - 0.03, SEAT_LEAST_DEPTH_M - SEAT_BEHIND_M)),
        )
        half = (front + SEAT_BEHIND_M) / 2
    middle = place[:2] + facing * (front - half)
    height = max(top - floor, 0.02)
    position = [round(float(middle[0]), 3), round(float(middle[1]), 3), round(floor, 3)]
    table: dict[str, Any] = {"name": name, "kind": kind, "position_m": position, "yaw_rad": round(yaw, 3)}
    if lying:
        table["size_m"] = [round(2 * half, 3), 1.0, round(height, 3)]
    else:  # open below, where heels and calves go
        table |= {
            "seat_height_m": round(height, 3),
            "seat_depth_m": round(2 * half, 3),
            "seat_width_m": SEAT_WIDTH_M,
            "seat_m": round(min(SEAT_THICK_M, height / 2), 3),
            "back": False,
        }
    seconds = sum(float(motion.times_s[b] - motion.times_s[a]) for a, b in spans)
    how = "lies" if lying else "rests"
    why = (
        f"the pelvis {how} {len(spans)} time{'s' if len(spans) > 1 else ''}, {seconds:.1f} s in all, "
        f"with its underside {height:.2f} m over the floor"
    )
    return Suggestion(schema.item(table, "suggestion"), why, tuple(spans))


def _stands(motion: _Motion, scene: Scene) -> list[Suggestion]:
    """Beams and steps: feet that stand still over what is known to be under them, by height."""
    stands: list[tuple[float, int, int, int]] = []  # height over the support, side, first, last
    for side in range(2):
        middle = motion.soles_m[side].mean(axis=1)  # (T, 3)
        known = geometry.support_height(scene, middle[:, :2])
        over = motion.soles_m[side][..., 2].min(axis=1) - known
        level = np.ptp(motion.soles_m[side][..., 2], axis=1) < FOOT_TILT_M
        still = _speed(middle, motion.times_s) < FOOT_STILL_MPS
        for first, last in _spans(still & level, motion.times_s, FOOT_LEAST_S):
            stands.append((float(np.median(over[first : last + 1])), side, first, last))
    stands = _bearing(stands, motion)
    found = []
    while stands:
        height = max(stands)[0]
        group = [entry for entry in stands if height - entry[0] < SAME_HEIGHT_M]
        stands = [entry for entry in stands if entry not in group]
        seconds = sum(float(motion.times_s[b] - motion.times_s[a]) for _, _, a, b in group)
        if np.median([entry[0] for entry in group]) > FOOT_LEAST_M and seconds >= FOOT_TOTAL_S:
            found.append(_stand(motion, scene, group, seconds))
    return found


def _bearing(stands: list[tuple[float, int, int, int]], motion: _Motion) -> list[tuple[float, int, int, int]]:
    """Without the feet that are held up while the other one, lower by far, bears the weight."""
    lowest = motion.soles_m[..., 2].min(axis=(0, 2))  # (T,)
    kept = []
    for entry in stands:
        _, side, first, last = entry
        own = motion.soles_m[side, first : last + 1, :, 2].min(axis=1)
        if np.median(own - lowest[first : last + 1]) < SAME_HEIGHT_M / 2:
            kept.append(entry)
    return kept


def _stand(
    motion: _Motion, scene: Scene, group: list[tuple[float, int, int, int]], seconds: float
) -> Suggestion:
    prints = np.concatenate(
        [np.median(motion.soles_m[side, a : b + 1], axis=0) for _, side, a, b in group]
    )  # (4n, 3)
    middles = prints.reshape(-1, 4, 3).mean(axis=1)[:, :2]
    centre = middles.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((prints[:, :2] - prints[:, :2].mean(axis=0)).T))
    along = axes[:, 1] * (1.0 if axes[np.argmax(np.abs(axes[:, 1])), 1] > 0 else -1.0)
    across = np.array([-along[1], along[0]])
    reach, wide = (prints[:, :2] - centre) @ along, (middles - centre) @ across
    floor = float(geometry.ground_height(scene.ground, centre))
    # the lowest corners: no foot stands in what bears it
    height = max(float(np.median(prints[:, 2].reshape(-1, 4).min(axis=1))) - floor, 0.01)
    length = float(np.ptp(reach)) + 2 * MARGIN_M
    drift = float(np.ptp(wide))
    beam = length / max(drift, 0.05) > BEAM_ASPECT and drift < BEAM_WIDTH_MAX_M
    width = max(drift, 0.1) if beam else float(np.ptp((prints[:, :2] - centre) @ across)) + 2 * MARGIN_M
    place = centre + along * (reach.max() + reach.min()) / 2 + across * (wide.max() + wide.min()) / 2
    table: dict[str, Any] = {
        "name": "beam" if beam else "step",
        "kind": "beam",
        "position_m": [round(float(place[0]), 3), round(float(place[1]), 3), round(floor, 3)],
        "yaw_rad": round(float(np.arctan2(along[1], along[0])), 3),
        "length_m": round(length, 3),
        "width_m": round(width, 3),
        "height_m": round(height, 3),
    }
    if not beam:
        size = [table.pop(key) for key in ("length_m", "width_m", "height_m")]
        table |= {"kind": "box", "size_m": size}
    low, high = (1e3 * f(entry[0] for entry in group) for f in (min, max))
    why = (
        f"{len(group)} time{'s' if len(group) > 1 else ''}, {seconds:.1f} s in all, a foot stands "
        f"{low:.0f} to {high:.0f} mm over what is known to be under it"
    )
    spans = tuple(sorted((a, b) for _, _, a, b in group))
    return Suggestion(schema.item(table, "suggestion"), why, spans)
