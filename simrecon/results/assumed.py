"""What a run took for granted, and how it is known: who the person is, through which lens, over which floor.

`given`: somebody says it, on the command line or in a file; `measured`: a metric source shows it;
`estimated`: it follows from the rest; `usual`: a value that holds for most; `none`: there is none.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from simrecon import body as bodies
from simrecon import trust
from simrecon.geometry import camera as cameras
from simrecon.job import Job
from simrecon.kinematics import floor, stature_prior
from simrecon.pipeline import Reconstruction
from simrecon.types import Camera

GIVEN, MEASURED, ESTIMATED, USUAL, NONE = "given", "measured", "estimated", "usual", "none"


def make(job: Job, run: Reconstruction) -> dict[str, Any]:
    """The section `assumed` of a report (docs/formats.md)."""
    known = GIVEN if job.retarget else floor.known(run.evidence, job.scene, trust.of(run.evidence))
    return {
        "height": _height(job, run, known),
        "mass": {"origin": GIVEN if job.retarget or run.evidence.mass_kg is not None else ESTIMATED},
        "lens": _lens(job, run),
        "camera": _camera(run),
        "floor": _floor(run, known),
    }


def _height(job: Job, run: Reconstruction, known: str) -> dict[str, Any]:
    """Where the stature is from, and what the source alone would have made it."""
    if job.retarget or job.person.betas is not None:
        return {"origin": GIVEN, "shown_m": None}
    evidence, plan = run.evidence, run.problem.plan.kinematics
    lengths = bodies.measure(evidence) if plan.shape and evidence.joint_names else {}
    tall = stature_prior.settle(evidence.height_m, lengths, trust.of(evidence), floor=known)
    origin = ESTIMATED if tall.origin == stature_prior.ASSUMED else tall.origin
    return {"origin": origin, "shown_m": tall.shown_m}


def _lens(job: Job, run: Reconstruction) -> dict[str, Any]:
    camera, reading = run.fit.camera, job.reading
    if camera is None:
        return dict.fromkeys(("by", "fov_deg", "size_px", "focal_px", "focal_error_pct")) | {"origin": NONE}
    width, height = camera.lens.image_size_px
    by = "--camera" if reading.camera else "--fov" if reading.fov_deg else "the input"
    sigma = camera.lens.focal_sigma
    return {
        "origin": ESTIMATED if sigma else USUAL if reading.unknown_camera else GIVEN,
        "by": None if sigma or reading.unknown_camera else by,
        "fov_deg": math.degrees(2 * math.atan(0.5 * width / cameras.focal_px(camera.lens))),
        "size_px": [width, height],
        "focal_px": float(cameras.focal_px(camera.lens)),
        "focal_error_pct": 100 * math.expm1(sigma),
    }


def _camera(run: Reconstruction) -> dict[str, Any]:
    """Where it is, of one that is carried in the first frame."""
    before, after = run.evidence.camera, run.fit.camera
    if after is None:
        return {"origin": NONE, "height_m": None, "down_deg": None}
    given = before is not None and before.path is not None and run.evidence.ground_known
    return {
        "origin": GIVEN if given else ESTIMATED,
        "height_m": float(cameras.centre_m(after)[0, 2] - run.fit.scene.ground.height_m),
        "down_deg": _down_deg(after),
    }


def _down_deg(camera: Camera) -> float:
    """By how much it looks down, in the first frame."""
    ahead = cameras.extrinsics(camera)[0, 2, :3]
    return math.degrees(math.asin(float(np.clip(-ahead[2], -1.0, 1.0))))


def _floor(run: Reconstruction, known: str) -> dict[str, Any]:
    """Its height in the world of the result; one that is found either moves the world or is laid in it."""
    origin = GIVEN if known in ("scene", GIVEN) else ESTIMATED
    return {"origin": origin, "height_m": run.fit.scene.ground.height_m}
