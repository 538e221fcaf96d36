"""Force plates: a reference of joints and measured forces, from a trial's markers and plates.

Which foot a plate is under is told by its centre of pressure: that of the nearest ankle, over the frames in
which it is loaded. A frame is known if no foot rests on the floor beside its plate, and the person has left
what is not measured.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.contact import rules
from simrecon.errors import InputError
from simrecon.evidence import markers
from simrecon.evidence.npz import write
from simrecon.evidence.opensim import Columns, Markers, read_mot, read_trc
from simrecon.io import atomic
from simrecon.io.messages import counted
from simrecon.metrics.truth import SIDES, TRUTH_SCHEMA
from simrecon.types import Array, Evidence

_PLATES = 9


def plates(table: Columns) -> tuple[Array, Array]:
    """Forces (T, P, 3) in N and centres of pressure (T, P, 3) in m of the plates of a MOT file, in the world.

    Raises:
        InputError: no plate, named `ground_force_1_v`, `ground_force_1_p` and so on.
    """
    numbers = [k for k in range(1, _PLATES + 1) if f"ground_force_{k}_vx" in table.names]
    if not numbers:
        raise InputError(f"{table.source}: found no plate; valid: columns ground_force_1_vx and so on")
    forces = np.stack([table.vectors(f"ground_force_{k}_v") for k in numbers], axis=1)
    centres = np.stack([table.vectors(f"ground_force_{k}_p") for k in numbers], axis=1)
    return forces, centres


def by_foot(force_N: Array, centre_m: Array, ankles_m: Array) -> tuple[Array, Array]:
    """Force and centre of pressure of each foot, (T, 2, 3), left first; centres NaN where not loaded.

    Args:
        force_N: (T, P, 3).
        centre_m: (T, P, 3).
        ankles_m: (T, 2, 3).
    """
    loaded = rules.loaded(force_N[..., 2])  # (T, P)
    distance = np.linalg.norm((centre_m[:, :, None] - ankles_m[:, None])[..., :2], axis=-1)  # (T, P, 2)
    total, moment = np.zeros((2, len(force_N), 2, 3))
    weight = np.zeros((len(force_N), 2, 1))
    for plate in np.flatnonzero(loaded.any(0)):
        foot = int(np.nanmean(distance[loaded[:, plate], plate], axis=0).argmin())
        vertical = np.maximum(force_N[:, plate, 2:], 0.0)  # (T, 1)
        total[:, foot] += force_N[:, plate]
        moment[:, foot] += vertical * centre_m[:, plate]
        weight[:, foot] += vertical
    centre = np.full_like(total, np.nan)
    np.divide(moment, weight, out=centre, where=rules.loaded(weight))
    return total, centre


def known_frames(
    force_N: Array,
    feet_m: Array,
    interval_s: float,
    *,
    below_m: float | None = None,
    feet_on_plates: bool = False,
) -> NDArray[np.bool_]:
    """Frames in which the plates see all of a person's feet, (T,).

    Args:
        force_N: (T, 2, 3) by foot.
        feet_m: (T, 2, 2, 3) heel and toe of each foot.
        interval_s: between frames.
        below_m: the person starts on a box that is not measured; frames count once both feet are below this.
        feet_on_plates: no foot ever leaves its plate but for the air, so that an unloaded plate is right.
    """
    height, speed = feet_m[..., 2], np.zeros(feet_m.shape[:-1])
    speed[1:] = np.linalg.norm(np.diff(feet_m, axis=0), axis=-1) / interval_s
    rest = np.nanpercentile(height, 5.0, axis=0)
    standing = rules.stands_by(height, rest, speed).any(-1)  # (T, 2)
    beside = standing & (force_N[..., 2] <= rules.LOADED_N)
    known = np.ones(len(force_N), dtype=bool) if feet_on_plates else ~beside.any(-1)
    if below_m is not None:
        known &= np.cumsum((height < below_m).all((1, 2))) > 0
    return np.asarray(known)


def make(
    folder: Path,
    trial: Path,
    static: Path,
    forces: Path,
    *,
    mass_kg: float,
    cutoff_hz: float,
    below_m: float | None = None,
    feet_on_plates: bool = False,
    span_s: tuple[float, float] | None = None,
) -> tuple[Path, Path]:
    """Write evidence and reference of a trial, `evidence.npz` and `truth.npz`.

    Args:
        folder: where to, in existence.
        trial: TRC file.
        static: TRC file of the person standing still.
        forces: MOT file of the trial's plates.
        mass_kg: of the person.
        cutoff_hz: low-pass of comparisons with the plates, kept in the reference.
        below_m: as in `known_frames`.
        feet_on_plates: as in `known_frames`.
        span_s: part of the trial to take, or None for all of it.

    Returns:
        Paths of the evidence and of the reference.

    Raises:
        InputError: files that can't be used.
    """
    moving = _span(read_trc(trial), span_s, trial)
    seen = markers.evidence(read_trc(static), moving, mass_kg)
    evidence, truth = folder / "evidence.npz", folder / "truth.npz"
    write(evidence, seen)
    content = _truth(seen, read_mot(forces), below_m, feet_on_plates)
    content |= {"mass_kg": np.array(mass_kg), "grf_cutoff_hz": np.array(cutoff_hz)}
    atomic.write_npz(truth, content)
    return evidence, truth


def _truth(
    seen: Evidence, table: Columns, below_m: float | None, feet_on_plates: bool
) -> dict[str, NDArray[Any]]:
    times, at = seen.times_s, {name: _filled(seen.joints_m[:, k]) for k, name in enumerate(seen.joint_names)}
    if table.times_s[0] > times[0] + 0.02 or table.times_s[-1] < times[-1] - 0.02:
        found = f"forces from {table.times_s[0]:g} to {table.times_s[-1]:g} s"
        raise InputError(f"{table.source}: found {found}; valid: all of {times[0]:g} to {times[-1]:g} s")
    forces, centres = (_at(times, table.times_s, values) for values in plates(table))
    ankles = np.stack([at[f"{side}_ankle"] for side in SIDES], axis=1)
    force, centre = by_foot(forces, centres, ankles)
    feet = np.stack([[at[f"{side}_{end}"] for end in ("heel", "toe")] for side in SIDES])  # (2, 2, T, 3)
    interval = float(np.median(np.diff(times)))
    content = {
        "schema": TRUTH_SCHEMA,
        "times_s": times,
        "joint_names": seen.joint_names,
        "joints_m": np.stack([at[name] for name in seen.joint_names], axis=1),
        "grf_known": known_frames(
            force,
            feet.transpose(2, 0, 1, 3),
            interval,
            below_m=below_m,
            feet_on_plates=feet_on_plates,
        ),
    }
    for column, side in enumerate(SIDES):
        content |= {f"grf_{side}_N": force[:, column], f"cop_{side}_m": centre[:, column]}
    return {key: np.asarray(value) for key, value in content.items()}


def _filled(points: Array) -> Array:
    """Unseen frames by linear interpolation, (T, 3)."""
    known, rows = np.isfinite(points).all(-1), np.arange(len(points))
    return np.stack([np.interp(rows, rows[known], points[known, axis]) for axis in range(3)], axis=-1)


def _at(times_s: Array, given_times_s: Array, values: Array) -> Array:
    flat = values.reshape(len(values), -1)
    rows = [np.interp(times_s, given_times_s, flat[:, column]) for column in range(flat.shape[1])]
    return np.stack(rows, axis=-1).reshape(len(times_s), *values.shape[1:])


def _span(moving: Markers, span_s: tuple[float, float] | None, source: Path) -> Markers:
    if span_s is None:
        return moving
    kept = (moving.times_s >= span_s[0] - 1e-9) & (moving.times_s <= span_s[1] + 1e-9)
    if kept.sum() < 3:
        found = f"{counted(int(kept.sum()), 'frame')} from {span_s[0]:g} to {span_s[1]:g} s"
        raise InputError(f"{source}: found {found}; valid: three or more")
    return Markers(moving.times_s[kept], moving.names, moving.points_m[kept])
