"""The most probable shape of a person of whom some lengths, height or mass are known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy

from simrecon.body import mass
from simrecon.body.lengths import measure_template
from simrecon.body.shape import BETA_MAX, ShapeSpace, skeleton, space, stature_m
from simrecon.body.skeleton import template
from simrecon.types import Array

SIGMA_LENGTH, SIGMA_HEIGHT, SIGMA_MASS = 0.03, 0.005, 0.05
"""Relative standard deviations of estimated lengths, and of a height and a mass that the user states."""


def fit(
    lengths_m: Mapping[str, float],
    *,
    height_m: float | None = None,
    mass_kg: float | None = None,
    shapes: ShapeSpace | None = None,
) -> Array:
    """The most probable shape for what is known of a person.

    Minimises Σ_l (log l(β) - log l)² / σ_l² + ‖β‖² over the known lengths, stature and mass (volume
    times density).

    Args:
        lengths_m: by name of `models/body/skeleton.toml`, as `body.measure` returns them; may be empty.
        height_m: stature, or None.
        mass_kg: of the whole body, or None.
        shapes: the shape space; that of simrecon if None.

    Returns:
        (B,) betas; zeros where nothing is known.
    """
    shapes = shapes or space()
    names = [name for name in measure_template(template()) if name in lengths_m]
    measured = np.log([lengths_m[name] for name in names])

    def residuals(betas: Array) -> Array:
        tree = skeleton(betas, shapes)
        ours = measure_template(tree)
        terms = [(np.log([ours[name] for name in names]) - measured) / SIGMA_LENGTH, betas]
        if height_m is not None:
            terms.append(np.array([np.log(stature_m(betas, shapes, tree) / height_m) / SIGMA_HEIGHT]))
        if mass_kg is not None:
            volume = max(shapes.volume_m3(betas), 1e-3)
            terms.append(np.array([np.log(volume * mass.density_kgpm3() / mass_kg) / SIGMA_MASS]))
        return np.concatenate(terms)

    limit = 0.999 * BETA_MAX
    start = np.zeros(shapes.size)
    solved = scipy.optimize.least_squares(residuals, start, bounds=(-limit, limit), max_nfev=30)
    betas: Array = solved.x
    return betas
