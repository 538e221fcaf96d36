"""A walking body with known joints and with the markers that laboratories put on it, y up, m.

Markers lie where the sources named in `models/body/markers.toml` say that they are, seen from the joints;
the labels that sets of markers have for them are in tests/data/marker_sets.toml.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

HEIGHT_M, FRAMES, RATE_HZ, SPEED_MPS = 1.75, 40, 40.0, 1.1
LABELS = Path(__file__).parents[1] / "data" / "marker_sets.toml"
SIDES = {"left": 1.0, "right": -1.0}


def body(
    height_m: float = HEIGHT_M, frames: int = FRAMES
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Joints and landmarks, and markers on the skin, (T, 3) by name; the body walks along x."""
    h = height_m
    time = np.arange(frames) / RATE_HZ
    hips = np.stack((SPEED_MPS * time, 0.525 * h + 0.01 * np.cos(4 * np.pi * time), 0 * time), axis=-1)
    up, right = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])

    def at(x: float, y: float, z: float = 0.0) -> np.ndarray:
        return hips + h * np.array([x, y, z])

    joints = {"neck": at(-0.01, 0.284), "head_top": at(0.014, 0.464), "skull_base": at(0.0, 0.339)}
    joints |= {"head": at(0.008, 0.384), "pelvis": hips, "nose": at(0.062, 0.354)}
    skin = _head_and_trunk(joints, hips, h)
    for side, sign in SIDES.items():
        out = -sign * right  # away from the middle
        swing = np.radians(22) * np.sin(2 * np.pi * time + (0 if sign > 0 else np.pi))
        bend = np.radians(32) * (1 - np.cos(2 * np.pi * time + (1 if sign > 0 else 1 + np.pi)))
        hip = hips + 0.052 * h * out
        thigh, shank = _down(swing), _down(swing - bend)
        knee, ankle = hip + 0.245 * h * thigh, hip + 0.245 * h * thigh + 0.246 * h * shank
        pitch = 0.5 * (swing - bend)  # of the foot, from level
        ahead = np.stack((np.cos(pitch), np.sin(pitch), 0 * pitch), axis=-1)
        above = np.stack((-np.sin(pitch), np.cos(pitch), 0 * pitch), axis=-1)
        heel = ankle - 0.038 * h * ahead - 0.039 * h * above
        toe = heel + 0.152 * h * ahead
        shoulder = at(-0.022, 0.288) + 0.112 * h * out
        elbow = shoulder + 0.186 * h * _down(-0.6 * swing)
        wrist = elbow + 0.146 * h * _down(-0.6 * swing + np.radians(30))
        own = {"hip": hip, "knee": knee, "ankle": ankle, "heel": heel, "toe": toe, "shoulder": shoulder}
        own |= {"elbow": elbow, "wrist": wrist, "mtp": ankle + h * (0.066 * ahead - 0.023 * above)}
        joints |= {f"{side}_{name}": place for name, place in own.items()}
        marks = {
            "knee_lateral": knee + 0.055 * out, "knee_medial": knee - 0.055 * out,
            "ankle_lateral": ankle + 0.042 * out, "ankle_medial": ankle - 0.042 * out,
            "heel": heel - 0.010 * ahead + 0.030 * above,
            "toe": heel + 0.725 * 0.152 * h * ahead + 0.035 * above,
            "toe_tip": toe + 0.035 * above,
            "mt1": heel + 0.725 * 0.152 * h * ahead + 0.035 * above - 0.03 * out,
            "mt5": heel + 0.725 * 0.152 * h * ahead + 0.035 * above + 0.03 * out,
            "acromion": shoulder + 0.17 * 0.224 * h * up, "elbow_lateral": elbow + 0.04 * out,
            "elbow_medial": elbow - 0.04 * out, "wrist_radius": wrist + 0.03 * out,
            "wrist_ulna": wrist - 0.03 * out, "trochanter": hip + 0.052 * h * out,
            "thigh": hip + 0.1 * h * thigh + 0.08 * out, "shank": knee + 0.1 * h * shank + 0.05 * out,
            "thigh_front": hip + 0.15 * h * thigh + 0.06 * _ahead(thigh) + 0.03 * out,
            "thigh_rear": hip + 0.19 * h * thigh + 0.07 * out,
            "shank_front": knee + 0.13 * h * shank + 0.05 * _ahead(shank),
            "shank_rear": knee + 0.2 * h * shank + 0.05 * out,
            "midfoot": heel + 0.08 * h * ahead + 0.07 * above,
            "midfoot_lateral": heel + 0.07 * h * ahead + 0.04 * out,
        }  # fmt: skip
        skin |= {f"{side}_{name}": place for name, place in marks.items()}
    return joints, skin


def _head_and_trunk(joints: dict[str, np.ndarray], hips: np.ndarray, h: float) -> dict[str, np.ndarray]:
    """Markers of pelvis, trunk and head."""
    ahead, up, right = np.eye(3)
    width, depth = (0.052 * h - 0.0073) / 0.33, 0.15  # of the pelvis, whose hips Harrington's lines place
    front = hips + (0.24 * depth + 0.0099) * ahead + (0.30 * width + 0.0109) * up
    slope, reach = np.radians(27), 0.12
    line = np.cos(slope) * ahead - np.sin(slope) * up
    c7 = joints["neck"] - 0.54 * reach * (
        np.cos(slope - np.radians(11)) * ahead - np.sin(slope - np.radians(11)) * up
    )
    band = joints["head_top"] - 0.055 * h * up
    skin = {
        "c7": c7,
        "jugular": c7 + reach * line,
        "sacrum": front - depth * ahead,
        "vertex": joints["head_top"] + 0.01 * up,
    }
    for side, sign in SIDES.items():
        out = -sign * right
        skin[f"{side}_asis"] = front + 0.5 * width * out
        skin[f"{side}_psis"] = front - depth * ahead + 0.05 * out
        skin[f"{side}_head_front"] = band + 0.08 * ahead + 0.07 * out
        skin[f"{side}_head_back"] = band - 0.08 * ahead + 0.07 * out
    return skin


def _down(angle: np.ndarray) -> np.ndarray:
    """Downward, swung forward by an angle (T,)."""
    return np.stack((np.sin(angle), -np.cos(angle), 0 * angle), axis=-1)


def _ahead(down: np.ndarray) -> np.ndarray:
    """Forward, square to the axis (T, 3) of a limb."""
    return np.stack((-down[:, 1], down[:, 0], 0 * down[:, 0]), axis=-1)


def sets(kind: str) -> dict[str, dict[str, str]]:
    """Labels by point of all sets of `markers` or `joints`; `*` stands for L or R."""
    return dict(tomllib.loads(LABELS.read_text(encoding="utf-8"))[kind])


def labelled(points: dict[str, np.ndarray], names: dict[str, str]) -> tuple[list[str], np.ndarray]:
    """Labels and places (T, M, 3) of a set."""
    words = (
        {"left": "left", "right": "right"}
        if "*_foot_index" in names.values() or "mtp" in names
        else {"left": "L", "right": "R"}
    )
    labels, places = [], []
    for point, label in names.items():
        for side in SIDES if "*" in label else ("",):
            labels.append(label.replace("*", words[side]) if side else label)
            places.append(points[f"{side}_{point}"] if side else points[point])
    return labels, np.stack(places, axis=1)
