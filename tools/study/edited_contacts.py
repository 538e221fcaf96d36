"""Six clips with edited contacts: in how many of the frames asked for a part is as asked for when simulated.

usage: python -m tools.study.edited_contacts --data DATA -o OUT [--plan NAME] [--seeds N ...] [--threads N]
                                             [--only CASE ...]

Results that are in OUT are kept. Prints a table: shares by part in the kinematic fit and in the simulation.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import simrecon
from simrecon import plan as plans
from simrecon.job import Job
from simrecon.job.options import Reading
from simrecon.types import ContactWish


@dataclass(frozen=True)
class Case:
    """A clip, and what is wished of it.

    Attributes:
        text: what is asked for.
        clip: name of the evidence.
        wishes: of each part.
        changes: of the job.
    """

    text: str
    clip: str
    wishes: tuple[ContactWish, ...]
    changes: dict[str, Any]


def _all(names: tuple[str, ...], **wish: Any) -> tuple[ContactWish, ...]:
    return tuple(ContactWish(name, **wish) for name in names)


FOOT, SEAT, KNEES = (
    ("left_heel", "left_toe"),
    ("left_buttock", "right_buttock"),
    ("left_knee", "right_knee"),
)
CASES = {
    "foot": Case("a foot kept still", "synth_walk", _all(FOOT, touch=((0.67, 1.1),)), {}),
    "hand": Case("a hand put down", "synth_getup_faceup", _all(("left_hand",), touch=((0.5, 1.2),)), {}),
    "knee": Case("knees lifted", "synth_roll", _all(KNEES, mode="never"), {}),
    "heel": Case("a heel raised", "synth_punch", _all(("right_heel",), free=((0.0, 1.0),)), {}),
    "seat": Case(
        "a seat, on the suggested bench",
        "opencap_STS_wham",
        _all(SEAT, touch=((0.0, 0.8),)),
        {"suggest": True, "reading": Reading(to_s=5.0)},
    ),
    "never": Case("never", "synth_getup_faceup", _all(("right_hand",), free=((0.0, 1.5),)), {}),
}


def main() -> None:
    """Run what is not there yet, print a line for each wish and seed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--plan", default="default")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    options = parser.parse_args()
    print("| case | clip | seed | part | frames | fit | simulation |\n|---|---|---|---|---|---|---|")
    for name in options.only:
        for seed in options.seeds:
            folder = options.output / f"{name}-{options.plan}-{seed}"
            if not (folder / "report.json").is_file():
                simrecon.run(
                    job(options.data, CASES[name], folder, options.plan, seed), threads=options.threads
                )
            for line in lines(CASES[name], folder, seed):
                print(line, flush=True)


def job(data: Path, case: Case, folder: Path, plan: str, seed: int) -> Job:
    """The run of a case."""
    evidence = data / "evidence" / f"{case.clip}.npz"
    return Job(
        str(evidence),
        str(folder),
        contacts=case.wishes,
        plan=plans.read(plan),
        seed=seed,
        no_report=True,
        **case.changes,
    )


def lines(case: Case, folder: Path, seed: int) -> list[str]:
    """A line of the table for each wish of a result."""
    wishes = json.loads((folder / "report.json").read_text())["contacts"]["wishes"]
    return [
        f"| {case.text} | `{case.clip}` | {seed} | {wish['part']} {wish['kind']} | {wish['frames']} "
        f"| {_percent(wish['fit_share'])} | {_percent(wish['simulated_share'])} |"
        for wish in wishes
    ]


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


if __name__ == "__main__":
    main()
