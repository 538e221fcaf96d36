"""Contact forces of a simulation against those that force plates measured, at the reference's times."""

from __future__ import annotations

import numpy as np

from simrecon.body.primitives import FEET
from simrecon.contact import rules
from simrecon.evaluation.comparison import Comparison
from simrecon.metrics import dynamics
from simrecon.metrics.filters import low_pass, possible_hz
from simrecon.metrics.rates import at
from simrecon.metrics.statistics import Scores, of_frames
from simrecon.metrics.truth import CUTOFF_HZ, Plates, Pushes
from simrecon.types import Array, Flags, Motion


def against_plates(
    motion: Motion, plates: Plates, truth_times_s: Array, on: Comparison, mass_kg: float
) -> Scores:
    """Contact forces against those that plates measured, at the reference's times.

    The first scores take all frames, the whole force of the scene, and no filter. The others take the force
    on the feet, which is the mean since the frame before, at the middle of that interval, low-passed on both
    sides at the reference's cut-off, in frames in which no foot stood beside its plate.

    Args:
        motion: what was simulated.
        plates: measured.
        truth_times_s: (S,) of the plates.
        on: what the motions are compared on.
        mass_kg: of the person who was measured.
    """
    times = on.times_s
    measured = at(times, truth_times_s, plates.force_N)  # (T, 2, 3)
    known = at(times, truth_times_s, plates.known.astype(np.float64)) > 0.99  # (T,)
    feet = at(times, _middles(motion), _on_feet(motion))  # (T, 2, 3)
    scores = _whole(at(times, motion.times_s, motion.grf_N), measured.sum(1), mass_kg)
    cutoff_hz = possible_hz(plates.cutoff_hz, _slowest_s(motion, truth_times_s))
    scores |= filtered(feet, measured, known, on.interval_s, cutoff_hz, mass_kg)
    if plates.centre_m is None:
        return scores
    centre = at(times, truth_times_s, np.nan_to_num(plates.centre_m))
    return scores | _centre_of_pressure(motion, times, feet, measured, known, centre)


def against_pushes(
    motion: Motion, pushes: Pushes, truth_times_s: Array, on: Comparison, mass_kg: float
) -> Scores:
    """Contact forces against those of a reference that was simulated: both are means since the frame before.

    The scores are those of `against_plates`, without centres of pressure. The first frame, which ends no
    interval, counts in none.

    Args:
        motion: what was simulated.
        pushes: forces on the reference's primitives.
        truth_times_s: (S,) of the reference.
        on: what the motions are compared on.
        mass_kg: of the reference.
    """
    times = on.times_s[1:]
    whole = at(times, truth_times_s, pushes.force_N.sum(axis=1))  # (T-1, 3)
    feet = at(times, truth_times_s, pushes.on(FEET))  # (T-1, 2, 3)
    own = at(times, motion.times_s, motion.contact_force_N[:, _columns(motion)])
    known = np.ones(len(times), dtype=bool)
    scores = _whole(at(times, motion.times_s, motion.grf_N), whole, mass_kg)
    cutoff_hz = possible_hz(CUTOFF_HZ, _slowest_s(motion, truth_times_s))
    return scores | filtered(own, feet, known, on.interval_s, cutoff_hz, mass_kg)


def _slowest_s(motion: Motion, truth_times_s: Array) -> float:
    """The longer of the intervals between frames of a motion and of its reference."""
    return max(float(np.median(np.diff(times_s))) for times_s in (motion.times_s, truth_times_s))


def _whole(total: Array, measured: Array, mass_kg: float) -> Scores:
    """The whole force of the scene against both plates together, (T, 3) N each."""
    error = dynamics.body_weight_pct(total - measured, mass_kg)[:, 2]
    return Scores(
        {
            "grf_vertical_mae_pct_bw": of_frames(np.abs(error)),
            "grf_vertical_rmse_pct_bw": of_frames(np.square(error), root=True),
            "grf_mean_pct_bw": of_frames(dynamics.body_weight_pct(total[:, 2], mass_kg)),
        },
        {"grf_corr": dynamics.correlation(total[:, 2], measured[:, 2])},
    )


def filtered(
    feet: Array, measured: Array, known: Flags, interval_s: float, cutoff_hz: float, mass_kg: float
) -> Scores:
    """Force on the feet against the plates, both low-passed, percent of body weight.

    Args:
        feet: (T, 2, 3) N.
        measured: (T, 2, 3) N.
        known: (T,) frames that count.
        interval_s: between frames.
        cutoff_hz: of the filter, less where the frame rate does not allow it (`filters.possible_hz`).
        mass_kg: of the person.
    """
    cutoff_hz = possible_hz(cutoff_hz, interval_s)
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
        {
            "plate_vertical_corr": correlation,
            "plate_peak_error_pct": peak,
            "plate_cutoff_hz": cutoff_hz,
        },
    )


def _centre_of_pressure(
    motion: Motion, times_s: Array, feet: Array, measured: Array, known: Flags, truth_m: Array
) -> Scores:
    """Distance of the feet's centres of pressure from the plates', (T, 2, 3), where both are loaded."""
    moment = _on_feet(motion)[..., 2:] * np.nan_to_num(motion.contact_point_m[1:, _columns(motion)])
    centre = np.full_like(feet, np.nan)  # the moment over the force, so that no unloaded foot enters
    np.divide(at(times_s, _middles(motion), moment), feet[..., 2:], out=centre, where=feet[..., 2:] > 0)
    seen = known[:, None] & rules.loaded(measured[..., 2])
    distance = dynamics.centre_of_pressure_error(
        centre, np.where(seen[..., None], truth_m, np.nan), feet[..., 2], measured[..., 2]
    )
    return Scores({}, {"plate_cop_mm": 1e3 * distance})


def _columns(motion: Motion) -> list[int]:
    return [motion.contact_body.index(foot) for foot in FEET]


def _middles(motion: Motion) -> Array:
    """Middle of the interval that ends at each frame but the first, which ends none, (T - 1,) s.

    A plan has its forces at the frames themselves.
    """
    if motion.is_planned:
        return motion.times_s[1:]
    return np.asarray(0.5 * (motion.times_s[1:] + motion.times_s[:-1]))


def _on_feet(motion: Motion) -> Array:
    """Force on each foot, mean since the frame before, (T - 1, 2, 3) N."""
    return motion.contact_force_N[1:, _columns(motion)]
