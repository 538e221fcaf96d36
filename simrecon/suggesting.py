"""Supports that a clip needs and its scene lacks, and the job of a scene that has them."""

from __future__ import annotations

from dataclasses import replace

from simrecon import kinematics, plan
from simrecon.evidence import resample
from simrecon.job import Job, Person, inputs
from simrecon.observer import Observer
from simrecon.scene import suggest
from simrecon.scene.suggest import Suggestion, stance_heights
from simrecon.scene.suggest.motion import measure
from simrecon.types import Evidence, KinematicFit, Scene

QUICK = "quick"
"""Plan of the fit in which supports are looked for."""
UNSURE_LEAST_M = 0.25
"""Of a foot over the floor, where one camera cannot tell a tall person far away from a short one nearby: what
is lower may be an error of the distance."""

UNSURE = (
    "the person's height is not given, and one camera cannot tell small and near from tall and far: "
    f"under the feet, only what is higher than {UNSURE_LEAST_M:g} m can be found"
)


def has_size(seen: Evidence) -> bool:
    """Whether evidence tells a tall person far away from a short one nearby."""
    return seen.height_m is not None or seen.joints_frame == "world"


def suggestions(seen: Evidence, scene: Scene, person: Person) -> tuple[KinematicFit, tuple[Suggestion, ...]]:
    """Supports that a motion needs where the scene has none, and the fit in which they were found.

    Where sizes are known they alone say how high feet are. Where they aren't, seats are looked for with the
    feet held to the floor, and under the feet only what is higher than an error of the distance.

    Args:
        seen: the evidence.
        scene: what is known already.
        person: what is known of the person.

    Raises:
        InputError: the evidence can't be fitted.
    """
    shape, weights, clip = inputs.shape_of(person), plan.read(QUICK).kinematics, resample(seen)[0]
    loose = kinematics.floating(weights)
    if has_size(seen):
        fit = kinematics.fit_to_stature(clip, scene, loose, shape)
        return fit, suggest.suggest(fit.body, scene, fit.times_s, fit.qpos)
    free = on_lowest(kinematics.fit(clip, scene, loose, shape))
    high = suggest.suggest(free.body, scene, free.times_s, free.qpos, least_m=UNSURE_LEAST_M, seats=False)
    if high:  # the floor of a fit that holds every foot to it is none of these heights
        return free, high
    held = kinematics.fit(clip, scene, weights, shape)
    return held, suggest.suggest(held.body, scene, held.times_s, held.qpos, least_m=UNSURE_LEAST_M)


def on_lowest(fit: KinematicFit) -> KinematicFit:
    """A fit of which the floor was found, with that under the lowest feet that stand, if it was far above.

    A plane is under most of the frames: a roof, for who jumps off it at the end.
    """
    levels = stance_heights(measure(fit.body, fit.times_s, fit.qpos))
    drop = min(levels, default=0.0) - fit.scene.ground.height_m
    if drop > -UNSURE_LEAST_M:
        return fit
    qpos = fit.qpos.copy()
    qpos[:, 2] -= drop
    return replace(fit, qpos=qpos)


def completed(job: Job, seen: Evidence, observer: Observer) -> Job:
    """The job with the supports in its scene that the motion needs, if it asks for them.

    Raises:
        InputError: the evidence can't be fitted.
    """
    if not job.suggest:
        return job
    observer.stage("supports", 0.0, 1.0)
    found = suggestions(seen, job.scene, job.person)[1]
    observer.stage("supports", 1.0, 1.0)
    for line in [f"{entry.item.name}: {entry.why}" for entry in found] or ["none is needed"]:
        observer.note(f"supports: {line}")
    items = (*job.scene.items, *(entry.item for entry in found))
    return replace(job, scene=replace(job.scene, items=items), suggest=False)
