"""Scores of a result folder, as `simrecon eval` prints them; docs/metrics.md has the details."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from simrecon import evidence, metrics
from simrecon.errors import InputError
from simrecon.results import folder as folders

Scores = dict[str, dict[str, float]]

DEFINITIONS = {
    "covered": "share of the reference's frames that the motion covers",
    "mpjpe_g_mm": "MPJPE-G: mean distance of 12 joints in the world",
    "mpjpe_mm": "MPJPE: the same with the roots of every frame joined",
    "mpjpe_pa_mm": "MPJPE-PA: the same after the best similarity transform of every frame",
    "mpjpe_g_align1_mm": "MPJPE-G with the roots of the first frame joined (Gärtner 2022)",
    "root_mm": "mean distance of the roots, which lie between the hips",
    "velocity_mps": "mean norm of the difference of joint velocities",
    "velocity_gartner_mps": "mean absolute difference of joint speeds (Gärtner 2022 eq. 10)",
    "accel_mps2": "mean norm of the difference of joint accelerations",
    "foot_contact_frames": "heels and toes at rest in the reference; the next four look at these",
    "footskate_pct": "share of them that move faster than 0.5 m/s",
    "foot_slide_mps": "mean speed of heels and toes there",
    "foot_slide_truth_mps": "the same of the reference",
    "foot_height_err_mm": "mean absolute error of their height",
}
"""By score of `metrics.evaluate`."""

OWN_DEFINITIONS = {
    "footskate_pct": "share of frames in which a foot in contact moves more than 2 cm (Gärtner 2022)",
    "float_pct": "share of frames with a foot less than 2 cm above its support (Gärtner 2022)",
    "penetration_mean_mm": "mean depth of the body's lowest point under the ground",
    "penetration_max_mm": "greatest such depth",
    "mean_grf_pct_bw": "mean vertical force of the scene, per cent of body weight",
    "mpjpe_2d_px": "mean distance of landmarks from the detections in the image",
}
"""By score of `report.plausibility`, which needs no reference."""


def score(folder: Path | str, truth: Path | str, given: Path | str | None = None) -> Scores:
    """Scores of a result, of what it was made from, and of the simulation without a reference.

    Args:
        folder: of the result.
        truth: the reference, `simrecon.truth/1`.
        given: the evidence; its 3D joints are scored as they are where they lie in the world.

    Returns:
        `result`; `input` with evidence in the world; and `simulation`, read from `report.json`. A score that
        can't be computed is missing.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    motion, reference = folders.read(folder), metrics.read_truth(truth)
    target = (reference.times_s, reference.joint_names, reference.joints_m)
    scores = {"result": metrics.evaluate(motion.times_s, motion.joint_names, motion.joints_m, *target)}
    if given is not None:
        seen = evidence.read(given)
        if seen.joint_names and seen.joints_frame == "world":
            scores["input"] = metrics.evaluate(seen.times_s, seen.joint_names, seen.joints_m, *target)
    return scores | {"simulation": _own(folder)}


def text(scores: Scores) -> str:
    """Scores as aligned text: one line per score, a column for result and input, and the definition."""
    columns = [name for name in ("result", "input") if name in scores]
    lines = [["", *columns, ""]]
    lines += [_line(name, scores, columns, DEFINITIONS[name]) for name in scores["result"]]
    own = [[""] * len(lines[0]), ["without reference", *[""] * (len(columns) + 1)]]
    own += [_line(name, scores, ["simulation"], OWN_DEFINITIONS[name]) for name in scores["simulation"]]
    if len(own) > 2:
        lines += [[*row[:2], *[""] * (len(lines[0]) - len(row)), *row[2:]] for row in own]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join([name.ljust(widths[0]), *map(str.rjust, values, widths[1:-1]), meaning]).rstrip()
        for name, *values, meaning in lines
    )


def _line(name: str, scores: Scores, columns: Sequence[str], meaning: str) -> list[str]:
    found = (scores[column].get(name) for column in columns)
    return [name, *("-" if value is None else f"{value:.4g}" for value in found), meaning]


def _own(folder: Path | str) -> dict[str, float]:
    """The plausibility scores in the folder's report."""
    path = Path(folder) / folders.REPORT
    try:
        report: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: can't be read ({error}); valid: the report of a result folder") from error
    found = report.get("metrics") if isinstance(report, dict) else None
    if not isinstance(found, dict):
        raise InputError(f"{path}: metrics: found {found!r}; valid: the report of a result folder")
    return {name: float(found[name]) for name in OWN_DEFINITIONS if isinstance(found.get(name), int | float)}
