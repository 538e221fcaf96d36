"""The job of a finished result, to be done again from its motion on."""

from __future__ import annotations

from dataclasses import replace

from simrecon.job import Job, request
from simrecon.results import report_file
from simrecon.results.folder import MOTION
from simrecon.results.view import Result
from simrecon.types import Scene


def job_of(result: Result) -> Job:
    """The job of a result, to be done again from its motion on.

    What was not known of person and floor is not known now either: the same fit then finds the same. A plan
    is no motion to begin from.
    """
    start = None if result.motion.is_planned else str(result.folder / MOTION)
    job = replace(result.job, scene=scene_of(result), start=start)
    return request.taken_anew(job, ("start",))


def scene_of(result: Result) -> Scene:
    """The scene of a result, in which a floor that the fit has put at its height is where it was before."""
    scene = result.scene
    with report_file.understood(result.folder):
        floor = result.report.get("assumed", {}).get("floor", {})
        found = floor.get("origin") == "estimated" and floor.get("height_m") == scene.ground.height_m
    if not found:
        return scene
    height_m = result.job.scene.ground.height_m
    return replace(scene, ground=replace(scene.ground, height_m=height_m))
