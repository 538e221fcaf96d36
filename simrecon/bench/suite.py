"""Suites as data: which clips, with what settings, and what is made of the scores; one TOML each."""

from __future__ import annotations

import dataclasses
import inspect
import tomllib
import types
import typing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from simrecon import plan as plans
from simrecon import resources
from simrecon.bench.statics import CHECKS
from simrecon.errors import InputError
from simrecon.metrics.definitions import DEFINITIONS
from simrecon.plan import Plan

T = TypeVar("T")
DROPS = ("keypoints", "joints", "camera")
HALVES = ("both", "kinematics")
PLACES = ("seat", "platform", "support")
ROWS = ("clip", "variant", "method", "change")
MEASURES = ("mean", "ratio", "worst", "worst_ratio", "least")
RUN_SCORES = (
    "seconds_per_second",
    "cpu_per_second",
    "stepping_share",
    "fallback",
    "replay_exact",
    "check_qpos_error",
    "fit_cpu_per_second",
)
"""What a run, and the independent script, say of it, as scores of the motion `run`."""


@dataclass(frozen=True)
class Trial:
    """`[clip.trial]`: markers and force plates, from which evidence and reference are made."""

    markers: str
    static: str
    forces: str
    mass_kg: float
    cutoff_hz: float
    below_m: float | None = None
    feet_on_plates: bool = False
    span_s: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Place:
    """`[clip.place]`: what stands in the scene, by the clip's evidence or another file of the same scene.

    `seat` under the hips, `platform` under the first feet, `support`: all that `scene suggest` finds.
    """

    kind: str
    height_m: float | None = None
    evidence: str | None = None


@dataclass(frozen=True)
class Clip:
    """`[[clip]]`: files in the data folder; scenes beside the suite, or `example/…` of the package.

    `plan` instead of the suite's; `height_m` of the person, where the evidence doesn't say.
    """

    name: str
    evidence: str | None = None
    truth: str | None = None
    scene: str | None = None
    place: Place | None = None
    trial: Trial | None = None
    plan: str | None = None
    height_m: float | None = None


@dataclass(frozen=True)
class Check:
    """`[[check]]`: a formula of `statics.CHECKS` at some settings, and how far off the simulator may be."""

    name: str
    formula: str
    within_pct: float
    settings: dict[str, float]


@dataclass(frozen=True)
class Picture:
    """`[[picture]]`: frames of a clip's result (`picture.frame`), drawn with forces beside the tables."""

    clip: str
    at: tuple[str, ...]


@dataclass(frozen=True)
class Variant:
    """`[[variant]]`: parts of the evidence left out, keys of the plan replaced (`section.key = value`)."""

    name: str
    drop: tuple[str, ...] = ()
    plan: dict[str, Any] = field(default_factory=dict)
    paper: str = ""


@dataclass(frozen=True)
class Column:
    """A column of a table: a score of some motions, joined by arrows."""

    title: str
    score: str
    of: tuple[str, ...] = ("result",)
    digits: int = 0
    interval: bool = False


@dataclass(frozen=True)
class Table:
    """`[[table]]`: one row a clip (means over seeds), a variant (means over clips) or a method on a clip.

    Rows of `change` are variants but the first, with what each changes against it; scores must be errors.
    """

    title: str
    rows: str
    columns: tuple[Column, ...]
    text: str = ""
    clips: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bound:
    """What a target asks for: a measure over clips within limits."""

    measure: str
    at_most: float | None = None
    at_least: float | None = None


@dataclass(frozen=True)
class Target:
    """`[[target]]`: met if any of its bounds is; ratios are to the motion `against` (of `against_clip`)."""

    text: str
    score: str
    must: tuple[Bound, ...]
    reach: tuple[Bound, ...] = ()
    of: str = "result"
    against: str = "kinematic"
    against_clip: str | None = None
    clips: tuple[str, ...] = ()


@dataclass(frozen=True)
class Suite:
    """All of a suite; `half` = `kinematics` runs no simulation."""

    purpose: str
    plan: str
    seeds: tuple[int, ...]
    clip: tuple[Clip, ...]
    table: tuple[Table, ...]
    variant: tuple[Variant, ...] = (Variant("full"),)
    target: tuple[Target, ...] = ()
    half: str = "both"
    check: tuple[Check, ...] = ()
    picture: tuple[Picture, ...] = ()
    name: str = ""
    folder: Path = Path()


def names() -> tuple[str, ...]:
    """Names of the suites that ship with simrecon, sorted."""
    return tuple(sorted(path.stem for path in _shipped().glob("*.toml")))


def read(name_or_path: str | Path) -> Suite:
    """Read a suite that ships, by name, or the user's own, by path.

    Raises:
        InputError: there is no such suite, or it has an unknown, missing or impossible value.
    """
    shipped = names()
    path = _shipped() / f"{name_or_path}.toml" if str(name_or_path) in shipped else Path(name_or_path)
    if not path.is_file():
        valid = ", ".join(shipped)
        raise InputError(f"there is no suite {str(name_or_path)!r}; valid: {valid}, or a path of a TOML file")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: can't read the suite: {error}") from error
    for key in ("name", "folder"):
        if key in content:
            raise InputError(f"{path}: unknown key {key!r}; valid: {', '.join(_keys(Suite))}")
    made: Suite = _value(Suite, content, f"{path}:")
    suite = dataclasses.replace(made, name=path.stem, folder=path.parent)
    _check(suite, path)
    return suite


def with_plan(suite: Suite, name: str) -> Suite:
    """A suite with another plan, also where a clip has its own.

    Raises:
        InputError: there is no such plan, or a variant replaces what it has not.
    """
    clips = tuple(dataclasses.replace(clip, plan=None) for clip in suite.clip)
    changed = dataclasses.replace(suite, plan=name, clip=clips)
    base = plans.read(name)
    for variant in suite.variant:
        overridden(base, variant.plan, f"{suite.name}: variant {variant.name}")
    return changed


def overridden(plan: Plan, changes: dict[str, Any], where: str) -> Plan:
    """A plan with some of its values replaced and checked.

    Args:
        plan: to begin with.
        changes: by `section.key`.
        where: for messages.

    Raises:
        InputError: an unknown key, or an impossible value.
    """
    if not changes:
        return plan
    tables = plans.to_dict(plan)
    for path, value in changes.items():
        section, _, key = path.rpartition(".")
        table = tables.get(section) if section else tables
        if not isinstance(table, dict) or key not in table:
            valid = [f"{s}.{k}" for s, inner in tables.items() if isinstance(inner, dict) for k in inner]
            raise InputError(f"{where}: plan: found the key {path!r}; valid: {', '.join(valid)}")
        table[key] = value
    return plans.parse(_toml(tables), where)


def _toml(tables: dict[str, Any], section: str = "") -> str:
    """Nested tables of text, numbers and lists as TOML; tables that are None are left out."""
    lines, inner = [], []
    for key, value in tables.items():
        if isinstance(value, dict):
            name = f"{section}.{key}" if section else key
            inner.append(f"[{name}]\n{_toml(value, name)}")
        elif value is not None:
            lines.append(f"{key} = {_literal(value)}\n")
    return "".join(lines + inner)


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        return f'"{escaped}"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_literal(item) for item in value) + "]"
    return repr(value)


def _shipped() -> Path:
    return resources.folder("bench/suites")


def _keys(kind: type) -> list[str]:
    return [item.name for item in dataclasses.fields(kind) if item.name != "folder"]


def _value(kind: Any, given: Any, where: str) -> Any:
    """A value of a type out of TOML: dataclasses from tables, tuples from lists."""
    if isinstance(kind, types.UnionType):
        return _value(next(k for k in typing.get_args(kind) if k is not types.NoneType), given, where)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _table(kind, given, where)
    if typing.get_origin(kind) is tuple:
        if not isinstance(given, list):
            raise InputError(f"{where} must be a list, found {given!r}")
        return tuple(_value(typing.get_args(kind)[0], item, f"{where}[{i}]") for i, item in enumerate(given))
    if typing.get_origin(kind) is dict:
        if not isinstance(given, dict):
            raise InputError(f"{where} must be a table, found {given!r}")
        inner = typing.get_args(kind)[1]
        return (
            given if inner is Any else {key: _value(inner, v, f"{where} {key}") for key, v in given.items()}
        )
    accepted: Any = int | float if kind is float else kind
    if not isinstance(given, accepted) or (isinstance(given, bool) and kind is not bool):
        noun = {str: "text in quotes", float: "a number", int: "a whole number", bool: "true or false"}[kind]
        raise InputError(f"{where} must be {noun}, found {given!r}")
    return kind(given)


def _table(kind: type[T], given: Any, where: str) -> T:
    if not isinstance(given, dict):
        raise InputError(f"{where} must be a table, found {given!r}")
    hints, valid = typing.get_type_hints(kind), _keys(kind)
    if unknown := [key for key in given if key not in valid]:
        raise InputError(f"{where} unknown key {unknown[0]!r}; valid: {', '.join(valid)}")
    for item in dataclasses.fields(kind):  # type: ignore[arg-type]
        if (
            item.name not in given
            and item.default is dataclasses.MISSING
            and item.default_factory is dataclasses.MISSING
        ):
            raise InputError(f"{where} lacks the key {item.name!r}; valid: {', '.join(valid)}")
    return kind(**{key: _value(hints[key], value, f"{where} {key}") for key, value in given.items()})


def _check(suite: Suite, path: Path) -> None:
    """What no type says."""
    _check_runs(suite, path)
    _check_output(suite, path)


def _choice(where: str, found: str, valid: tuple[str, ...]) -> None:
    if found not in valid:
        raise InputError(f"{where}: found {found!r}; valid: {', '.join(valid)}")


def _check_runs(suite: Suite, path: Path) -> None:
    """Clips and variants."""
    for kind, entries in (("clip", suite.clip), ("variant", suite.variant)):
        known = [entry.name for entry in entries]
        if not known or len(set(known)) < len(known):
            raise InputError(f"{path}: {kind}: found names {', '.join(known) or 'none'}; valid: each once")
        if bad := [name for name in known if not name or "/" in name or name.startswith(".")]:
            raise InputError(f"{path}: {kind}: found the name {bad[0]!r}; valid: one that a folder can have")
    if not suite.seeds or min(suite.seeds) < 0:
        raise InputError(f"{path}: seeds: found {list(suite.seeds)}; valid: whole numbers from 0 on")
    for clip in suite.clip:
        where = f"clip {clip.name}"
        if (clip.trial is None) == (clip.evidence is None or clip.truth is None):
            raise InputError(f"{path}: {where}: found neither or both; valid: evidence and truth, or trial")
        if clip.trial is not None and clip.trial.span_s is not None and len(clip.trial.span_s) != 2:
            raise InputError(f"{path}: {where}: span_s: found {clip.trial.span_s}; valid: start and end")
        if clip.place is not None:
            _choice(f"{path}: {where}: place: kind", clip.place.kind, PLACES)
            if (clip.place.kind == "platform") == (clip.place.height_m is None):
                raise InputError(f"{path}: {where}: place: height_m; valid: with a platform, and there only")
    _choice(f"{path}: half", suite.half, HALVES)
    bases = [plans.read(name) for name in {suite.plan, *(clip.plan or suite.plan for clip in suite.clip)}]
    for variant in suite.variant:
        for part in variant.drop:
            _choice(f"{path}: variant {variant.name}: drop", part, DROPS)
        for base in bases:
            overridden(base, variant.plan, f"{path}: variant {variant.name}")


def _check_output(suite: Suite, path: Path) -> None:
    """Tables, targets, checks and pictures."""
    clips = tuple(clip.name for clip in suite.clip)
    for table in suite.table:
        _choice(f"{path}: table {table.title}: rows", table.rows, ROWS)
        for column in table.columns:
            _choice(f"{path}: table {table.title}: score", column.score, (*DEFINITIONS, *RUN_SCORES))
        for name in table.clips:
            _choice(f"{path}: table {table.title}: clips", name, clips)
    for target in suite.target:
        _choice(f"{path}: target {target.text}: score", target.score, (*DEFINITIONS, *RUN_SCORES))
        if target.against_clip is not None:
            _choice(f"{path}: target {target.text}: against_clip", target.against_clip, clips)
        for bound in (*target.must, *target.reach):
            _choice(f"{path}: target {target.text}: measure", bound.measure, MEASURES)
        for name in target.clips:
            _choice(f"{path}: target {target.text}: clips", name, clips)
    for check in suite.check:
        _choice(f"{path}: check {check.name}: formula", check.formula, tuple(CHECKS))
        valid = tuple(inspect.signature(CHECKS[check.formula]).parameters)
        if set(check.settings) != set(valid):
            found = f"settings: found {', '.join(check.settings) or 'none'}"
            raise InputError(f"{path}: check {check.name}: {found}; valid: {', '.join(valid)}")
    if suite.picture and suite.half != "both":
        raise InputError(f"{path}: picture: found with half = {suite.half!r}; valid: with both halves")
    for picture in suite.picture:
        _choice(f"{path}: picture: clip", picture.clip, clips)
