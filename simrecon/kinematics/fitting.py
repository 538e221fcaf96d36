"""From evidence to a person, a world and the pose of every frame; no physics yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from simrecon import body as bodies
from simrecon import trust
from simrecon.contact import wishes
from simrecon.geometry import camera as cameras
from simrecon.kinematics import bones, floor, person, search, terms, wishing, world
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.observations import Observations
from simrecon.kinematics.observe import by_point, observe
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.result import result
from simrecon.kinematics.start import start
from simrecon.plan import Kinematics
from simrecon.system import blas
from simrecon.types import Array, Camera, ContactWish, Evidence, KinematicFit, Scene


@blas.one_thread()
def fit(
    evidence: Evidence,
    scene: Scene,
    plan: Kinematics,
    request: bodies.ShapeRequest | None = None,
    asked: Sequence[ContactWish] = (),
) -> KinematicFit:
    """Fit shape scale, root and joint angles of all frames to the evidence.

    Args:
        evidence: on a uniform time grid.
        scene: what the person may touch, in the world of the camera's extrinsics where those are given.
        plan: weights and scales.
        request: the body's shape; None: primitives by the proportions of `models/body/primitives.toml`.
        asked: what a user wishes of the contacts.

    Raises:
        InputError: nothing in the evidence can be used, no such shape, or bones that are not those measured.
    """
    worth = trust.of(evidence)
    known = floor.known(evidence, scene, worth)
    skeleton, shape, tall = person.measured(evidence, request, plan, worth, floor=known)
    bones.check(evidence, skeleton)
    points = by_point(evidence, skeleton)
    camera = world.provisional(evidence)
    plan = terms.switched(trust.weighed(plan, worth))
    see = observe(evidence, skeleton, points, camera, plan, worth, tall.sigma)
    parts = person.primitives_of(skeleton, evidence, shape)
    free = plan.shape and (request is None or request.betas is None)  # whether lengths are unknowns
    variables, base = start(skeleton, see, camera, len(bodies.length_names()) if free else 0)

    weights = plan if known == "scene" else terms.floating(plan)
    contacts = contact_points(skeleton, parts)
    problem = Problem.of_clip(skeleton, contacts, scene, base, see, weights, lengths=free)
    variables, iterations = _minimise(problem, variables)
    if known != "scene":
        full = replace(problem, plan=plan)
        if known == "level":
            problem = replace(full, scene=floor.laid(scene, floor.height_m(problem, variables, parts)))
        else:
            tilt = evidence.joints_frame != "world"
            transform = floor.transform(problem, variables, parts, tilt=tilt)
            camera = world.moved(camera, transform)
            problem, variables = _moved(full, variables, transform, camera)
        variables, more = _minimise(problem, variables)
        iterations += more
    if targets := wishes.targets(asked, evidence.times_s):
        problem, variables, more = wishing.honour(problem, variables, targets)
        iterations += more
    distribution = "standard" if request is None else request.distribution
    fitted = result(evidence, camera, problem, variables, shape, distribution, iterations)
    fitted = replace(fitted, wished=targets)
    bones.check(evidence, fitted.body.skeleton)
    return fitted


def _minimise(problem: Problem, variables: Variables) -> tuple[Variables, int]:
    """Without poses to optimise the start is the end."""
    evaluations = problem.plan.evaluations if problem.plan.poses else 0
    return search.minimise(Objective(problem), partial(curvature, problem), variables, evaluations)


def _moved(
    problem: Problem, variables: Variables, transform: Array, camera: Camera | None
) -> tuple[Problem, Variables]:
    """Problem and variables in a world that is moved by a rigid transform (4, 4)."""
    rotation, shift = transform[:3, :3], transform[:3, 3]
    see = problem.observations
    seen: Observations = replace(
        see,
        joints_m=see.joints_m @ rotation.T,
        place_m=see.place_m @ rotation.T + shift,
        world_to_camera=None if see.world_to_camera is None or camera is None else cameras.extrinsics(camera),
    )
    return (
        replace(problem, base=rotation @ problem.base, observations=seen),
        replace(variables, root_m=variables.root_m @ rotation.T + shift),
    )
