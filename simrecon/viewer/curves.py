"""The curves of a motion, as the page draws them: plain lists, rounded to what a reader can see."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from simrecon.body.primitives import FEET
from simrecon.contact import parts, rules
from simrecon.exports.axes import TO_Y_UP
from simrecon.geometry import rotations
from simrecon.results import Result, contacts, kinematic
from simrecon.types import Array, Flags, IntArray, Interval, Motion, runs

AXES = ("side (x)", "bend (y)", "twist (z)")
"""Components of a joint's rotation vector, in the axes of the upper segment: forward, left, up."""


def make(result: Result, rows: IntArray) -> dict[str, Any]:
    """All curves of a result.

    Args:
        result: opened.
        rows: (F,) frames of the motion that are shown.

    Returns:
        By name; `times_s` count from the first frame of the motion, places are y up.
    """
    motion, body = result.motion, result.body
    return {
        "times_s": rounded(motion.times_s[rows] - motion.times_s[0], 4),
        "status": motion.status[rows].tolist(),
        "weight_N": round(body.mass_kg * float(np.linalg.norm(result.model.opt.gravity)), 1),
        "feet_N": {
            name: rounded(forces(motion)[rows, motion.contact_body.index(name), 2], 0) for name in FEET
        },
        "grf_N": rounded(forces(motion)[rows].sum(axis=1)[:, 2], 0),
        "bands_N": _bands(motion, rows),
        "com_m": rounded(motion.com_m[rows] @ TO_Y_UP.T, 4),
        "root_height_m": rounded(motion.qpos[rows, 2], 4),
        "root_speed_mps": rounded(np.linalg.norm(motion.qvel[rows, :3], axis=1), 3),
        "contacts": _contacts(result),
        "forces": _pushes(motion, rows),
        **_joints(result, rows),
        **_moments(result, rows),
    }


def rounded(values: Array, digits: int) -> list[Any]:
    """Numbers for JSON, whole ones without a point."""
    near = np.round(np.asarray(values, float), digits)
    listed: list[Any] = np.asarray(near.astype(np.int64) if digits == 0 else near).tolist()
    return listed


def forces(motion: Motion) -> Array:
    """Forces of the scene (T, C, 3) N, none in the first frame, where they would be those of an instant."""
    began = motion.begins
    return np.asarray(np.where(began[:, None, None], 0.0, motion.contact_force_N))


def _pushes(motion: Motion, rows: IntArray) -> dict[str, Any]:
    """Force, y up, and its place on each primitive that the scene pushes at any time."""
    force_N = forces(motion)[rows]
    touched = np.flatnonzero(rules.loaded(np.linalg.norm(force_N, axis=-1)).any(axis=0))
    place_m = np.nan_to_num(motion.contact_point_m[rows][:, touched] @ TO_Y_UP.T)
    return {
        "body": [motion.contact_body[column] for column in touched],
        "force_N": rounded(force_N[:, touched] @ TO_Y_UP.T, 0),
        "place_m": rounded(place_m, 3),
    }


def _bands(motion: Motion, rows: IntArray) -> dict[str, Any] | None:
    """90 % bands of the vertical forces (2, F): low and high end; None where they are not known."""
    if motion.band_feet_N is None or motion.band_grf_N is None:
        return None
    left, right = np.moveaxis(motion.band_feet_N[rows][:, :, 2], 1, 0)  # (F, 2) each
    bands = {FEET[0]: left, FEET[1]: right, "all": motion.band_grf_N[rows, 2]}
    return {name: _known(band, 0) for name, band in bands.items()}


def _known(values: Array, digits: int) -> list[Any]:
    """Values (F, ...) for JSON, frames last; None where they are not finite."""
    own = np.moveaxis(np.round(values, digits), 0, -1)
    listed = own.astype(object)
    listed[~np.isfinite(own)] = None
    plain: list[Any] = listed.tolist()
    return plain


def _contacts(result: Result) -> list[dict[str, Any]]:
    """When each part touched, s from the first frame on: those of `contact.parts`, then other primitives."""
    motion = replace(result.motion, contact_force_N=forces(result.motion))
    spans = contacts.spans(result.body, result.scene, motion)
    known = {name for part in parts.parts() for name in part.at}
    found = {name: list(intervals) for name, intervals in spans.items()}
    loaded = rules.loaded(np.linalg.norm(motion.contact_force_N, axis=-1))
    for column, name in enumerate(motion.contact_body):
        if name not in known:
            found[name] = list(_spans(loaded[:, column], motion.times_s))
    began = float(motion.times_s[0])
    return [
        {
            "part": name.replace("_", " "),
            "spans_s": [[round(a - began, 3), round(b - began, 3)] for a, b in spans],
        }
        for name, spans in found.items()
        if spans
    ]


def _spans(flags: Flags, times_s: Array) -> list[Interval]:
    """First and last time of each run of flags (T,)."""
    return [(float(times_s[rows.start]), float(times_s[rows.stop - 1])) for rows in runs(flags)]


def _joints(result: Result, rows: IntArray) -> dict[str, Any]:
    """Angles (J, 3, F), degrees from the T-pose, and torques (J, 3, F) of the joints, None at the start."""
    motion, body = result.motion, result.body
    names = body.skeleton.names[1:]
    quats = motion.qpos[rows, 7 : kinematic.coordinates(body)].reshape(len(rows), -1, 4)  # (F, J, 4)
    turns = rotations.log(rotations.multiply(body.skeleton.rest[1:], quats))
    torque = motion.torque_Nm[rows, : 3 * len(names)].reshape(len(rows), -1, 3)
    torques = np.round(np.moveaxis(torque, 0, -1), 1).astype(object)
    torques[..., motion.begins[rows]] = None  # that of an instant, before motors have settled
    return {
        "joints": [name.replace("_", " ") for name in names],
        "axes": list(AXES),
        "angles_deg": rounded(np.degrees(np.moveaxis(turns, 0, -1)), 1),
        "torques_Nm": torques.tolist(),
    }


def _moments(result: Result, rows: IntArray) -> dict[str, Any]:
    """Moments (J, 3, F) and powers (J, F) of the joints, and the cut-off of their filter; none of a plan."""
    if result.motion.is_planned or not len(result.motion.ctrl):
        return {"moments_Nm": None, "powers_W": None, "cutoff_Hz": None}
    found = result.moments()
    return {
        "moments_Nm": _known(found.moment_Nm[rows], 1),
        "powers_W": _known(found.power_W[rows], 0),
        "cutoff_Hz": round(found.cutoff_hz, 1),
    }
