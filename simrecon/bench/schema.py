"""A suite as data: which clips, with what settings, and what is made of the scores; one TOML each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrecon import engines, planners
from simrecon.bench.statics import CHECKS
from simrecon.evidence.keys import HEIGHT_RANGE_M, MASS_RANGE_KG
from simrecon.io.tables import choice, not_in_file, number, option, text
from simrecon.metrics.definitions import DEFINITIONS

DROPS = ("keypoints", "joints", "camera")
HALVES = ("both", "kinematics")
PLACES = ("seat", "platform", "support")
ROWS = ("clip", "variant", "method", "change")
MEASURES = ("mean", "ratio", "worst", "worst_ratio", "least", "gain")
RUN_SCORES = (
    "seconds_per_second",
    "cpu_per_second",
    "stepping_share",
    "fallback",
    "replay_exact",
    "check_qpos_error",
    "fit_cpu_per_second",
    "from_reference_mm",
    "from_reference_worst_mm",
    "wrench_force_pct",
    "wrench_moment_pct",
    "distant_force_pct",
)
"""What a run, and the independent script, say of it, as scores of the motion `run`."""


def _scores() -> tuple[str, ...]:
    return (*DEFINITIONS, *RUN_SCORES)


@dataclass(frozen=True)
class Trial:
    """`[clip.trial]`: markers and force plates, from which evidence and reference are made."""

    markers: str
    static: str
    forces: str
    mass_kg: float = number(*MASS_RANGE_KG)
    cutoff_hz: float = option(above=0.0, high=1000.0)
    below_m: float | None = None
    feet_on_plates: bool = False
    span_s: tuple[float, float] | None = None


@dataclass(frozen=True)
class Place:
    """`[clip.place]`: what stands in the scene, by the clip's evidence or another file of the same scene.

    `seat` under the hips, `platform` under the first feet, `support`: all that `scene suggest` finds.
    """

    kind: str = choice(*PLACES)
    height_m: float | None = None
    evidence: str | None = None


@dataclass(frozen=True)
class BenchmarkClip:
    """`[[clip]]`: files in the data folder; scenes beside the suite, or `example/…` of the package.

    `plan` instead of the suite's; `height_m` of the person, where the evidence doesn't say.
    """

    name: str = text()
    evidence: str | None = None
    truth: str | None = None
    scene: str | None = None
    place: Place | None = None
    trial: Trial | None = None
    plan: str | None = None
    height_m: float | None = number(*HEIGHT_RANGE_M, default=None)


@dataclass(frozen=True)
class Check:
    """`[[check]]`: a formula of `statics.CHECKS` at some settings, and how far off the simulator may be."""

    name: str = text()
    formula: str = choice(*CHECKS)
    within_pct: float = number(0.0)
    settings: dict[str, float] = option()


@dataclass(frozen=True)
class Picture:
    """`[[picture]]`: frames of a clip's result (`picture.frame`), drawn with forces beside the tables."""

    clip: str
    at: tuple[str, ...]


@dataclass(frozen=True)
class Variant:
    """`[[variant]]`: parts of the evidence left out, planner and engine, keys of the plan replaced."""

    name: str = text()
    drop: tuple[str, ...] = choice(*DROPS, default=())
    planner: str | None = option(None, choices=planners.names)
    engine: str = choice(*engines.names(), default="sampling")
    plan: dict[str, Any] = option({})
    paper: str = ""


@dataclass(frozen=True)
class Column:
    """A column of a table: a score of some motions, joined by arrows."""

    title: str = text()
    score: str = option(choices=_scores)
    of: tuple[str, ...] = ("result",)
    digits: int = number(0, 12, default=0)
    interval: bool = False


@dataclass(frozen=True)
class Table:
    """`[[table]]`: one row a clip (means over seeds), a variant (means over clips) or a method on a clip.

    Rows of `change` are variants but the first, with what each changes against it; scores must be errors.
    """

    title: str = text()
    rows: str = choice(*ROWS)
    columns: tuple[Column, ...] = option()
    text: str = ""
    clips: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bound:
    """What a target asks for: a measure over clips within limits."""

    measure: str = choice(*MEASURES)
    at_most: float | None = None
    at_least: float | None = None


@dataclass(frozen=True)
class Target:
    """`[[target]]`: met if any bound is; ratios and gains are to the motion `against` (of `against_clip`)."""

    text: str = text()
    score: str = option(choices=_scores)
    must: tuple[Bound, ...] = option()
    reach: tuple[Bound, ...] = ()
    of: str = "result"
    against: str = "kinematic"
    against_clip: str | None = None
    clips: tuple[str, ...] = ()


@dataclass(frozen=True)
class Suite:
    """All of a suite; `half` = `kinematics` runs no simulation; `curves`: forces over time are drawn."""

    purpose: str = text()
    plan: str = text()
    seeds: tuple[int, ...] = number(0, 2**63 - 1)
    clip: tuple[BenchmarkClip, ...] = option()
    table: tuple[Table, ...] = option()
    variant: tuple[Variant, ...] = (Variant("full"),)
    target: tuple[Target, ...] = ()
    half: str = choice(*HALVES, default="both")
    check: tuple[Check, ...] = ()
    picture: tuple[Picture, ...] = ()
    curves: bool = False
    name: str = not_in_file("")
    folder: Path = not_in_file(Path())
