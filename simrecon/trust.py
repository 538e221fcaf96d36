"""What a source of evidence is worth, and what follows from it for the fit (`models/evidence/trust.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from simrecon import resources
from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.io.messages import hint
from simrecon.io.tables import choice, number, text
from simrecon.plan import Kinematics
from simrecon.types import Evidence

FLOORS = ("scene", "level", "unknown")
ASSUMED = (
    "smooth_com", "smooth_position", "smooth_rotation", "travel_position", "travel_rotation",
    "contact", "still", "balance", "penetration", "prior",
)  # fmt: skip
"""Terms that fill in what the evidence does not show."""


@dataclass(frozen=True, kw_only=True)
class Trust:
    """Errors of a source by quantity (`models/evidence/trust.toml`); 0 m or px: the scale of the plan."""

    purpose: str = text()
    joints_m: float = number(0.0, 10.0)
    place_m: float = number(0.0, 100.0)
    landmarks_px: float = number(0.0, 1e4)
    size: float = number(1e-4, 10.0)
    lengths: float = number(1e-4, 10.0)
    lean_rad: float = number(1e-4, 10.0)
    metric: bool = False
    floor: str = choice(*FLOORS)
    assume: float = number(0.0, 1.0)
    source: str = tables.not_in_file("")


@cache
def _sources() -> Mapping[str, Trust]:
    content = resources.toml("models", "evidence", "trust.toml")
    return {
        name: replace(tables.build(Trust, table, f"models/evidence/trust.toml [{name}]"), source=name)
        for name, table in content.items()
    }


def names() -> tuple[str, ...]:
    """Names of the sources."""
    return tuple(_sources())


def parse(content: str, where: str) -> Trust:
    """Trust as a user or a file says it: a source, then values that differ from its own.

    Args:
        content: such as `mocap` or `world,place_m=0.05,floor=scene`.
        where: for messages.

    Raises:
        InputError: no such source or quantity, or an impossible value.
    """
    name, *changes = (part.strip() for part in content.split(","))
    if name not in _sources():
        sources = ", ".join(names())
        raise InputError(
            f"{where}: found {name!r}{hint(name, names())}; valid: {sources}, and KEY=VALUE after it"
        )
    table: dict[str, Any] = tables.to_table(_sources()[name])
    known = tables.keys(Trust)
    for change in changes:
        key, _, value = change.partition("=")
        if key not in known or key == "purpose":
            valid = ", ".join(key for key in known if key != "purpose")
            raise InputError(f"{where}: found {key!r}{hint(key, tuple(known))}; valid: {valid}")
        table[key] = tables.from_text(known[key], value, where)
    return replace(tables.build(Trust, table, where), source=name)


def of(evidence: Evidence) -> Trust:
    """That of evidence: as it says, or as what it holds usually deserves."""
    if evidence.trust:
        return parse(evidence.trust, "trust")
    if not evidence.joint_names:
        return _sources()["landmarks"]
    return _sources()["world" if evidence.joints_frame == "world" else "camera"]


def weighed(plan: Kinematics, trust: Trust) -> Kinematics:
    """A plan with the errors of a source as its scales, and with assumptions that weigh as they need to."""
    eased: dict[str, Any] = {name: trust.assume * getattr(plan, name) for name in ASSUMED}
    return replace(
        plan,
        keypoint_scale_px=trust.landmarks_px or plan.keypoint_scale_px,
        joint_scale_m=trust.joints_m or plan.joint_scale_m,
        place_scale_m=trust.place_m or plan.place_scale_m,
        **eased,
    )
