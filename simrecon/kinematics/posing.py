"""Poses of a known body in a known scene: nothing of the person or the floor is estimated."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from simrecon import trust
from simrecon.evidence import visibility
from simrecon.kinematics import search, terms
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.layout import to_qpos
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.observe import by_point, observe
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.result import configurations
from simrecon.kinematics.start import start
from simrecon.kinematics.touched import labels, touched
from simrecon.plan import Kinematics
from simrecon.system import blas
from simrecon.types import Body, Evidence, KinematicFit, Scene

SIZE_SIGMA = 0.01
"""Of the stature; without effect, for it does not move."""


@blas.one_thread()
def pose(evidence: Evidence, body: Body, scene: Scene, plan: Kinematics) -> KinematicFit:
    """Fit root and joint angles of a body to joints in the world: inverse kinematics of all frames at once.

    The objective is that of `fit`, with the terms of floor, contact, balance and smoothness; scale, lengths
    and sole of the body, and the floor, stay as they are.

    Args:
        evidence: a 3D estimate in the world of `scene`, on T uniform frames.
        body: the person.
        scene: what the person may touch.
        plan: weights and scales.

    Raises:
        InputError: nothing in the evidence can be used.
    """
    worth, skeleton = replace(trust.of(evidence), metric=True), body.skeleton
    plan = terms.switched(trust.weighed(plan, worth))
    see = observe(evidence, skeleton, by_point(evidence, skeleton), None, plan, worth, SIZE_SIGMA)
    variables, base = start(skeleton, see, None, 0)
    touch = contact_points(skeleton, body.primitives)
    problem = Problem.of_clip(skeleton, touch, scene, base, see, plan, lengths=False)
    objective = Objective(problem)
    variables, used = search.minimise(
        objective,
        partial(curvature, problem),
        replace(variables, sole_m=0.0),
        plan.evaluations,
        shared=False,
    )
    objective(variables.pack())
    qpos = to_qpos(variables.root_m, base, variables.rotvecs)
    com, marks = configurations(body, qpos)
    return KinematicFit(
        body=body,
        scene=scene,
        camera=None,
        times_s=evidence.times_s,
        qpos=qpos,
        com_m=com,
        reprojection_px=marks[..., 0][:, :0],
        interpolated=~visibility(evidence),
        iterations=used,
        loss=objective.losses,
        contacts=labels(touched(body, scene, qpos, evidence.times_s), None, None),
    )
