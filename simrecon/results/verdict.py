"""Whether a result can be believed: `good`, `doubtful` or `bad`, for which reasons, and what to do.

Each threshold has its reason beside it; all of them are here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from simrecon.io.messages import counted
from simrecon.kinematics import bones
from simrecon.results import ending as endings
from simrecon.types import Report

GOOD, DOUBTFUL, BAD = "good", "doubtful", "bad"
LEVELS = (GOOD, DOUBTFUL, BAD)

IMAGE_HEIGHT_PCT = 5.0
"""Of the image's height, mean distance of body and landmarks: the wrong lens, person or file. Bad."""
PERSON_PCT = (3.0, 5.0)
"""Of the person's height in the image: clean clips come to 1 to 2, landmarks err by 1; 5 is a hand's breadth,
and the drawn body stands visibly beside the person."""
FIT_M = (0.05, 0.09)
"""Mean distance of the simulation from the kinematic fit: clean clips come to 0.01 to 0.04 m. At 0.1 m the
loss is thirty times that of a clean clip, and parts of the clip are far off."""
FIT_MAX_M = (0.2, 0.35)
"""The same in the worst frame: a backflip came to 0.16 m, and at 0.4 m a window counts as fallen."""
UPRIGHT_FOV_DEG = 50.0
"""Across an upright image: phones see 37 to 43° there, and 60 to 70° is what they see sideways."""
WRENCH_PCT = (3.0, 10.0)
"""Of body weight, or of body weight times stature, that a plan leaves unexplained, 95th percentile of frames:
seven clips came to 0.7 at most; a tenth is a push that nobody gave."""
DISTANT_PCT = 10.0
"""Of body weight, planned from a distance: poses may still be right, forces are not. Doubtful."""
FALLBACK_SHARE = 0.2
"""Of the frames that are not simulated: any is doubtful, more than this bad, for the end is missing."""
UNSEEN_SHARE = (0.2, 0.5)
"""Of the frames without the person, in which the motion is made up."""
POINTS = (6, 4)
"""Landmarks or joints in a frame: hips and legs alone have six; with three most of the pose is free."""
STATURE_M = (1.45, 1.95)
"""An estimated stature outside of it is 2.5 deviations from the mean of adults."""
PENETRATION_MM = (50.0, 150.0)
"""Deepest point under the floor: contacts give way by 10 to 20 mm in hard landings."""
INPUT_M = (0.03, 0.10)
"""Mean distance of the kinematic fit from the joints of motion capture: names may mean points 2 cm apart."""

BONE_PCT = (100 * bones.SAID, 100 * bones.MOST)
"""Of the length that motion capture measured: persons of one stature differ by less. What is beyond the
second is refused before, unless the motion was put on another body."""


@dataclass(frozen=True)
class Reason:
    """One of a verdict's: how bad it makes the result, why, and what to do about it."""

    verdict: str
    reason: str
    advice: str


def judge(report: Report) -> dict[str, Any]:
    """The section `verdict` of a report, from its other sections.

    Args:
        report: with `assumed`, `agreement`, `frames`, `gaps`, `person`, `metrics`.
    """
    found = [reason for rule in RULES for reason in rule(report)]
    found.sort(key=lambda reason: -LEVELS.index(reason.verdict))
    return {
        "verdict": found[0].verdict if found else GOOD,
        "reasons": [vars(reason) for reason in found],
    }


def graded(value: float | None, doubtful_bad: tuple[float, float]) -> str:
    """The level of a value that should be low."""
    doubtful, bad = doubtful_bad
    if value is None or value <= doubtful:
        return GOOD
    return BAD if value > bad else DOUBTFUL


def _image(report: Report) -> list[Reason]:
    agreement = report["agreement"]
    person, height = agreement["image_person_pct"], agreement["image_height_pct"]
    level = graded(person, PERSON_PCT)
    text = f"the body is {agreement['image_px'] or 0:.0f} px beside the landmarks"
    if height is not None and height > IMAGE_HEIGHT_PCT:
        level, text = BAD, f"{text}, {height:.1f} % of the image's height"
    elif person is not None:
        text = f"{text}, {person:.1f} % of the person's height"
    return [] if level == GOOD else [Reason(level, text, _image_advice(report))]


def _image_advice(report: Report) -> str:
    """Where the fit itself is beside the landmarks it is the camera or the person; else the simulation."""
    fit_px, person_px = report["kinematics"]["reprojection_median_px"], report["agreement"]["person_px"]
    if fit_px is not None and person_px and 100 * fit_px / person_px > PERSON_PCT[0]:
        return "look at the overlay, and check the lens (--camera, --fov) and who is followed (--person)"
    return f"{_stronger(report)}; {SCENE}"


SCENE = "give the scene what else the person touches (simrecon scene suggest)"


def is_plan(report: Report) -> bool:
    """Whether nothing was simulated: the result is a plan."""
    return bool(report["frames"].get("planned"))  # reports of earlier versions have none


def _stronger(report: Report) -> str:
    if is_plan(report):
        return "simulate it (--engine sampling)"
    plan = {"quick": "default", "default": "overnight", "flips": "overnight"}.get(report["plan_name"])
    return "try another plan" if plan is None else f"try --plan {plan}"


def _apart(report: Report) -> list[Reason]:
    agreement = report["agreement"]
    mean_m, most_m = agreement["fit_mean_m"], agreement["fit_max_m"]
    level = max(graded(mean_m, FIT_M), graded(most_m, FIT_MAX_M), key=LEVELS.index)
    if level == GOOD:
        return []
    motion = "plan" if is_plan(report) else "simulation"
    text = (
        f"the {motion} is {100 * mean_m:.0f} cm beside the kinematic fit on average, "
        f"{100 * most_m:.0f} cm at {agreement['fit_max_s']:.2f} s"
    )
    return [Reason(level, text, f"{_stronger(report)}; {SCENE}")]


def _unexplained(report: Report) -> list[Reason]:
    """What pushes a planned motion that is neither weight nor contact; a simulation has nothing of it."""
    if not is_plan(report) or (planned := report["planned"]) is None:
        return []
    force, moment = planned["wrench_force_pct"], planned["wrench_moment_pct"]
    distant = planned["distant_force_pct"] or 0.0
    from_afar = DOUBTFUL if distant > DISTANT_PCT else GOOD
    level = max(graded(max(force, moment), WRENCH_PCT), from_afar, key=LEVELS.index)
    if level == GOOD:
        return []
    text = (
        f"{force:.1f} % of body weight and {moment:.1f} % of body weight times stature are unexplained, "
        f"{distant:.1f} % of body weight acts from a distance"
    )
    return [Reason(level, text, "simulate it (--engine sampling), or give the scene what else is touched")]


def _lens(report: Report) -> list[Reason]:
    """A field of view that belongs to the other side of the image, which nothing in the image shows."""
    lens = report["assumed"]["lens"]
    if lens["by"] != "--fov" or lens["size_px"][0] >= lens["size_px"][1] or lens["fov_deg"] < UPRIGHT_FOV_DEG:
        return []
    text = f"{lens['fov_deg']:.0f}° across an upright image is more than phones see, which is 37 to 43°"
    return [Reason(DOUBTFUL, text, "give the --fov of the short side, or --camera FILE")]


def _gaps(report: Report) -> list[Reason]:
    frames, gaps = report["frames"], report["gaps"]
    if not gaps:
        return []
    level = BAD if frames["fallback"] > FALLBACK_SHARE * frames["count"] else DOUBTFUL
    verb = "is" if frames["fallback"] == 1 else "are"
    worst = max(gaps, key=lambda gap: gap["frames"])
    more = f"; and {counted(len(gaps) - 1, 'other gap')}" if len(gaps) > 1 else ""
    text = (
        f"{counted(frames['fallback'], 'frame')} of {frames['count']} {verb} not simulated, from "
        f"{worst['from_s']:.2f} to {worst['to_s']:.2f} s ({worst['reason']}: {worst['detail']}){more}"
    )
    return [Reason(level, text, _gap_advice(worst))]


def _gap_advice(gap: dict[str, Any]) -> str:
    plan = gap["plan"]
    return {
        endings.FELL: f"try --plan {plan}" if plan else "check scene and height, or cut the clip there",
        endings.LOST: "cut the clip where the person leaves the picture",
        endings.PENETRATION: "move the item, or give the scene what is there (simrecon scene check)",
        endings.IMPOSSIBLE: "look at the input there; check --height-m, the lens and the scene",
    }[gap["reason"]]


def _fell(report: Report) -> list[Reason]:
    if not report["agreement"]["fell"]:
        return []
    return [Reason(BAD, "the simulated person fell", _stronger(report))]


def _unseen(report: Report) -> list[Reason]:
    frames = report["frames"]
    share = frames["interpolated"] / frames["count"]
    level = graded(share, UNSEEN_SHARE)
    if level == GOOD:
        return []
    text = f"the person is out of view in {100 * share:.0f} % of the frames, where the motion is made up"
    return [Reason(level, text, "cut the clip to where the person is seen")]


def _few(report: Report) -> list[Reason]:
    seen = report["frames"].get("points_seen")  # reports of earlier versions have none
    if seen is None or seen >= POINTS[0]:
        return []
    text = f"only {counted(round(seen), 'point')} of the person can be seen: the pose is made up"
    return [Reason(BAD if seen < POINTS[1] else DOUBTFUL, text, "give landmarks of the whole body")]


def _stature(report: Report) -> list[Reason]:
    height = report["person"]["height_m"]
    if report["assumed"]["height"]["origin"] != "estimated" or STATURE_M[0] <= height <= STATURE_M[1]:
        return []
    text = f"a stature of {height:.2f} m was estimated, which few adults have"
    return [Reason(DOUBTFUL, text, "give --height-m; check the lens and the camera's place")]


def _deep(report: Report) -> list[Reason]:
    depth = report["metrics"]["penetration_max_mm"]
    level = graded(depth, PENETRATION_MM)
    if level == GOOD:
        return []
    return [Reason(level, f"the body is {depth:.0f} mm under the floor at worst", _stronger(report))]


def _input(report: Report) -> list[Reason]:
    off = report["agreement"]["input_mean_m"]
    level = graded(off, INPUT_M)
    if level == GOOD:
        return []
    text = f"the kinematic fit is {100 * off:.0f} cm beside the joints of the motion capture"
    return [Reason(level, text, "check the names of the joints, the unit and the axis that points up")]


def _bone(report: Report) -> list[Reason]:
    bone, longer = report["agreement"]["bone"], report["agreement"]["bone_pct"]
    level = graded(None if longer is None else abs(longer), BONE_PCT)
    if level == GOOD:
        return []
    text = (
        f"the body's {bone.replace('_', ' ')} is {abs(longer):.0f} % {'longer' if longer > 0 else 'shorter'} "
        "than the motion capture has it"
    )
    return [Reason(level, text, "check --unit, --joints, --height-m and --betas")]


RULES: tuple[Callable[[Report], list[Reason]], ...] = (
    _image, _gaps, _fell, _apart, _unexplained, _input, _bone, _lens, _unseen, _few, _stature, _deep,
)  # fmt: skip
"""In the order of what matters most within a level."""
