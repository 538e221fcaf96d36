"""Plans: how a clip is cut into windows and how each is optimised. One TOML of `windows/` is one `Plan`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Any

from simrecon import resources
from simrecon.errors import InputError
from simrecon.io import tables, toml
from simrecon.io.messages import hint
from simrecon.io.tables import choice, number, option, text
from simrecon.optim.covariance import Covariance

PRIORS = ("gaussian", "flow")
CONTACTS = ("rules", "network")
"""Names of the pose priors in `simrecon.prior`."""
STRENGTHS = ("usual", "trained")
"""Names of the torque limits in models/body/strength.toml."""


@dataclass(frozen=True)
class Simulation:
    """`[simulation]`: the time step is the largest integer fraction of the frame interval up to this."""

    timestep_max_s: float = number(1e-4, 0.05)
    strength: str = choice(*STRENGTHS)


@dataclass(frozen=True)
class WindowPlan:
    """`[window]`: length, what it shares with the next one, and the distance of the spline's knots."""

    length_s: float = number(0.02, 60.0)
    overlap_s: float = number(0.0, 60.0)
    knot_spacing_s: float = number(0.005, 10.0)

    @property
    def commit_s(self) -> float:
        """The part that is kept."""
        return self.length_s - self.overlap_s


@dataclass(frozen=True, kw_only=True)
class Optimiser:
    """`[optimiser]`: descents, CMA-ES and when they stop; a `tol_*` of 0 switches it off."""

    covariance: Covariance
    population: int = number(4, 100_000)
    generations: int = number(0, 1_000_000)
    draft_steps: int = number(0, 1000)
    starts: int = number(1, 64, default=1)
    descent_steps: int = number(0, 1000)
    spread: float = number(1e-6, 1e6)
    sigma_rad: float = number(1e-6, math.pi)
    bound_rad: float = number(1e-6, 2 * math.pi)
    start_pose: float = number(0.0, 1.0)
    start_velocity: float = number(0.0, 10.0)
    tol_loss: float = number(0.0)
    tol_loss_absolute: float = number(0.0, default=0.0)
    tol_sigma: float = number(0.0)


@dataclass(frozen=True)
class Recovery:
    """`[recovery]`: how far from the kinematic fit is a fall, 0 = anything goes; how often to try again."""

    corridor_m: float = number(0.0, 100.0)
    retries: int = number(0, 10)


@dataclass(frozen=True, kw_only=True)
class LossWeights:
    """`[loss]`: weights of the loss of a rollout; 0 switches a term off, as those are that may be left out.

    Each has the name of its term in `simrecon.engines.sampling.terms`; what the papers lack is optional.
    """

    com_position: float = number(0.0)
    com_velocity: float = number(0.0)
    pose: float = number(0.0)
    reprojection: float = number(0.0)
    prior: float = number(0.0)
    total_variation: float = number(0.0)
    joint_limit: float = number(0.0)
    landmark: float = number(0.0, default=0.0)
    landmark_velocity: float = number(0.0, default=0.0)
    planted: float = number(0.0, default=0.0)
    prior_model: str = choice(*PRIORS)
    prior_rate_hz: float = number(0.1, 1000.0)
    rate_hz: float = number(1.0, 1000.0)


@dataclass(frozen=True)
class Kinematics:
    """`[kinematics]`: what the kinematic fit does, weights and scales of its loss, most evaluations of it.

    The first four are the letters S, O, G and T of Gärtner 2022, table 2.
    """

    shape: bool
    poses: bool
    ground: bool
    temporal: bool
    seed_frames: int = number(0, 1_000_000)
    keypoint: float = number(0.0)
    keypoint_scale_px: float = number(1e-3, 1e4)
    joint: float = number(0.0)
    joint_scale_m: float = number(1e-4, 10.0)
    place: float = number(0.0)
    place_scale_m: float = number(1e-4, 100.0)
    smooth_com: float = number(0.0)
    smooth_position: float = number(0.0)
    smooth_rotation: float = number(0.0)
    travel_position: float = number(0.0)
    travel_rotation: float = number(0.0)
    prior: float = number(0.0)
    prior_model: str = choice(*PRIORS)
    limit: float = number(0.0)
    penetration: float = number(0.0)
    contact: float = number(0.0)
    still: float = number(0.0)
    balance: float = number(0.0)
    evaluations: int = number(1, 1_000_000)
    contact_model: str = choice(*CONTACTS, default="rules")


@dataclass(frozen=True, kw_only=True)
class SoftContact:
    """`[soft_contact]`: the planner of that name, `planners.soft_contact`; the section may be left out.

    `units` are those of force and moment, as shares of body weight and of that times stature, a round each.
    `distance_m`, `slip_mps` and `rest` are what makes a force dear: σ_d, σ_v and ε of its loss.
    """

    weight: float = number(0.0, 1e6, default=1.0)
    units: tuple[float, ...] = number(1e-4, 10.0, default=(0.1, 0.03, 0.01))
    evaluations: int = number(1, 1_000_000, default=50)
    distance_m: float = number(1e-4, 1.0, default=0.01)
    slip_mps: float = number(1e-3, 10.0, default=0.1)
    rest: float = number(1e-9, 1.0, default=1e-3)


@dataclass(frozen=True)
class Centroidal:
    """`[centroidal]`: what that planner begins with, and its weights; `paper` is Rempe 2020 (B.3, 3.1)."""

    start: str = choice("fit", "paper", default="fit")
    weights: str = choice("measured", "paper", default="measured")


@dataclass(frozen=True)
class Plan:
    """All settings of a run; `name` is the one by which it was read."""

    purpose: str = text()
    simulation: Simulation = option()
    window: WindowPlan = option()
    optimiser: Optimiser = option()
    recovery: Recovery = option()
    loss: LossWeights = option()
    kinematics: Kinematics = option()
    soft_contact: SoftContact = option(SoftContact())
    centroidal: Centroidal = option(Centroidal())
    name: str = tables.not_in_file("", compare=False)


def names() -> tuple[str, ...]:
    """Names of the plans that ship with simrecon, sorted."""
    return tuple(sorted(path.stem for path in resources.folder("windows").glob("*.toml")))


def read(name_or_path: str | Path) -> Plan:
    """Read a plan that ships, by name, or the user's own, by path.

    Raises:
        InputError: there is no such plan, or it has an unknown, missing or impossible value.
    """
    name, shipped = str(name_or_path), names()
    path = resources.folder("windows") / f"{name}.toml" if name in shipped else Path(name)
    if not path.is_file():
        valid = ", ".join(shipped)
        raise InputError(
            f"there is no plan {name!r}{hint(name, shipped)}; valid: {valid}, or a path of a TOML file"
        )
    return dataclasses.replace(build(toml.load(path, "plan"), str(path)), name=name)


def parse(content: str, path: str | Path = "plan.toml") -> Plan:
    """Read the text of a plan; `path` is named in errors.

    Raises:
        InputError: as `read`.
    """
    return build(toml.loads(content, str(path)), str(path))


def build(table: Mapping[str, Any], where: str) -> Plan:
    """A plan from the tables of its file; `where` is named in errors.

    Raises:
        InputError: as `read`.
    """
    plan = tables.build(Plan, table, where)
    if not plan.soft_contact.units:
        raise InputError(
            f"{where}: [soft_contact] units: found none; valid: one number a round, 0.01 the last"
        )
    length_s, overlap_s, spacing_s = plan.window.length_s, plan.window.overlap_s, plan.window.knot_spacing_s
    if overlap_s >= length_s:
        rule = f"overlap_s must be below length_s ({length_s:g}), found {overlap_s:g}"
        raise InputError(f"{where}: [window] {rule}")
    if spacing_s > length_s:
        rule = f"knot_spacing_s must be at most length_s ({length_s:g}), found {spacing_s:g}"
        raise InputError(f"{where}: [window] {rule}")
    return plan


def to_dict(plan: Plan) -> dict[str, Any]:
    """The plan as nested dictionaries, in the order of the TOML."""
    return tables.to_table(plan)


def overridden(plan: Plan, changes: Mapping[str, Any], where: str) -> Plan:
    """A plan with some of its values replaced and checked.

    Args:
        plan: to begin with.
        changes: by `section.key`.
        where: for messages.

    Raises:
        InputError: an unknown key, or an impossible value.
    """
    table = to_dict(plan)
    sections: dict[str, Any] = {
        name: key.type for name, key in tables.keys(Plan).items() if is_dataclass(key.type)
    }
    valid = [f"{section}.{key}" for section, kind in sections.items() for key in tables.keys(kind)]
    for path, value in changes.items():
        if path not in valid:
            near, names = hint(path, valid), ", ".join(valid)
            raise InputError(f"{where}: plan: unknown key {path!r}{near}; valid: {names}")
        section, key = path.split(".")
        table[section][key] = value
    return dataclasses.replace(build(table, where), name=plan.name)
