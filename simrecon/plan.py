"""Plans: how a clip is cut into windows and how each is optimised. One TOML of `windows/` is one `Plan`."""

from __future__ import annotations

import dataclasses
import difflib
import math
import tomllib
import typing
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from simrecon import resources
from simrecon.errors import InputError
from simrecon.optim.covariance import Covariance

T = TypeVar("T")

_LARGEST = 1e12  # a number without an upper limit of its own is finite at least

PRIORS = ("gaussian", "flow")
"""Names of the pose priors in `simrecon.prior`."""
STRENGTHS = ("usual", "trained")
"""Names of the torque limits in models/body/strength.toml."""


def _range(low: float, high: float = _LARGEST, default: Any = dataclasses.MISSING) -> Any:
    """A number from `low` to `high`, both valid; with a default, a plan may leave it out."""
    return field(default=default, metadata={"low": low, "high": high})


def _choice(*values: str) -> Any:
    """One of some words."""
    return field(metadata={"choices": values})


@dataclass(frozen=True)
class Simulation:
    """`[simulation]`: the time step is the largest integer fraction of the frame interval up to this."""

    timestep_max_s: float = _range(1e-4, 0.05)
    strength: str = _choice(*STRENGTHS)


@dataclass(frozen=True)
class WindowPlan:
    """`[window]`: length, what it shares with the next one, and the distance of the spline's knots."""

    length_s: float = _range(0.02, 60.0)
    overlap_s: float = _range(0.0, 60.0)
    knot_spacing_s: float = _range(0.005, 10.0)

    @property
    def commit_s(self) -> float:
        """The part that is kept."""
        return self.length_s - self.overlap_s


@dataclass(frozen=True)
class Optimiser:
    """`[optimiser]`: CMA-ES and when it stops; `tol_*` are relative, 0 switches them off."""

    covariance: Covariance
    population: int = _range(4, 100_000)
    generations: int = _range(0, 1_000_000)
    draft_steps: int = _range(0, 1000)
    descent_steps: int = _range(0, 1000)
    spread: float = _range(1e-6, 1e6)
    sigma_rad: float = _range(1e-6, math.pi)
    bound_rad: float = _range(1e-6, 2 * math.pi)
    start_pose: float = _range(0.0, 1.0)
    start_velocity: float = _range(0.0, 10.0)
    tol_loss: float = _range(0.0)
    tol_sigma: float = _range(0.0)


@dataclass(frozen=True)
class Recovery:
    """`[recovery]`: how far from the kinematic fit is a fall, 0 = anything goes; how often to try again."""

    corridor_m: float = _range(0.0, 100.0)
    retries: int = _range(0, 10)


@dataclass(frozen=True, kw_only=True)
class LossWeights:
    """`[loss]`: weights of the loss of a rollout; 0 switches a term off, as those are that may be left out.

    Each has the name of its term in `simrecon.engines.sampling.terms`; what the papers lack is optional.
    """

    com_position: float = _range(0.0)
    com_velocity: float = _range(0.0)
    pose: float = _range(0.0)
    reprojection: float = _range(0.0)
    prior: float = _range(0.0)
    total_variation: float = _range(0.0)
    joint_limit: float = _range(0.0)
    landmark: float = _range(0.0, default=0.0)
    landmark_velocity: float = _range(0.0, default=0.0)
    prior_model: str = _choice(*PRIORS)
    prior_rate_hz: float = _range(0.1, 1000.0)
    rate_hz: float = _range(1.0, 1000.0)


@dataclass(frozen=True)
class Kinematics:
    """`[kinematics]`: what the kinematic fit does, weights and scales of its loss, most evaluations of it.

    The first four are the letters S, O, G and T of Gärtner 2022, table 2.
    """

    shape: bool
    poses: bool
    ground: bool
    temporal: bool
    seed_frames: int = _range(0, 1_000_000)
    keypoint: float = _range(0.0)
    keypoint_scale_px: float = _range(1e-3, 1e4)
    joint: float = _range(0.0)
    joint_scale_m: float = _range(1e-4, 10.0)
    place: float = _range(0.0)
    place_scale_m: float = _range(1e-4, 100.0)
    smooth_com: float = _range(0.0)
    smooth_position: float = _range(0.0)
    smooth_rotation: float = _range(0.0)
    travel_position: float = _range(0.0)
    travel_rotation: float = _range(0.0)
    prior: float = _range(0.0)
    prior_model: str = _choice(*PRIORS)
    limit: float = _range(0.0)
    penetration: float = _range(0.0)
    contact: float = _range(0.0)
    still: float = _range(0.0)
    balance: float = _range(0.0)
    evaluations: int = _range(1, 1_000_000)


@dataclass(frozen=True)
class Plan:
    """All settings of a run."""

    purpose: str
    simulation: Simulation
    window: WindowPlan
    optimiser: Optimiser
    recovery: Recovery
    loss: LossWeights
    kinematics: Kinematics


def names() -> tuple[str, ...]:
    """Names of the plans that ship with simrecon, sorted."""
    return tuple(sorted(path.stem for path in resources.folder("windows").glob("*.toml")))


def read(name_or_path: str | Path) -> Plan:
    """Read a plan that ships, by name, or the user's own, by path.

    Raises:
        InputError: there is no such plan, or it has an unknown, missing or impossible value.
    """
    shipped = names()
    if str(name_or_path) in shipped:
        path = resources.folder("windows") / f"{name_or_path}.toml"
    else:
        path = Path(name_or_path)
    if not path.is_file():
        found = str(name_or_path)
        valid = ", ".join(shipped)
        raise InputError(
            f"there is no plan {found!r}{_hint(found, shipped)}; valid: {valid}, or a path of a TOML file"
        )
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: can't read the plan: {error}") from error
    return parse(text, path)


def parse(text: str, path: str | Path = "plan.toml") -> Plan:
    """Read the text of a plan; `path` is named in errors.

    Raises:
        InputError: as `read`.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    plan = _dataclass(Plan, table, str(path), "")
    where, length_s = f"{path}: [window]", plan.window.length_s
    overlap_s, spacing_s = plan.window.overlap_s, plan.window.knot_spacing_s
    if overlap_s >= length_s:
        raise InputError(f"{where} overlap_s must be below length_s ({length_s:g}), found {overlap_s:g}")
    if spacing_s > length_s:
        raise InputError(
            f"{where} knot_spacing_s must be at most length_s ({length_s:g}), found {spacing_s:g}"
        )
    return plan


def to_dict(plan: Plan) -> dict[str, Any]:
    """The plan as nested dictionaries, in the order of the TOML."""
    return dataclasses.asdict(plan)


def _dataclass(kind: type[T], table: Any, path: str, section: str) -> T:
    """Fill a dataclass from a TOML table: every field without a default needed, no other key, all checked."""
    where = f"{path}: [{section}]" if section else f"{path}:"
    if not isinstance(table, dict):
        raise InputError(f"{where} must be a table, found {table!r}")
    fields = {item.name: item for item in dataclasses.fields(kind)}  # type: ignore[arg-type]
    needed = [name for name, item in fields.items() if item.default is dataclasses.MISSING]
    _check_keys(where, table, fields, needed)
    types = typing.get_type_hints(kind)
    values = {}
    for key in (key for key in fields if key in table):
        if dataclasses.is_dataclass(types[key]):
            inner = f"{section}.{key}" if section else key
            values[key] = _dataclass(types[key], table[key], path, inner)
        else:
            values[key] = _value(f"{where} {key}", table[key], types[key], fields[key].metadata)
    return kind(**values)


def _check_keys(
    where: str, table: Mapping[str, Any], valid: Collection[str], needed: Collection[str]
) -> None:
    for key in table:
        if key not in valid:
            raise InputError(f"{where} unknown key {key!r}{_hint(key, valid)}; valid: {', '.join(valid)}")
    for key in needed:
        if key not in table:
            raise InputError(f"{where} lacks the key {key!r}; needed: {', '.join(needed)}")


def _value(where: str, value: Any, kind: Any, rules: Mapping[str, Any]) -> Any:
    if kind is bool:
        if not isinstance(value, bool):
            raise InputError(f"{where} must be true or false, found {value!r}")
        return value
    literal = typing.get_origin(kind) is typing.Literal
    if kind is str or literal:
        if not isinstance(value, str) or not value.strip():
            raise InputError(f"{where} must be text in quotes, found {value!r}")
        choices = typing.get_args(kind) if literal else rules.get("choices")
        if choices and value not in choices:
            raise InputError(f"{where} must be one of {', '.join(choices)}, found {value!r}")
        return value
    accepted: Any = int if kind is int else int | float
    low, high = rules.get("low", -_LARGEST), rules.get("high", _LARGEST)
    is_number = isinstance(value, accepted) and not isinstance(value, bool)
    if not is_number or not low <= value <= high:
        noun = "a whole number" if kind is int else "a number"
        rule = f"at least {low:g}" if high == _LARGEST else f"from {low:g} to {high:g}"
        raise InputError(f"{where} must be {noun} {rule}, found {value!r}")
    return kind(value)


def _hint(word: str, valid: Collection[str]) -> str:
    close = difflib.get_close_matches(word, valid, n=1)
    return f", did you mean {close[0]!r}?" if close else ""
