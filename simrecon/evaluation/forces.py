"""Scores of a simulation's contact forces, torques and power."""

from __future__ import annotations

import numpy as np

from simrecon.evaluation import pushes
from simrecon.evaluation.comparison import Comparison
from simrecon.evaluation.simulated import Simulated
from simrecon.metrics import dynamics
from simrecon.metrics.rates import PAPER_HZ, at, every
from simrecon.metrics.statistics import Scores, of_frames
from simrecon.sim.address import motor_dofs


def forces(result: Simulated, on: Comparison) -> Scores:
    """Contact forces, torques and power of the frames of simulation or plan; none where no forces are known.

    Of a plan, what is left unexplained is in its report, and not scored here.

    Args:
        result: of which.
        on: what the motions are compared on, for flight and contacts of the reference.
    """
    motion, mass, step_s = result.motion, result.mass_kg, result.model.opt.timestep
    kept = motion.kept
    if kept.sum() < 2 or not motion.knows_forces:
        return Scores()
    grf = motion.grf_N[kept]
    ends = np.maximum(motion.frame_step[kept], 0) * step_s  # (T,)
    if motion.is_planned:
        ends = motion.times_s - motion.times_s[0]
    slow = dynamics.grf_norm_pct(dynamics.interval_means(ends, grf, every(ends, PAPER_HZ)), mass)
    norm = dynamics.grf_norm_pct(grf, mass)  # (T,)
    flight = at(motion.times_s[kept], on.times_s, on.flight.astype(np.float64)) > 0.99
    torque, rate = motion.torque_Nm[kept], motion.qvel[kept][:, motor_dofs(result.model)]
    steps = np.diff(motion.frame_step[kept])
    residual = dynamics.residual_pct(
        result.body.com_velocity_mps[kept], grf, mass, np.maximum(steps, 1) * step_s
    )[(steps > 0) & ~motion.begins[kept][1:]]
    numbers = {
        "grf_mean_pct": float(slow.mean()),
        "grf_max_pct": float(slow.max()),
        "grf_peak_pct": float(norm[1:].max()),
        "grf_ballistic_pct": dynamics.ballistic_grf_pct(norm, flight),
        "peak_torque_Nmpkg": dynamics.peak_torque(torque, mass),
        "peak_power_Wpkg": dynamics.peak_power(torque, rate, mass),
        "residual_max_pct": float(residual.max()) if len(residual) else float("nan"),
    }
    series = {
        "grf_vertical_mean_pct": of_frames(dynamics.body_weight_pct(grf[:, 2], mass)),
        "residual_mean_pct": of_frames(residual),
    }
    return Scores(series, numbers | pushes.contact_f1(motion, on) | pushes.touch_f1(motion, on))
