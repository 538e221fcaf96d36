"""Joint centres from the markers of a motion capture laboratory, and evidence made of them.

Hips: Harrington et al. 2007, from pelvic width and depth (`mocap.centres`, `models/body/markers.toml`). Knees
and ankles: middle between the two markers of a static trial, carried along by the shank's markers (Cappozzo
et al. 1995). Elbows and wrists: middle between their two markers. Shoulders: under the acromion by 17 % of
the distance of the acromia (the same file). Heels and toes lie on the sole, as those of the
body do: on the floor under the marker on the calcaneus, and as far in front of it, towards the middle of the
forefoot's markers, as a foot is long, in the static trial; carried along by the foot's markers.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.mocap.centres import harrington
from simrecon.evidence.mocap.labels import table
from simrecon.evidence.opensim import Markers
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, Evidence, Lens

OPENCAP = {
    "left_asis": ("L.ASIS",), "right_asis": ("r.ASIS",), "left_psis": ("L.PSIS",), "right_psis": ("r.PSIS",),
    "left_knee": ("L_knee", "L_mknee"), "right_knee": ("r_knee", "r_mknee"),
    "left_ankle": ("L_ankle", "L_mankle"), "right_ankle": ("r_ankle", "r_mankle"),
    "left_shank": ("L_knee", "L_ankle", "L_sh2", "L_sh3", "L_shank_antsup"),
    "right_shank": ("r_knee", "r_ankle", "r_sh2", "r_sh3", "r_sh4", "r_shank_antsup"),
    "left_foot": ("L_calc", "L_toe", "L_5meta", "L_ankle"),
    "right_foot": ("r_calc", "r_toe", "r_5meta", "r_ankle"),
    "left_heel": ("L_calc",), "right_heel": ("r_calc",),
    "left_toe": ("L_toe", "L_5meta"), "right_toe": ("r_toe", "r_5meta"),
    "left_acromion": ("L_Shoulder",), "right_acromion": ("R_Shoulder",),
    "left_elbow": ("L_elbow_lat", "L_elbow_med"), "right_elbow": ("R_elbow_lat", "R_elbow_med"),
    "left_wrist": ("L_wrist_radius", "L_wrist_ulna"), "right_wrist": ("R_wrist_radius", "R_wrist_ulna"),
}  # fmt: skip
"""Markers of the OpenCap validation data by what they mark."""

_CLUSTER_MIN = 3


def carried(static: Array, moving: Array, centre: Array) -> Array:
    """A point that moves rigidly with a cluster of markers, (T, 3); NaN with fewer than three in view.

    Args:
        static: (M, 3) markers of the static trial, NaN where missing.
        moving: (T, M, 3) the same markers in motion, NaN where not seen.
        centre: (3,) the point in the static trial.
    """
    known = np.isfinite(moving).all(-1) & np.isfinite(static).all(-1)  # (T, M)
    weight = known / np.maximum(known.sum(-1, keepdims=True), 1)  # (T, M)
    here, there = np.nan_to_num(static), np.nan_to_num(moving)
    static_middle = weight @ here  # (T, 3)
    middle = (weight[..., None] * there).sum(-2)  # (T, 3)
    rotation = rotations.align(here - static_middle[:, None], there - middle[:, None], weight)  # (T, 3, 3)
    points = middle + (rotation @ (centre - static_middle)[..., None])[..., 0]
    return np.where(known.sum(-1, keepdims=True) >= _CLUSTER_MIN, points, np.nan)


def joint_centres(
    static: Markers, moving: Markers, markers: Mapping[str, tuple[str, ...]] = OPENCAP
) -> dict[str, Array]:
    """Joint centres in motion by name, (T, 3), NaN where markers were not seen.

    Args:
        static: the person standing still, with the inner markers of knees and ankles.
        moving: the trial.
        markers: what each marker marks, as `OPENCAP`.

    Raises:
        InputError: a trial lacks markers.
    """
    inner = {markers[f"{side}_{joint}"][1] for side in ("left", "right") for joint in ("knee", "ankle")}
    all_names = {name for group in markers.values() for name in group}
    for trial, whose, needed in (
        (static, "static trial", all_names),
        (moving, "trial", all_names - inner),
    ):
        if missing := sorted(needed - set(trial.names)):
            raise InputError(f"markers of the {whose}: found no {', '.join(missing)}; valid: all of them")

    def of(role: str) -> Array:
        return np.asarray(np.mean([moving.of(name) for name in markers[role]], axis=0))

    sides = ("left", "right")
    back = 0.5 * (of("left_psis") + of("right_psis"))
    hips = dict(zip(sides, harrington(of("left_asis"), of("right_asis"), back), strict=True))
    centres = {f"{side}_hip": hips[side] for side in sides}
    for side in sides:
        for joint in ("knee", "ankle"):
            pair = [np.nanmedian(static.of(name), axis=0) for name in markers[f"{side}_{joint}"]]
            centres[f"{side}_{joint}"] = _carried(
                static, moving, markers[f"{side}_shank"], np.mean(pair, axis=0)
            )
        for end, under in zip(("heel", "toe"), _sole(static, markers, side), strict=True):
            centres[f"{side}_{end}"] = _carried(static, moving, markers[f"{side}_foot"], under)
        centres |= {f"{side}_{point}": of(f"{side}_{point}") for point in ("elbow", "wrist")}
    acromia = {side: of(f"{side}_acromion") for side in sides}
    width = np.linalg.norm(acromia["left"] - acromia["right"], axis=-1, keepdims=True)  # (T, 1)
    down = 0.5 * (hips["left"] + hips["right"]) - 0.5 * (acromia["left"] + acromia["right"])
    down /= np.linalg.norm(down, axis=-1, keepdims=True)
    drop = float(table("acromion")["drop"])
    for side in sides:
        centres[f"{side}_shoulder"] = acromia[side] + drop * width * down
    return centres


def _still(static: Markers, markers: Mapping[str, tuple[str, ...]], role: str) -> Array:
    """The middle (3,) of the markers of a role in the static trial."""
    return np.asarray(np.mean([np.nanmedian(static.of(name), axis=0) for name in markers[role]], axis=0))


def _sole(static: Markers, markers: Mapping[str, tuple[str, ...]], side: str) -> tuple[Array, Array]:
    """Back end and front end (3,) of a sole in the static trial.

    The front end lies beyond the markers of the forefoot, which are on its knuckles, as in `mocap.feet`.
    """
    heel, front, knee, ankle = (
        _still(static, markers, f"{side}_{role}") for role in ("heel", "toe", "knee", "ankle")
    )
    stature_m = float(np.linalg.norm(knee - ankle)) / float(table("stature")["shank"])
    reach = front[:2] - heel[:2]
    length = float(np.linalg.norm(reach))
    tip = heel[:2] + max(length, float(table("foot")["length"]) * stature_m) / length * reach
    return np.append(heel[:2], 0.0), np.append(tip, 0.0)


def _carried(static: Markers, moving: Markers, cluster: tuple[str, ...], centre: Array) -> Array:
    """`carried` by markers of these names."""
    still = np.stack([np.nanmedian(static.of(name), axis=0) for name in cluster])  # (M, 3)
    return carried(still, np.stack([moving.of(name) for name in cluster], axis=1), centre)


def evidence(static: Markers, moving: Markers, mass_kg: float | None = None) -> Evidence:
    """Evidence of nothing but joint centres in the world of the laboratory, whose floor is at z = 0.

    A camera from the side, without landmarks, says that the world is known: without extrinsics, the floor
    would be put under the lowest foot points, which are markers above the sole.

    Args:
        static: as in `joint_centres`.
        moving: as in `joint_centres`.
        mass_kg: of the person.
    """
    centres, frames = joint_centres(static, moving), len(moving.times_s)
    return Evidence(
        times_s=moving.times_s,
        keypoint_names=(),
        keypoints_px=np.empty((frames, 0, 2)),
        scores=np.empty((frames, 0)),
        joint_names=tuple(centres),
        joints_m=np.stack(list(centres.values()), axis=1),  # (T, K, 3)
        joints_frame="world",
        mass_kg=mass_kg,
        camera=_view(np.nanmean(np.stack(list(centres.values())), axis=(0, 1)), frames),
    )


def _view(middle_m: Array, frames: int) -> Camera:
    """A camera that looks along y at a point, 5 m away."""
    size = (1280, 720)
    pose = np.eye(4)
    pose[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    pose[:3, 3] = -pose[:3, :3] @ (middle_m - [0.0, 5.0, 0.0])
    matrix = np.array([[1000.0, 0.0, size[0] / 2], [0.0, 1000.0, size[1] / 2], [0.0, 0.0, 1.0]])
    return cameras.still(Lens(matrix, np.zeros(5), size), pose, frames)
