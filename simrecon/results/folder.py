"""The result folder (`simrecon.result/1`): written aside, renamed into place, and read back with checks."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simrecon import scene as scenes
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.io.arrays import Arrays, load
from simrecon.replay import FALLBACK, NO_STEP, SIMULATED
from simrecon.results import report
from simrecon.results.report import SCHEMA
from simrecon.types import Array, IntArray, Motion, Report

if TYPE_CHECKING:
    from simrecon.pipeline import Reconstruction
    from simrecon.softfloor import Calibration

MOTION, MODEL, SCENE, REPORT = "motion.npz", "model.xml", "scene.toml", "report.json"
OVERLAYS = ("overlay.mp4", "overlay.png")
EXPORTS = ("motion.bvh",)
FILES = (MOTION, MODEL, SCENE, REPORT, *OVERLAYS, *EXPORTS)
"""All that a result folder may hold: only a folder of these is ever replaced."""


def check_writable(folder: Path | str) -> None:
    """Check, before any long work, that a result can be written; leaves nothing behind.

    Args:
        folder: of the result, which may be missing, empty, or an earlier result.

    Raises:
        InputError: it is a file, holds what is no result, or can't be made.
    """
    target = Path(folder).resolve()
    try:
        if target.exists():
            _check_replaceable(folder, target)
        parent = target.parent
        while not parent.exists():
            parent = parent.parent
        os.rmdir(tempfile.mkdtemp(prefix=f".{target.name}.", dir=parent))
    except OSError as error:
        raise InputError(_cannot_write(folder, error)) from error


def write(
    folder: Path | str,
    run: Reconstruction,
    *,
    plan_name: str,
    seed: int,
    threads: int = 0,
    input_name: str = "",
    video: Path | str | None = None,
    calibration: Calibration | None = None,
) -> Report:
    """Write a result folder: the whole of it appears at once, or nothing does.

    All is written into a folder beside it, which is then renamed. An earlier result is replaced.

    Args:
        folder: where to; parents are made.
        run: what to write.
        plan_name: of the plan, as the user gave it.
        seed: of the run.
        threads: of the simulator, 0 for one per core.
        input_name: of the file that the evidence was read from.
        video: what the overlay is drawn on, or None.
        calibration: of a soft floor, or None.

    Returns:
        What is in `report.json`.

    Raises:
        InputError: the folder can't be written (see `check_writable`), or the video can't be used.
    """
    check_writable(folder)
    target = Path(folder).resolve()
    partial = target.with_name(f".{target.name}.{os.getpid()}.partial")
    try:
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
    except OSError as error:
        raise InputError(_cannot_write(folder, error)) from error
    try:
        (partial / MOTION).write_bytes(_archive(run.motion))
        (partial / MODEL).write_text(run.problem.mjcf, encoding="utf-8")
        (partial / SCENE).write_text(scenes.dumps(run.fit.scene), encoding="utf-8")
        began = time.perf_counter()
        overlay.write(partial, clip(run), video)
        seconds = {**run.seconds, "overlay": time.perf_counter() - began}
        said = report.make(
            run, seconds, input_name=input_name, plan_name=plan_name, seed=seed, threads=threads
        )
        if calibration is not None:
            said["soft_floor"] = report.soft_floor(calibration)
        text = json.dumps(said, indent=1, ensure_ascii=False, allow_nan=False)
        (partial / REPORT).write_text(text + "\n", encoding="utf-8")
        _put_in_place(partial, target)
    except OSError as error:
        raise InputError(_cannot_write(folder, error)) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return said


def read_report(folder: Path | str) -> Report:
    """Read `report.json` of a result folder.

    Raises:
        InputError: it can't be read, or does not say of what, of whom and how the result was made.
    """
    path = Path(folder) / REPORT
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        found["input"]["name"], found["input"]["sha256"], found["person"]["height_m"], found["plan_name"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: can't be read ({error}); valid: the report of a result folder") from error
    return dict(found)


def read(folder: Path | str) -> Motion:
    """Read and check the motion of a result folder.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    if not Path(folder).is_dir():
        raise InputError(f"{folder}: found no such folder; valid: a result folder, with {MOTION}")
    arrays = load(Path(folder) / MOTION)
    arrays.text("schema", (SCHEMA,))
    joint_names, parts = arrays.names("joint_names", "K"), arrays.names("contact_body", "C")
    times = arrays.finite("times_s", ("T",))
    if (np.diff(times) <= 0).any():
        arrays.fail("times_s", "times that do not increase", "increasing times in seconds")
    qpos, qvel = arrays.finite("qpos", ("T", "nq")), arrays.finite("qvel", ("T", "nv"))
    torque, state0 = arrays.finite("torque_Nm", ("T", "nu")), arrays.finite("state0", ("nstate",))
    ctrl = _control(arrays, torque.shape[1])
    step = _integers(arrays, "frame_step", NO_STEP, len(ctrl))
    status = _integers(arrays, "status", SIMULATED, FALLBACK)
    if ((step == NO_STEP) != (status == FALLBACK)).any():
        valid = f"{NO_STEP} at the frames of status {FALLBACK}, and there only"
        arrays.fail("frame_step", "steps that do not fit the status", valid)
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
        kinematic_qpos=arrays.finite("kinematic_qpos", ("T", "nq")) if "kinematic_qpos" in arrays else None,
    )


def _control(arrays: Arrays, motors: int) -> Array:
    """`ctrl` (N, nu), which alone may be empty: where nothing was simulated."""
    if arrays.array("ctrl").shape == (0, motors):
        return np.empty((0, motors))
    return arrays.finite("ctrl", ("N", "nu"))


def _integers(arrays: Arrays, key: str, low: int, high: int) -> IntArray:
    values = arrays.finite(key, ("T",))
    if (values != np.round(values)).any() or values.min() < low or values.max() > high:
        found = f"{values.min():g} to {values.max():g}"
        arrays.fail(key, found, f"whole numbers from {low} to {high}")
    return values.astype(np.int64)


def _archive(motion: Motion) -> bytes:
    """The bytes of `motion.npz`; same motion, same bytes."""
    content: dict[str, Any] = {item.name: getattr(motion, item.name) for item in dataclasses.fields(motion)}
    content = {key: value for key, value in content.items() if value is not None}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, schema=SCHEMA, **content)
    return buffer.getvalue()


def clip(run: Reconstruction) -> overlay.Clip:
    """What is drawn of a run."""
    motion, evidence, camera = run.motion, run.evidence, run.fit.camera
    seen = bool(evidence.keypoint_names)
    return overlay.Clip(
        model=run.problem.model,
        times_s=motion.times_s,
        qpos=motion.qpos,
        camera=None if camera is None else cameras.resampled(camera, run.fit.times_s, motion.times_s),
        keypoints_px=evidence.keypoints_px if seen else None,
        scores=evidence.scores if seen else None,
        contact_point_m=motion.contact_point_m,
        contact_force_N=motion.contact_force_N,
        status=motion.status,
    )


def _put_in_place(partial: Path, target: Path) -> None:
    """Rename the finished folder; an earlier result is moved aside first and deleted last."""
    if not target.exists():
        partial.rename(target)
        return
    earlier = partial.with_suffix(".earlier")
    target.rename(earlier)
    try:
        partial.rename(target)
    except BaseException:
        if not target.exists():
            earlier.rename(target)
        raise
    shutil.rmtree(earlier, ignore_errors=True)


def _check_replaceable(folder: Path | str, target: Path) -> None:
    """Refuse a target that is no folder, or holds anything that simrecon did not write there."""
    if not target.is_dir():
        raise InputError(f"{folder}: found a file; valid: a folder for the result, which is made")
    if target.is_mount():
        raise InputError(f"{folder}: found a mount point, which can't be renamed; valid: a folder inside it")
    inside = sorted(path.name for path in target.iterdir())
    foreign = [name for name in inside if name not in FILES]
    if foreign or (inside and REPORT not in inside):
        found = foreign[0] if foreign else f"no {REPORT}"
        raise InputError(
            f"{folder}: found a folder that holds {found}; "
            f"valid: a new or empty folder, or an earlier result with nothing added"
        )
    if inside and not _is_result(target):
        raise InputError(
            f"{folder}: found a {REPORT} that is not simrecon's; "
            f"valid: a new or empty folder, or an earlier result"
        )


def _is_result(target: Path) -> bool:
    try:
        found = json.loads((target / REPORT).read_text(encoding="utf-8"))
    except ValueError:  # not UTF-8, or not JSON
        return False
    return isinstance(found, dict) and str(found.get("schema", "")).startswith("simrecon.result/")


def _cannot_write(folder: Path | str, error: OSError) -> str:
    return f"{folder}: can't be written ({error.strerror or error}); valid: a folder in a writable place"
