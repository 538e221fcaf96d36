"""The floor, and what stands on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from simrecon.types.frozen import frozen


@dataclass(frozen=True)
class Friction:
    """Of a surface; what is None has no effect.

    Attributes:
        sliding: Coulomb coefficient.
        torsional_m: moment about the normal over normal force.
        rolling_m: moment about an axis in the surface over normal force; needs `torsional_m` too.
    """

    sliding: float = 0.9
    torsional_m: float | None = None
    rolling_m: float | None = None


@dataclass(frozen=True)
class Ground:
    """The floor: a plane.

    Attributes:
        height_m: at the world's z axis.
        friction: of its surface.
        slope_rad: angle with the horizontal; slope_yaw_rad: direction in which it rises, from +x.
        stiffness_Npm, damping_Nspm: of a compliant floor, which sinks as a whole; None: hard.
        calibrate: stiffness and damping are to be found from the clip, see `simrecon.softfloor`.
    """

    height_m: float = 0.0
    friction: Friction = Friction()
    slope_rad: float = 0.0
    slope_yaw_rad: float = 0.0
    stiffness_Npm: float | None = None
    damping_Nspm: float | None = None
    calibrate: bool = False


Value = float | int | bool | str | tuple[float, float, float]
"""Of a parameter of a scene item."""


@dataclass(frozen=True)
class SceneItem:
    """What the person may touch; kinds and their parameters are in models/scene/kinds.toml.

    Attributes:
        name: unique.
        kind: such as `box`.
        position_m: centre of its footprint, at its lowest height.
        parameters: of its kind, all of them.
        yaw_rad: about z.
        friction: of its surface.
        mass_kg: of a movable item; None: fixed.
    """

    name: str
    kind: str
    position_m: tuple[float, float, float]
    parameters: Mapping[str, Value]
    yaw_rad: float = 0.0
    friction: Friction = Friction()
    mass_kg: float | None = None

    def __post_init__(self) -> None:
        """Keep a copy of the parameters that nobody changes."""
        object.__setattr__(self, "parameters", frozen(self.parameters))


@dataclass(frozen=True)
class Scene:
    """Floor and items of `scene.toml`; files that items name lie in `folder`."""

    ground: Ground = field(default_factory=Ground)
    items: tuple[SceneItem, ...] = ()
    folder: str = field(default=".", compare=False)
