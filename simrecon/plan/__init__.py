"""Plans: how a clip is cut into windows and how each is optimised. One TOML of `windows/` is one `Plan`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Any

from simrecon import resources
from simrecon.errors import InputError
from simrecon.io import tables, toml
from simrecon.io.messages import hint
from simrecon.io.tables import choice, option, text
from simrecon.plan.sections import (
    CONTACTS,
    PLANNERS,
    PRIORS,
    STRENGTHS,
    Centroidal,
    Kinematics,
    LossWeights,
    Optimiser,
    Recovery,
    Simulation,
    SoftContact,
    WindowPlan,
)

__all__ = [
    "CONTACTS",
    "PLANNERS",
    "PRIORS",
    "STRENGTHS",
    "Centroidal",
    "Kinematics",
    "LossWeights",
    "Optimiser",
    "Plan",
    "Recovery",
    "Simulation",
    "SoftContact",
    "WindowPlan",
    "build",
    "names",
    "overridden",
    "parse",
    "read",
    "to_dict",
]

ROUNDS_MAX = 20
"""Of a planner; each takes as long as the first."""


@dataclass(frozen=True)
class Plan:
    """All settings of a run; `name` is the one by which it was read, `planner` that of jobs without one."""

    purpose: str = text()
    simulation: Simulation = option()
    window: WindowPlan = option()
    optimiser: Optimiser = option()
    recovery: Recovery = option()
    loss: LossWeights = option()
    kinematics: Kinematics = option()
    soft_contact: SoftContact = option(SoftContact())
    centroidal: Centroidal = option(Centroidal())
    planner: str = choice(*PLANNERS, default="none")
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
    if not 1 <= len(plan.soft_contact.units) <= ROUNDS_MAX:
        raise InputError(
            f"{where}: [soft_contact] units: found {len(plan.soft_contact.units) or 'none'}; "
            f"valid: one number a round, 0.01 the last, at most {ROUNDS_MAX}"
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
