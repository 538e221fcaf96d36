"""Settings of the planner (`models/planner/centroidal.toml`, where each has its source)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

from simrecon import resources
from simrecon.io import tables
from simrecon.io.tables import number, option


@dataclass(frozen=True)
class Polynomials:
    """`[polynomials]`: how many cubics stand for a curve."""

    com_s: float = number(0.01, 1.0)
    per_phase: int = number(1, 100)
    piece_s: float = number(0.01, 60.0)


@dataclass(frozen=True)
class Checks:
    """`[checks]`: where constraints are taken."""

    dynamics_s: float = number(0.01, 1.0)
    integral_points: int = number(0, 100)
    lengths_s: float = number(0.01, 1.0)
    heights_s: float = number(0.01, 1.0)
    velocity_frames: int = number(2, 100)


@dataclass(frozen=True)
class Forces:
    """`[forces]`: what a point in contact can exert."""

    friction: float = number(0.0, 10.0)
    most_N: float = number(1.0, 1e6)
    reference_kg: float = number(1.0, 1000.0)


@dataclass(frozen=True, kw_only=True)
class Weights:
    """`[weights]` and `[paper]`: of the terms of the objective."""

    com: float = number(0.0)
    turn: float = number(0.0)
    point: float = number(0.0)
    unit_s: float = number(1e-3, 10.0)
    com_velocity: float = number(0.0)
    turn_velocity: float = number(0.0)
    point_velocity: float = number(0.0)
    com_acceleration: float = number(0.0)
    turn_acceleration: float = number(0.0)
    point_acceleration: float = number(0.0)
    duration: float = number(0.0)
    force: float = number(0.0)
    force_bend: float = number(0.0)
    ridge: float = number(0.0)


@dataclass(frozen=True)
class Relaxed:
    """`[relaxed]`: prices at which constraints give way, where they cannot all hold."""

    velocity: float = number(0.0)
    wrench: float = number(0.0)


@dataclass(frozen=True)
class PhaseRules:
    """`[phases]`: how labels become phases."""

    contact: float = number(0.01, 0.99)
    spread_m: float = number(1e-3, 1.0)
    cut: float = number(0.0, 100.0)
    shortest_s: float = number(0.0, 10.0)
    contradiction_m: float = number(0.0, 10.0)
    carried: float = number(0.0, 10.0)
    borne: float = number(0.0, 10.0)
    near_m: float = number(0.0, 1.0)
    level_m: float = number(0.0, 1.0)


@dataclass(frozen=True)
class Legs:
    """`[legs]`: how far points may be from the body."""

    slack_m: float = number(0.0, 1.0)
    trunk_m: float = number(0.0, 1.0)


@dataclass(frozen=True)
class Durations:
    """`[durations]`: how the ends of phases move."""

    rounds: int = number(0, 100)
    iterations: int = number(1, 100_000)
    step_s: float = number(1e-3, 1.0)
    shortest_s: float = number(1e-3, 1.0)


@dataclass(frozen=True)
class Solver:
    """`[solver]`: when IPOPT ends."""

    iterations: int = number(1, 100_000)
    tolerance: float = number(1e-12, 1.0)


@dataclass(frozen=True)
class FullBody:
    """`[body]`: what the full body is held to."""

    point_m: float = number(1e-4, 1.0)
    com_m: float = number(1e-4, 1.0)
    joint_m: float = number(1e-4, 1.0)
    turn_rad: float = number(1e-3, 10.0)
    evaluations: int = number(0, 10_000)


@dataclass(frozen=True)
class Initial:
    """`[initial]`: the kinematic optimisation of appendix B."""

    projection: float = number(0.0)
    velocity: float = number(0.0)
    angle: float = number(0.0)
    acceleration: float = number(0.0)
    data: float = number(0.0)
    contact_velocity: float = number(0.0)
    floor: float = number(0.0)
    unit_m: float = number(1e-4, 10.0)
    focal_px: float = number(1.0, 1e5)
    contact: float = number(0.0, 1.0)
    huber: float = number(0.1, 10.0)
    outlier_m: float = number(1e-3, 1.0)
    evaluations: int = number(1, 10_000)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All of them."""

    polynomials: Polynomials = option()
    checks: Checks = option()
    forces: Forces = option()
    weights: Weights = option()
    paper: Weights = option()
    relaxed: Relaxed = option()
    phases: PhaseRules = option()
    legs: Legs = option()
    durations: Durations = option()
    solver: Solver = option()
    body: FullBody = option()
    initial: Initial = option()


@cache
def settings() -> Settings:
    """Those that ship with simrecon."""
    return tables.build(Settings, resources.toml("models", "planner", "centroidal.toml"), "centroidal.toml")


def chosen(weights: str) -> Settings:
    """Those with the weights of a plan: `measured` or `paper`."""
    return settings() if weights == "measured" else replace(settings(), weights=settings().paper)
