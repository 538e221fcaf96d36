"""`motion.npz` ↔ `Motion`; same motion, same bytes.

In the file, `state0`, `ctrl` and `frame_step` are those of the first simulation, so that who knows nothing of
restarts replays it; what was simulated after a gap stands beside them.
"""

from __future__ import annotations

import dataclasses
import io
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence import keys
from simrecon.io.arrays import Arrays
from simrecon.io.npz import load
from simrecon.replay import NO_STEP, PLANNED, SIMULATED
from simrecon.results.folder import MOTION, SCHEMA
from simrecon.types import Array, IntArray, Motion

PERSON_ROTATIONS = 17
UNIT_TOLERANCE = 1e-3


def dumps(motion: Motion) -> bytes:
    """The bytes of `motion.npz`."""
    content: dict[str, Any] = {item.name: getattr(motion, item.name) for item in dataclasses.fields(motion)}
    content = {key: value for key, value in content.items() if value is not None}
    content |= _split(motion)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, schema=SCHEMA, **content)
    return buffer.getvalue()


def _split(motion: Motion) -> dict[str, Array]:
    """The keys in which a motion with restarts differs from its file; none without."""
    if motion.restart_step is None:
        return {}
    first, step = int(motion.restart_step[0]), motion.frame_step
    return {
        "ctrl": motion.ctrl[:first],
        "restart_ctrl": motion.ctrl[first:],
        "frame_step": np.where(step < first, step, NO_STEP),
        "restart_frame_step": np.where(step < first, NO_STEP, step),
    }


def read(folder: Path | str) -> Motion:
    """Read and check a motion: of a result folder, or of a file like its `motion.npz`.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    path = Path(folder)
    if not path.exists():
        raise InputError(f"{folder}: found no such folder; valid: a result folder, with {MOTION}")
    arrays = load(path / MOTION if path.is_dir() else path)
    arrays.text("schema", (SCHEMA,))
    joint_names, parts = arrays.names("joint_names", "K"), arrays.names("contact_body", "C")
    times = keys.times(arrays)
    qpos, qvel = arrays.finite("qpos", ("T", "nq")), arrays.finite("qvel", ("T", "nv"))
    torque, state0 = arrays.finite("torque_Nm", ("T", "nu")), arrays.finite("state0", ("nstate",))
    ctrl = _control(arrays, "ctrl", torque.shape[1])
    step = _integers(arrays, "frame_step", NO_STEP, len(ctrl))
    if "restart_step" in arrays:
        ctrl = np.concatenate((ctrl, _control(arrays, "restart_ctrl", torque.shape[1])))
        step = np.maximum(step, _integers(arrays, "restart_frame_step", NO_STEP, len(ctrl)))
    status = _integers(arrays, "status", SIMULATED, PLANNED)
    if len(set((status == PLANNED).tolist())) > 1:
        arrays.fail("status", f"{PLANNED} at some frames", f"{PLANNED} at all frames or at none")
    if ((step == NO_STEP) != (status != SIMULATED)).any():
        valid = f"{NO_STEP} at the frames of another status than {SIMULATED}, and there only"
        arrays.fail("frame_step", "steps that do not fit the status", valid)
    before = {
        key: arrays.finite(key, ("T", "nq")) if key in arrays else None
        for key in ("kinematic_qpos", "planned_qpos")
    }
    for key, values in {"qpos": qpos, **before}.items():
        _check_rotations(arrays, key, values)
    restart_step, restart_state = _restarts(arrays, len(ctrl), len(state0))
    return Motion(
        times_s=times,
        frame_step=step,
        status=status.astype(np.uint8),
        qpos=qpos,
        qvel=qvel,
        state0=state0,
        ctrl=ctrl,
        joint_names=joint_names,
        joints_m=arrays.finite("joints_m", ("T", "K", 3)),
        com_m=arrays.finite("com_m", ("T", 3)),
        torque_Nm=torque,
        contact_body=parts,
        contact_force_N=arrays.finite("contact_force_N", ("T", "C", 3)),
        contact_point_m=arrays.floats("contact_point_m", ("T", "C", 3)),
        contact_slip_mps=arrays.floats("contact_slip_mps", ("T", "C")),
        grf_N=arrays.finite("grf_N", ("T", 3)),
        restart_step=restart_step,
        restart_state=restart_state,
        **before,
        **_bands(arrays),
    )


def _bands(arrays: Arrays) -> dict[str, Array]:
    """Bands and probabilities, those that are there."""
    shapes: dict[str, tuple[str | int, ...]] = {
        "band_joints_m": ("T", "K", 3, 2),
        "band_grf_N": ("T", 3, 2),
        "band_feet_N": ("T", 2, 3, 2),
        "contact_probability": ("T", "C"),
    }
    return {key: arrays.floats(key, shape) for key, shape in shapes.items() if key in arrays}


def _restarts(arrays: Arrays, steps: int, size: int) -> tuple[IntArray | None, Array | None]:
    """Where the simulation begins anew after gaps, and its states there; None without gaps."""
    if "restart_step" not in arrays:
        return None, None
    step, state = arrays.finite("restart_step", ("R",)), arrays.finite("restart_state", ("R", size))
    if (
        (np.diff(step) <= 0).any()
        or (step != np.round(step)).any()
        or not ((step > 0) & (step <= steps)).all()
    ):
        arrays.fail("restart_step", "steps out of order or range", f"increasing whole numbers up to {steps}")
    return step.astype(np.int64), state


def _check_rotations(arrays: Arrays, key: str, qpos: Array | None) -> None:
    """The quaternions of the person, root first: place of the root, then one for each segment."""
    if qpos is None:
        return
    count = min((qpos.shape[1] - 3) // 4, PERSON_ROTATIONS)
    norms = np.linalg.norm(qpos[:, 3 : 3 + 4 * count].reshape(len(qpos), count, 4), axis=-1)
    if norms.size and np.abs(norms - 1).max() > UNIT_TOLERANCE:
        text = f"rotations of norm {norms.min():g} to {norms.max():g}"
        arrays.fail(key, text, "unit quaternions w x y z behind the place of the root")


def _control(arrays: Arrays, key: str, motors: int) -> Array:
    """Control (N, nu), which alone may be empty: where nothing was simulated."""
    if arrays.array(key).shape == (0, motors):
        return np.empty((0, motors))
    return arrays.finite(key, ("N" if key == "ctrl" else "N'", "nu"))


def _integers(arrays: Arrays, key: str, low: int, high: int) -> IntArray:
    values = arrays.finite(key, ("T",))
    if (values != np.round(values)).any() or values.min() < low or values.max() > high:
        found = f"{values.min():g} to {values.max():g}"
        arrays.fail(key, found, f"whole numbers from {low} to {high}")
    return values.astype(np.int64)
