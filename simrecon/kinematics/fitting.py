"""From evidence to a person, a world and the pose of every frame; no physics yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from simrecon import body as bodies
from simrecon import trust
from simrecon.contact import wishes
from simrecon.geometry import camera as cameras
from simrecon.kinematics import bones, falling, floor, lens, person, search, terms, tilt, wishing, world
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.observe import by_point, observe
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.result import result
from simrecon.kinematics.spread import spread
from simrecon.kinematics.start import start
from simrecon.plan import Kinematics
from simrecon.system import blas
from simrecon.types import Array, Camera, ContactWish, Evidence, KinematicFit, Primitive, Scene

LENS_EVALUATIONS = 80
"""Of each fit with a focal length that is tried."""
FAR = 10
"""Evaluations of a round far from the answer, where the curvature soon is another."""


@blas.one_thread()
def fit(
    evidence: Evidence,
    scene: Scene,
    plan: Kinematics,
    request: bodies.ShapeRequest | None = None,
    asked: Sequence[ContactWish] = (),
) -> KinematicFit:
    """Fit shape scale, root and joint angles of all frames to the evidence, and a camera that nobody knows.

    Who falls before a camera that nobody has placed is fitted again, as tall as the fall says.

    Args:
        evidence: on a uniform time grid.
        scene: what the person may touch, in the world of the camera's extrinsics where those are given.
        plan: weights and scales.
        request: the body's shape; None: primitives by the proportions of `models/body/primitives.toml`.
        asked: what a user wishes of the contacts.

    Raises:
        InputError: nothing in the evidence can be used, no such shape, or bones that are not those measured.
    """
    brief = replace(plan, evaluations=min(plan.evaluations, LENS_EVALUATIONS))
    evidence = lens.estimated(
        evidence, lambda tried: _fitted(tried, scene, brief, request, (), spreads=False)
    )
    lean = None
    if plan.poses and _unplaced(evidence, scene):
        without = _without_floor(lens.middle(evidence), scene, brief, request)
        lean = tilt.estimated(lambda tried: _with_floor(without, (), lean=tried, spreads=False))
    fitted = _fitted(evidence, scene, plan, request, asked, lean=lean)
    if (height_m := falling.stature_m(evidence, fitted)) is None:
        return fitted
    return _fitted(replace(evidence, height_m=height_m), scene, plan, request, asked, lean=lean)


def _unplaced(evidence: Evidence, scene: Scene) -> bool:
    """Whether landmarks are of a camera whose place and tilt the fit finds."""
    camera = evidence.camera
    if camera is None or camera.path is not None or not evidence.keypoint_names:
        return False
    return floor.known(evidence, scene, trust.of(evidence)) not in ("scene", "level")


@dataclass(frozen=True, eq=False)
class _Floorless:
    """A fit before its floor is known, or one whose floor is the scene's.

    Attributes:
        evidence, scene, request: of the fit.
        plan: as the evidence is trusted.
        known: how the floor is known (`floor.known`).
        camera, parts, shape: of the fit.
        problem, variables, iterations: of its end.
    """

    evidence: Evidence
    scene: Scene
    request: bodies.ShapeRequest | None
    plan: Kinematics
    known: str
    camera: Camera | None
    parts: tuple[Primitive, ...]
    shape: bodies.Shape | None
    problem: Problem
    variables: Variables
    iterations: int


def _fitted(
    evidence: Evidence,
    scene: Scene,
    plan: Kinematics,
    request: bodies.ShapeRequest | None,
    asked: Sequence[ContactWish],
    *,
    lean: Array | None = None,
    spreads: bool = True,
) -> KinematicFit:
    """The fit through a lens that is known, or taken for known, of a camera with a tilt (2,)."""
    return _with_floor(_without_floor(evidence, scene, plan, request), asked, lean=lean, spreads=spreads)


def _without_floor(
    evidence: Evidence, scene: Scene, plan: Kinematics, request: bodies.ShapeRequest | None
) -> _Floorless:
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
    contacts = contact_points(skeleton, parts, rolling=plan.soles == "rolling")
    problem = Problem.of_clip(skeleton, contacts, scene, base, see, weights, lengths=free)
    variables, iterations = _minimise(problem, variables)
    return _Floorless(
        evidence, scene, request, plan, known, camera, parts, shape, problem, variables, iterations
    )


def _with_floor(
    first: _Floorless, asked: Sequence[ContactWish], *, lean: Array | None, spreads: bool
) -> KinematicFit:
    evidence, scene, plan, parts, known = first.evidence, first.scene, first.plan, first.parts, first.known
    camera, problem, variables, iterations = first.camera, first.problem, first.variables, first.iterations
    transform = np.eye(4)
    if known != "scene":
        full = replace(problem, plan=plan)
        if known == "level":
            problem = replace(full, scene=floor.laid(scene, floor.height_m(problem, variables, parts)))
        else:
            own = evidence.joints_frame == "world"
            turned = tilt.turned(lean, cameras.extrinsics(camera)[0]) if lean is not None and camera else None
            transform = floor.transform(problem, variables, parts, world=own, turned=turned)
            camera = world.moved(camera, transform)
            problem = replace(
                full,
                base=transform[:3, :3] @ full.base,
                observations=world.observed(full.observations, transform, camera),
            )
            root_m = variables.root_m @ transform[:3, :3].T + transform[:3, 3]
            variables = replace(variables, root_m=root_m)
        variables, more = _minimise(problem, variables)
        iterations += more
    if targets := wishes.targets(asked, evidence.times_s):
        problem, variables, more = wishing.honour(problem, variables, targets)
        iterations += more
    distribution = "standard" if first.request is None else first.request.distribution
    fitted = result(evidence, camera, problem, variables, first.shape, distribution, iterations)
    fitted = replace(fitted, wished=targets)
    bones.check(evidence, fitted.body.skeleton)
    wide = spread(problem, variables, camera) if spreads and plan.poses else None
    return replace(fitted, world=transform, spread_m=wide)


def _minimise(problem: Problem, variables: Variables) -> tuple[Variables, int]:
    """Find poses first, then size and lengths, too; without poses to optimise the start is the end.

    Far from the answer, who shrinks obeys the terms of contact and time best: with size free from the start,
    people went to half their stature in the first round, and took hundreds of evaluations to come back.
    """
    evaluations = problem.plan.evaluations if problem.plan.poses else 0
    minimise = partial(search.minimise, Objective(problem), partial(curvature, problem))
    variables, first = minimise(variables, min(FAR, evaluations), shared=False)
    variables, more = minimise(variables, min(3 * FAR, evaluations - first), anew=FAR)
    variables, rest = minimise(variables, evaluations - first - more)
    return variables, first + more + rest
