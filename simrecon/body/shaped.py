"""A person of some shape: kinematic tree, primitives, stature and volume by shape parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simrecon.body import fitting, mass, shape, sizes, targets
from simrecon.body.shape import ShapeSpace
from simrecon.body.skeleton import rescaled
from simrecon.types import Array, Skeleton


@dataclass(frozen=True, eq=False)
class Shape:
    """A body shape, ready to be built. E primitives of the left side and the centre.

    Attributes:
        shapes: the space of its parameters; betas: (B,).
        skeleton: lengths in m.
        values: (E, 9) of the primitives, see `sizes.VALUES`.
        height_m: stature.
        volume_m3: of the body.
    """

    shapes: ShapeSpace
    betas: Array
    skeleton: Skeleton
    values: Array
    height_m: float
    volume_m3: float

    @property
    def mass_kg(self) -> float:
        """Volume times the density of `models/body/mass.toml`."""
        return self.volume_m3 * mass.density_kgpm3()


@dataclass(frozen=True, eq=False)
class ShapeRequest:
    """What a run is told of the body's shape.

    Attributes:
        betas: shape parameters, or None: those that lengths, height and mass make most probable
            (`shape_fit.fit`).
        shapes: their space; that of simrecon if None.
        distribution: of mass, by name (`mass.distribution`).
    """

    betas: Array | None = None
    shapes: ShapeSpace | None = None
    distribution: str = "standard"


def make(betas: Array, *, height_m: float | None = None, shapes: ShapeSpace | None = None) -> Shape:
    """The shape of some shape parameters, ready to be built.

    Primitives come from the regressor where it knows the shape space, and from a fit to the skin (some
    seconds) where the user brought a body model.

    Args:
        betas: up to B numbers, the rest are zero.
        height_m: stature to which the whole is scaled; that of the shape if None.
        shapes: the shape space; that of simrecon if None.

    Raises:
        InputError: see `shape.check`.
    """
    shapes = shapes or shape.space()
    betas = shape.check(betas, shapes)
    own = shapes is shape.space()
    psi = sizes.regress(betas) if own else _fitted(shapes, tuple(betas.tolist()))
    own_m = shape.stature_m(betas, shapes)
    scale = 1.0 if height_m is None else height_m / own_m
    return Shape(
        shapes,
        betas,
        rescaled(shape.skeleton(betas, shapes), scale),
        sizes.values(psi) * scale,
        own_m * scale,
        shapes.volume_m3(betas) * scale**3,
    )


@lru_cache(maxsize=16)
def _fitted(shapes: ShapeSpace, betas: tuple[float, ...]) -> Array:
    """Sizes ψ (S,) of a shape by direct fit, kept because a run needs the same one more than once."""
    values = np.array(betas)
    goals = targets.of_shape(shapes, values)
    return fitting.fit(goals, fitting.start(shape.stature_m(values, shapes)))
