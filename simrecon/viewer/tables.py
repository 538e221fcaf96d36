"""The tables of the page: settings, cost, plausibility and windows, as words and numbers from the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from simrecon.results.verdict import is_plan
from simrecon.system.progress import duration
from simrecon.types import Report

Row = tuple[str, str]
PLAUSIBILITY = (
    ("footskate_pct", "Foot skate", "%", 1),
    ("float_pct", "Floating feet", "%", 1),
    ("penetration_mean_mm", "Under the floor, mean", "mm", 1),
    ("penetration_max_mm", "Under the floor, at most", "mm", 1),
    ("mean_grf_pct_bw", "Mean vertical force, of body weight", "%", 1),
    ("mpjpe_2d_px", "Points from landmarks in the image", "px", 1),
)
AGREEMENT = (
    ("fit_mean_m", "From the kinematic fit, mean", "mm", 1e3),
    ("fit_max_m", "From the kinematic fit, at most", "mm", 1e3),
    ("input_mean_m", "Fit from the input", "mm", 1e3),
    ("image_person_pct", "From the landmarks, of the person's height in the image", "%", 1.0),
)
UNEXPLAINED = (
    ("wrench_force_pct", "Force that the plan leaves unexplained, of body weight"),
    ("wrench_moment_pct", "Moment that the plan leaves unexplained, of body weight times stature"),
    ("distant_force_pct", "Planned force that acts from a distance, of body weight"),
)
HIGHLIGHTS = (
    ("agreement", "fit_mean_m", "From the kinematic fit", "mm", 1e3),
    ("agreement", "image_px", "From the landmarks", "px", 1.0),
    ("metrics", "footskate_pct", "Foot skate", "%", 1.0),
    ("metrics", "float_pct", "Floating feet", "%", 1.0),
    ("metrics", "penetration_max_mm", "Under the floor", "mm", 1.0),
)
STAGES = {
    "landmarks": "Landmarks of the video",
    "kinematics": "Kinematic fit",
    "planning": "Planner",
    "simulation": "Simulation",
    "record": "Replay and record",
    "overlay": "Overlay",
}


def make(report: Report) -> list[dict[str, Any]]:
    """All tables with rows, each `title`, `head` (column titles, or none) and `rows` of words.

    What an earlier version did not write down is left out.
    """
    makers: dict[str, Callable[[Report], Iterator[Row]]] = {
        "Person and floor": _person,
        "Plausibility": _plausibility,
        "Settings": _settings,
        "Cost": _cost,
        "Exactness": _audit,
    }
    found = [{"title": title, "head": [], "rows": list(rows(report))} for title, rows in makers.items()]
    found.append(_windows(report))
    return [table for table in found if table["rows"]]


def highlights(report: Report) -> list[Row]:
    """The figures that tell most, a few words each."""
    found = [
        (words, unit, factor, report.get(part, {}).get(key)) for part, key, words, unit, factor in HIGHLIGHTS
    ]
    return [
        (words, f"{factor * value:.1f} {unit}") for words, unit, factor, value in found if value is not None
    ]


def _person(report: Report) -> Iterator[Row]:
    person, assumed = report["person"], report.get("assumed", {})
    yield "Height", f"{person['height_m']:.2f} m{_origin(assumed, 'height')}"
    yield "Mass", f"{person['mass_kg']:.1f} kg{_origin(assumed, 'mass')}"
    lens, camera, floor = (assumed.get(key, {}) for key in ("lens", "camera", "floor"))
    if lens.get("fov_deg") is not None:
        yield "Lens", f"{lens['fov_deg']:.1f}° across the image{_origin(assumed, 'lens')}"
    if camera.get("height_m") is not None:
        tilt = f"{'down' if camera['down_deg'] >= 0 else 'up'} by {abs(camera['down_deg']):.0f}°"
        place = f"{camera['height_m']:.2f} m over the floor, looking {tilt}"
        yield "Camera", place + _origin(assumed, "camera")
    if floor.get("height_m") is not None:
        yield "Floor", f"at {floor['height_m']:.2f} m{_origin(assumed, 'floor')}"
    if (soft := report.get("soft_floor")) is not None:
        yield "Floor's stiffness", f"{soft['stiffness_Npm']:.3g} N/m, {soft['damping_Nspm']:.3g} N s/m"


def _origin(assumed: dict[str, Any], key: str) -> str:
    origin = assumed.get(key, {}).get("origin")
    return "" if origin in (None, "none") else f", {origin}"


def _plausibility(report: Report) -> Iterator[Row]:
    frames, agreement = report["frames"], report.get("agreement", {})
    if is_plan(report):
        yield "Frames planned", f"{frames['planned']} of {frames['count']}, nothing was simulated"
    else:
        yield "Frames simulated", f"{frames['simulated']} of {frames['count']}"
    if frames.get("interpolated"):
        yield "Frames out of view", str(frames["interpolated"])
    for key, words, unit, factor in AGREEMENT:
        if (value := agreement.get(key)) is not None:
            yield words, f"{factor * value:.1f} {unit}"
    for key, words in UNEXPLAINED:
        if (value := (report.get("planned") or {}).get(key)) is not None:
            yield words, f"{value:.1f} %"
    for key, words, unit, digits in PLAUSIBILITY:
        if (value := report["metrics"].get(key)) is not None:
            yield words, f"{value:.{digits}f} {unit}"


def _settings(report: Report) -> Iterator[Row]:
    read = report["input"]
    yield "Input", Path(read["name"]).name
    if read.get("reading"):
        yield "Read as", read["reading"]
    for key, words in (("plan_name", "Plan"), ("planner", "Planner"), ("engine", "Engine"), ("seed", "Seed")):
        if report.get(key) is not None:
            yield words, str(report[key])
    if trusted := read.get("trust", {}).get("source"):
        yield "Trusted as", trusted
    for library, version in report.get("versions", {}).items():
        if version:
            yield library, str(version)


def _cost(report: Report) -> Iterator[Row]:
    totals = report["totals"]
    yield "In all", duration(totals["wall_s"])
    yield "Per second of video", duration(totals["seconds_per_second"])
    yield "Processor time", duration(totals["cpu_s"])
    for stage, spent in totals["seconds"].items():
        yield STAGES.get(stage, stage), f"{spent:.1f} s"
    yield "Windows", str(totals["windows"])
    yield "Rollouts", f"{totals['rollouts']:,}"
    yield "Steps", f"{totals['steps']:,}"


def _audit(report: Report) -> Iterator[Row]:
    audit = report["audit"]
    if is_plan(report):
        yield "Replay", "none: nothing was simulated"
    else:
        yield "Replay", "the same bits" if audit.get("replay_exact") else "differs"
    for key, words, unit in (
        ("max_root_actuator_force_N", "Motor force on the root, at most", "N"),
        ("max_applied_force_N", "Other force from outside, at most", "N"),
        ("self_penetration_max_mm", "Parts of the body in each other, at most", "mm"),
    ):
        if audit.get(key) is not None:
            yield words, f"{audit[key]:.1f} {unit}"


def _windows(report: Report) -> dict[str, Any]:
    head = ["Window", "From, s", "To, s", "Loss", "Generations", "Rollouts", "Time, s", "Ended because"]
    rows = [
        (
            str(row + 1),
            f"{window['start_s']:.2f}",
            f"{window['end_s']:.2f}",
            "–" if window["loss"] is None else f"{window['loss']:.1f}",
            str(window["generations"]),
            f"{window['evaluations']:,}",
            f"{window['seconds']:.1f}",
            str(window["status"]),
        )
        for row, window in enumerate(report["windows"])
    ]
    return {"title": "Windows", "head": head, "rows": rows}
