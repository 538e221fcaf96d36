"""What can be known to be wrong with a job before anything long begins: options, files, person and scene."""

from __future__ import annotations

from pathlib import Path

from simrecon import body as bodies
from simrecon import trust
from simrecon.body import primitives
from simrecon.errors import InputError
from simrecon.job import inputs, pairs
from simrecon.job.request import Job
from simrecon.scene import mjcf
from simrecon.types import Scene

STEP_S = 0.01
"""Time step with which a scene is tried; it makes no difference to what is wrong with one."""


def check(job: Job) -> None:
    """Check options and files of a job, and build its scene around an average person.

    Raises:
        InputError: one of them can't be used.
    """
    pairs.refuse(job.reading)
    if job.reading.trust is not None:
        trust.parse(job.reading.trust, "--trust")
    named = (job.input, job.reading.keypoints, job.reading.camera)
    for file in named if job.detected is None else (job.detected,):
        if file is not None and not Path(file).exists():
            raise InputError(f"{file}: can't be read (No such file or directory); give an existing file")
    inputs.shape_of(job.person)
    if job.scene.items and not job.scene.ground.calibrate:
        _build(job.scene)


def _build(scene: Scene) -> None:
    """The scene's model, whose meshes are kept for the run."""
    height = primitives.default_height_m()
    person = bodies.build(
        bodies.scaled({}, height), height_m=height, mass_kg=primitives.default_mass_kg(height)
    )
    mjcf.build(person.mjcf, scene, STEP_S)
