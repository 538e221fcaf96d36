"""Scores of a result folder that need its model: primitives, contact forces, torques, force plates."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.metrics import bodies, contact, dynamics, pose, touch
from simrecon.metrics.bodies import Configurations
from simrecon.metrics.joints import H36M_HZ, PAPER_HZ, Clip, Scores, every, resampled
from simrecon.metrics.statistics import Series, low_pass, of_frames
from simrecon.metrics.truth import Plates, at
from simrecon.replay import SIMULATED
from simrecon.results import folder as folders
from simrecon.results import motion_file
from simrecon.types import Array, Motion, Scene

# Primitives of the parts that `metrics.bodies` puts capsules or points on; left side and centre only.
_PARTS = {
    "pelvis": ("pelvis", "left_buttock", "right_buttock"),
    "trunk": ("abdomen", "waist", "ribs", "thorax", "left_clavicle", "right_clavicle"),
    "left_thigh": ("left_thigh",),
    "left_shank": ("left_calf", "left_shin"),
    "left_upper_arm": ("left_upper_arm",),
    "left_forearm": ("left_forearm", "left_hand"),
    "left_foot": ("left_foot",),
}
_POINTS = {"left_foot": ("left_heel", "left_toe")}


@dataclass(frozen=True, eq=False)
class Simulated:
    """A result folder; T frames.

    Attributes:
        motion, scene, model, report: what it holds.
        body: of the simulated configurations; kinematic: of the kinematic fit, or None.
    """

    motion: Motion
    scene: Scene
    model: mujoco.MjModel
    report: dict[str, Any]
    body: Configurations
    kinematic: Configurations | None

    @property
    def radii_m(self) -> dict[str, float]:
        """Of the primitives that are capsules in scores."""
        return {name: float(self.model.geom(name).size[0]) for name in bodies.capsule_primitives()}

    @property
    def mass_kg(self) -> float:
        """Of the body."""
        return float(self.model.body_subtreemass[self.model.jnt_bodyid[0]])

    @property
    def rest_m(self) -> dict[str, float]:
        """Height of its heels and toes over the sole, by name (`joints.Track`)."""
        return foot_rest(self.model)


def foot_rest(model: mujoco.MjModel) -> dict[str, float]:
    """Height of the sites of heels and toes over the sole of the foot's box, m, by name."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = {}
    for foot in bodies.FEET:
        box, side = model.geom(foot).id, foot.split("_")[0]
        for point in (f"{side}_heel", f"{side}_toe"):
            offset = data.site(point).xpos - data.geom_xpos[box]
            found[point] = float(data.geom_xmat[box].reshape(3, 3)[:, 2] @ offset + model.geom_size[box, 2])
    return found


def read(folder: Path | str) -> Simulated:
    """Read a result folder and work out its geometry.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    motion, path = motion_file.read(folder), Path(folder)
    report = _report(path / folders.REPORT)
    scene = scenes.read(path / folders.SCENE)
    try:
        model = mujoco.MjModel.from_xml_path(str(path / folders.MODEL))
    except ValueError as error:
        raise InputError(
            f"{path / folders.MODEL}: can't be loaded ({error}); valid: a result's model"
        ) from error
    if (model.nq, model.nu) != (motion.qpos.shape[1], motion.torque_Nm.shape[1]):
        found = f"{motion.qpos.shape[1]} coordinates and {motion.torque_Nm.shape[1]} motors"
        raise InputError(
            f"{path / folders.MOTION}: qpos: found {found}; valid: those of {folders.MODEL}, "
            f"{model.nq} and {model.nu}"
        )
    parts, points = motion.contact_body, motion.joint_names
    body = bodies.configurations(model, scene, motion.qpos, parts, points, motion.qvel)
    kinematic = None
    if motion.kinematic_qpos is not None:
        kinematic = bodies.configurations(model, scene, motion.kinematic_qpos, parts, points)
    return Simulated(motion, scene, model, report, body, kinematic)


def geometry(
    shape: Configurations, names: Sequence[str], times_s: Array, kept: contact.Flags | None = None
) -> Scores:
    """Footskate, float and penetration of the primitives.

    Args:
        shape: of the configurations of a body.
        names: of its points.
        times_s: (T,) of the frames.
        kept: (T,) frames that count, or None for all.
    """
    rows = np.ones(len(shape.feet_m), bool) if kept is None else np.asarray(kept)  # (T,)
    if rows.sum() < 2:
        return Scores()
    depth = np.maximum(0.0, -shape.floor_m[rows].min(-1))
    deep = (shape.scene_m[rows] < -contact.PENETRATION_TOLERANCE_M).any(-1)
    series = {
        "penetration_mean_mm": of_frames(depth, scale=1e3),
        "penetration_pct": of_frames(deep.astype(np.float64), scale=100.0),
    }
    feet = _feet(shape, names, times_s, rows)
    return Scores(series | feet, {"penetration_max_mm": 1e3 * float(depth.max())})


def _feet(
    shape: Configurations, names: Sequence[str], times_s: Array, kept: contact.Flags
) -> dict[str, Series]:
    """Footskate and float (Gärtner 2022) at 25 frames a second."""
    ankles = [list(names).index(f"{foot.split('_')[0]}_ankle") for foot in bodies.FEET]
    found = (shape.points_m[:, ankles], shape.corners_m, shape.feet_m, shape.soles_m, shape.scene_m)
    joints, corners, feet, soles, parts = (
        resampled(times_s[kept], values[kept], H36M_HZ) for values in found
    )
    flags = {
        "footskate_gartner_pct": contact.footskate_steps(joints, feet),
        "footskate_sole_pct": contact.footskate_steps(corners, soles),
        "float_gartner_pct": contact.float_frames(feet),
        "float_body_pct": contact.float_body_frames(feet, parts),
    }
    return {name: of_frames(flag.astype(np.float64), scale=100.0) for name, flag in flags.items()}


def forces(of: Simulated, on: Clip) -> Scores:
    """Contact forces, torques and power of the simulated frames.

    Args:
        of: the result.
        on: the clip, for flight and contacts of the reference.
    """
    motion, mass = of.motion, of.mass_kg
    kept = motion.status == SIMULATED
    if kept.sum() < 2:
        return Scores()
    grf = motion.grf_N[kept]
    ends = np.maximum(motion.frame_step[kept], 0) * of.model.opt.timestep  # (T,)
    slow = dynamics.interval_means(ends, grf, every(ends, PAPER_HZ))
    flight = at(motion.times_s[kept], on.times_s, on.flight.astype(np.float64)) > 0.99
    columns = motor_dofs(of.model)
    torque, rate = motion.torque_Nm[kept], motion.qvel[kept][:, columns]
    numbers = {
        "grf_mean_pct": float(dynamics.mean_grf_pct(slow, mass)),
        "grf_max_pct": float(dynamics.max_grf_pct(slow, mass)),
        "grf_peak_pct": float(dynamics.max_grf_pct(grf[1:], mass)),
        "grf_ballistic_pct": dynamics.ballistic_grf_pct(grf, flight, mass),
        "peak_torque_Nmpkg": dynamics.peak_torque(torque, mass),
        "peak_power_Wpkg": dynamics.peak_power(torque, rate, mass),
        "contact_f1_force": _force_f1(of, on),
    }
    vertical = dynamics.body_weight_pct(grf[:, 2], mass)
    steps = np.diff(motion.frame_step[kept])
    moved = steps > 0
    residual = dynamics.residual_pct(
        of.body.com_velocity_mps[kept], grf, mass, np.maximum(steps, 1) * of.model.opt.timestep
    )[moved]
    numbers["residual_max_pct"] = float(residual.max()) if len(residual) else float("nan")
    numbers |= touch.scores(_pushed(of, on), on.near, "touch_f1_force")
    return Scores(
        {"grf_vertical_mean_pct": of_frames(vertical), "residual_mean_pct": of_frames(residual)}, numbers
    )


def reported(of: Simulated) -> Scores:
    """What only the run itself could measure."""
    found = {
        "mpjpe_2d_px": of.report.get("metrics", {}).get("mpjpe_2d_px"),
        "self_penetration_max_mm": of.report.get("audit", {}).get("self_penetration_max_mm"),
    }
    return Scores({}, {name: float(value) for name, value in found.items() if value is not None})


def against_plates(of: Simulated, plates: Plates, truth_times_s: Array, on: Clip, mass_kg: float) -> Scores:
    """Contact forces against those that plates measured, at the reference's times.

    The first scores take all frames, the whole force of the scene, and no filter. The others take the force
    on the feet, which is the mean since the frame before, at the middle of that interval, low-passed on both
    sides at the reference's cut-off, in frames in which no foot stood beside its plate.

    Args:
        of: the result.
        plates: measured.
        truth_times_s: (S,) of the plates.
        on: the clip.
        mass_kg: of the person who was measured.
    """
    times, motion = on.times_s, of.motion
    measured = at(times, truth_times_s, plates.force_N)  # (T, 2, 3)
    total = at(times, motion.times_s, motion.grf_N)  # (T, 3)
    columns = [motion.contact_body.index(foot) for foot in bodies.FEET]
    middle = 0.5 * (motion.times_s[1:] + motion.times_s[:-1])  # of the intervals; the first frame ends none
    feet = at(times, middle, motion.contact_force_N[1:, columns])  # (T, 2, 3)
    error = dynamics.body_weight_pct(total - measured.sum(1), mass_kg)[:, 2]
    found = Scores(
        {
            "grf_vertical_mae_pct_bw": of_frames(np.abs(error)),
            "grf_vertical_rmse_pct_bw": of_frames(np.square(error), root=True),
            "grf_mean_pct_bw": of_frames(dynamics.body_weight_pct(total[:, 2], mass_kg)),
        },
        {"grf_corr": dynamics.correlation(total[:, 2], measured.sum(1)[:, 2])},
    )
    known = at(times, truth_times_s, plates.known.astype(np.float64)) > 0.99
    found |= filtered(feet, measured, known, on.interval_s, plates.cutoff_hz, mass_kg)
    if plates.centre_m is not None:
        seen = known[:, None] & (measured[..., 2] > dynamics.LOADED_N)
        target = at(times, truth_times_s, np.nan_to_num(plates.centre_m))
        moment = motion.contact_force_N[1:, columns, 2:] * np.nan_to_num(motion.contact_point_m[1:, columns])
        centre = np.full_like(feet, np.nan)  # the moment over the force, so that no unloaded foot enters
        np.divide(at(times, middle, moment), feet[..., 2:], out=centre, where=feet[..., 2:] > 0)
        distance = dynamics.centre_of_pressure_error(
            centre, np.where(seen[..., None], target, np.nan), feet[..., 2], measured[..., 2]
        )
        found |= Scores({}, {"plate_cop_mm": 1e3 * distance})
    return found


def filtered(
    feet: Array, measured: Array, known: contact.Flags, interval_s: float, cutoff_hz: float, mass_kg: float
) -> Scores:
    """Force on the feet against the plates, both low-passed, percent of body weight.

    Args:
        feet: (T, 2, 3) N.
        measured: (T, 2, 3) N.
        known: (T,) frames that count.
        interval_s: between frames.
        cutoff_hz: of the filter.
        mass_kg: of the person.
    """
    a, b = (dynamics.body_weight_pct(low_pass(x, interval_s, cutoff_hz), mass_kg) for x in (feet, measured))
    whole, plate = a.sum(1), b.sum(1)  # (T, 3)
    error = whole - plate
    flag = np.asarray(known)
    peak = float("nan")
    if flag.any():
        peak = float(whole[flag, 2].max() - plate[flag, 2].max())
    correlation = dynamics.correlation(whole[flag, 2], plate[flag, 2])
    return Scores(
        {
            "plate_vertical_mae_pct": of_frames(np.abs(error[:, 2]), flag),
            "plate_vertical_rmse_pct": of_frames(np.square(error[:, 2]), flag, root=True),
            "plate_horizontal_mae_pct": of_frames(np.abs(error[:, :2]), np.repeat(flag[:, None], 2, axis=1)),
            "plate_left_mae_pct": of_frames(np.abs((a - b)[:, 0, 2]), flag),
            "plate_right_mae_pct": of_frames(np.abs((a - b)[:, 1, 2]), flag),
        },
        {"plate_vertical_corr": correlation, "plate_peak_error_pct": peak},
    )


def motor_dofs(model: mujoco.MjModel) -> Array:
    """Degree of freedom of each motor, (nu,)."""
    axis = np.argmax(np.abs(model.actuator_gear[:, :3]), axis=1)
    return np.asarray(model.jnt_dofadr[model.actuator_trnid[:, 0]] + axis)


def _force_f1(of: Simulated, on: Clip) -> float:
    """F1 of contact, mean over parts: force above `LOADED_N` against where the reference's capsules touch."""
    motion = of.motion
    loads = np.linalg.norm(at(on.times_s, motion.times_s, motion.contact_force_N), axis=-1)  # (T, C)
    found, wanted = [], []
    for name, primitives in _PARTS.items():
        for side in {name, name.replace("left_", "right_", 1)}:
            own = [motion.contact_body.index(p) for p in _of_side(primitives, side)]
            parts = [p for p in _of_side(_POINTS.get(name, (name,)), side) if p in on.parts.names]
            if parts:
                found.append((loads[:, own] > dynamics.LOADED_N).any(-1))
                wanted.append(on.touching[:, [on.parts.names.index(p) for p in parts]].any(-1))
    f1 = contact.contact_f1(np.stack(found, axis=-1), np.stack(wanted, axis=-1))
    return float(pose.mean_known(f1, (0,)))


def _pushed(of: Simulated, on: Clip) -> contact.Flags:
    """Which parts of the body (`touch.PARTS`) the scene pushes with more than `LOADED_N`, (T, P)."""
    motion = of.motion
    loads = np.linalg.norm(at(on.times_s, motion.times_s, motion.contact_force_N), axis=-1)  # (T, C)
    found = []
    for name, capsules in touch.PARTS.items():
        foot = name.replace("_foot", "_heel") == capsules[0]
        wanted = [name] if foot else [p for part in capsules for p in _primitives(part)]
        found.append((loads[:, [motion.contact_body.index(p) for p in wanted]] > dynamics.LOADED_N).any(-1))
    return np.stack(found, axis=-1)


def _primitives(part: str) -> list[str]:
    """Primitives of a part of `_PARTS`, on its side."""
    return _of_side(_PARTS[part.replace("right_", "left_", 1)], part)


def _of_side(names: tuple[str, ...], side: str) -> list[str]:
    if not side.startswith("right_"):
        return list(names)
    return [name.replace("left_", "right_", 1) for name in names]


def _report(path: Path) -> dict[str, Any]:
    try:
        report: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: can't be read ({error}); valid: the report of a result folder") from error
    if not isinstance(report, dict) or not isinstance(report.get("metrics"), dict):
        found = report.get("metrics") if isinstance(report, dict) else report
        raise InputError(f"{path}: metrics: found {found!r}; valid: the report of a result folder")
    return report
