"""What a run says at its end: who and what was assumed, how near the motion comes, and the verdict."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from simrecon.errors import printable
from simrecon.io.messages import spans
from simrecon.kinematics import stature_prior
from simrecon.results import Result, by_second
from simrecon.results.verdict import is_plan
from simrecon.system.progress import duration
from simrecon.types import Report

_WIDTH = 9


def of(result: Result) -> str:
    """What a run came to, one line a fact."""
    report = result.report
    rows = [*_assumed(report), *_reached(report), *_verdict(report), *_files(result)]
    return "\n".join(f"{name:<{_WIDTH}}{printable(words)}" for name, words in rows)


def _assumed(report: Report) -> Iterator[tuple[str, str]]:
    assumed, person = report["assumed"], report["person"]
    mass = f"{person['mass_kg']:.0f} kg, {_mass_origin(assumed['mass']['origin'])}"
    yield "person", f"{person['height_m']:.2f} m, {_height_origin(report)}; {mass}"
    if assumed["lens"]["origin"] != "none":
        lens = f"{assumed['lens']['fov_deg']:.0f}° across the image, {_lens_origin(report)}"
        yield "lens", f"{lens}; {_camera(report)}"
    yield "floor", _floor(report)


def _height_origin(report: Report) -> str:
    origin, shown = report["assumed"]["height"]["origin"], report["assumed"]["height"]["shown_m"]
    if origin == "given":
        return "as given"
    if origin == "measured":
        return "as measured in the motion capture"
    mean, spread = stature_prior.adults()
    adults = f"adults are {mean:.2f} ± {mean * spread:.2f} m"
    return f"estimated ({adults if shown is None else f'the input shows {shown:.2f} m, {adults}'})"


def _mass_origin(origin: str) -> str:
    return "as given" if origin == "given" else "estimated from the height"


def _lens_origin(report: Report) -> str:
    lens = report["assumed"]["lens"]
    if lens["origin"] == "estimated":
        return f"estimated to ±{lens['focal_error_pct']:.0f} % (--fov or --camera says it)"
    return "as is usual, for nobody knows it" if lens["origin"] == "usual" else f"as given by {lens['by']}"


def _camera(report: Report) -> str:
    camera = report["assumed"]["camera"]
    how = "as given" if camera["origin"] == "given" else "estimated"
    tilt = f"{'down' if camera['down_deg'] >= 0 else 'up'} by {abs(camera['down_deg']):.0f}°"
    return f"camera {camera['height_m']:.2f} m over the floor, looking {tilt}, {how}"


def _floor(report: Report) -> str:
    floor, soft = report["assumed"]["floor"], report.get("soft_floor")
    how = "as given" if floor["origin"] == "given" else "found by what touches it"
    words = f"at {floor['height_m']:.2f} m, {how}"
    if soft is None:
        return words
    bound = ", an end of the search's range" if soft["at_bound"] else ""
    return f"{words}; {soft['stiffness_Npm']:.3g} N/m{bound}, {soft['damping_Nspm']:.3g} N s/m"


def _reached(report: Report) -> Iterator[tuple[str, str]]:
    frames, totals, windows = report["frames"], report["totals"], report["windows"]
    agreement = report["agreement"]
    simulated = f"{frames['simulated']} of {frames['count']} simulated"
    if is_plan(report):
        simulated = f"{frames['planned']} of {frames['count']} planned, nothing was simulated"
    if frames["fallback"]:
        simulated += f", {frames['fallback']} on kinematic fallback"
    if frames["interpolated"]:
        simulated += f"; {frames['interpolated']} interpolated, the person was out of view"
    yield "frames", simulated
    if (part := report["input"].get("part")) is not None:
        yield "part", _part(part, frames["count"])
    for i, gap in enumerate(report["gaps"]):
        yield "" if i else "gaps", f"{gap['from_s']:.2f} to {gap['to_s']:.2f} s: {gap['reason']}"
    if (off := agreement["image_px"]) is not None:
        share = agreement["image_person_pct"]
        relative = "" if share is None else f", {share:.1f} % of the person's height there"
        yield "image", f"body and landmarks are {off:.0f} px apart on average{relative}"
    motion = "plan" if is_plan(report) else "simulation"
    beside = f"the {motion} is {1e3 * agreement['fit_mean_m']:.0f} mm from the kinematic fit on average"
    if (off := agreement["input_mean_m"]) is not None:
        beside += f", that {1e3 * off:.0f} mm from the input"
    yield "motion", beside
    if is_plan(report):
        yield "physics", _unexplained(report)
    yield from (("plan", note) for note in report.get("planner_notes", []))
    yield from _wishes(report)
    loss = f"{sum(w['loss'] for w in windows) / len(windows):.1f}, mean of the windows" if windows else "-"
    if windows or not is_plan(report):
        yield "loss", loss
    spent = f"{duration(totals['wall_s'])}, {duration(totals['seconds_per_second'])} per second of video"
    yield "time", spent
    if exchanged := report["input"]["exchanged"]:
        mixed = (f"{limbs} in {spans(rows)}" for limbs, rows in exchanged.items())
        yield "sides", f"left and right were mixed up, and exchanged: {', '.join(mixed)}"


def _unexplained(report: Report) -> str:
    """What of a plan no force of the scene explains."""
    planned = report["planned"]
    if planned is None:
        return "none: this planner knows no forces"
    force, moment = planned["wrench_force_pct"], planned["wrench_moment_pct"]
    words = f"{force:.1f} % of body weight and {moment:.1f} % of body weight times stature are unexplained"
    if planned["distant_force_pct"] is not None:
        words += f", {planned['distant_force_pct']:.1f} % of body weight acts from a distance"
    return f"{words} (95 % of frames have less)"


def _wishes(report: Report) -> Iterator[tuple[str, str]]:
    """Of each contact that the user asked for: how often it is so, and why not always."""
    words = {"touch": "touches", "stay": "touches and stays", "free": "touches nothing"}
    name = "contacts"
    for wish in report.get("contacts", {}).get("wishes", []):
        done = wish["simulated_share"]
        share = "in no simulated frame" if done is None else f"in {100 * done:.0f} %"
        yield name, f"{wish['part']} {words[wish['kind']]} {share} of {wish['frames']} frames, as asked for"
        name = ""
        if wish["cannot_s"]:
            when = ", ".join(f"{low:.2f} to {high:.2f} s" for low, high in wish["cannot_s"])
            yield "", f"it cannot touch from {when}: the input has it {wish['apart_m']:.2f} m from everything"


def _part(part: Report, count: int) -> str:
    """Which part of its source the result shows."""
    last = part["first_frame"] + part["every"] * (count - 1)
    of = f" of {part['source_frames']}" if part["source_frames"] else ""
    every = f", one of {part['every']}" if part["every"] > 1 else ""
    return f"{part['from_s']:.2f} to {part['to_s']:.2f} s: frames {part['first_frame']} to {last}{of}{every}"


def _verdict(report: Report) -> Iterator[tuple[str, str]]:
    verdict = report["verdict"]
    yield "verdict", verdict["verdict"]
    for reason in verdict["reasons"]:
        yield "", f"{reason['reason']}: {reason['advice']}"
    spans = by_second.short(report)
    if len(spans) > 1 or verdict["verdict"] != "good":
        for i, (when, words) in enumerate(spans):
            yield "" if i else "seconds", f"{when}: {words}"


def _files(result: Result) -> Iterator[tuple[str, str]]:
    report, folder = result.report, Path(result.folder)
    if report["overlay"] is not None:
        yield "overlay", f"could not be drawn ({report['overlay']}); the motion is there"
    if (missing := report.get("page")) is not None:
        yield "page", f"report.html could not be made ({missing}); the motion is there"
    if (lost := report.get("landmarks")) is not None:
        yield "landmarks", f"could not be kept ({lost}); a rerun looks for them again"
    if (better := report.get("better")) is not None:
        yield "kept", f"{better} is better, and stays; --replace replaces it all the same"
    if (earlier := report.get("earlier")) is not None:
        yield "earlier", f"{earlier}: the result that was there, for it holds files of others"
    files = ", ".join(sorted(path.name for path in folder.iterdir()))
    yield "written", f"{folder}: {files}"
    kept = result.job.detected
    if kept is not None and Path(kept).parent == folder.resolve().parent:
        yield "", f"{kept}: the landmarks of the video"
