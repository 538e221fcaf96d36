"""The person and the motion of a fit that has ended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon.body import names
from simrecon.evidence import visibility
from simrecon.geometry import camera as cameras
from simrecon.kinematics.layout import Variables, to_qpos
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.person import stature_and_mass
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.touched import labels, touched
from simrecon.sim import models, poses
from simrecon.sim.address import locate
from simrecon.types import Array, Body, Camera, Evidence, KinematicFit


def result(
    evidence: Evidence,
    camera: Camera | None,
    problem: Problem,
    variables: Variables,
    shape: bodies.Shape | None,
    distribution: str,
    iterations: int,
) -> KinematicFit:
    """The fit at the variables.

    Args:
        evidence: that was fitted.
        camera: with extrinsics, or None.
        problem: that was solved.
        variables: its solution.
        shape: of the person, None without betas.
        distribution: of mass, by name.
        iterations: of the search.
    """
    objective = Objective(problem)
    objective(variables.pack())
    person = build(evidence, problem, variables, shape, distribution)
    qpos = to_qpos(variables.root_m, problem.base, variables.rotvecs)
    com, marks = configurations(person, qpos)
    found, see = touched(person, problem.scene, qpos, evidence.times_s), problem.observations
    return KinematicFit(
        body=person,
        scene=problem.scene,
        camera=camera,
        times_s=evidence.times_s,
        qpos=qpos,
        com_m=com,
        reprojection_px=_reprojection_px(evidence, camera, marks),
        interpolated=~visibility(evidence),
        iterations=iterations,
        loss=objective.losses,
        contacts=labels(found, see.labels, see.targets),
    )


def build(
    evidence: Evidence, problem: Problem, variables: Variables, shape: bodies.Shape | None, distribution: str
) -> Body:
    """The body at the fitted scale; arguments as of `result`."""
    scale = float(np.exp(variables.log_scale))
    skeleton = bodies.rescaled(problem.person(variables), scale)
    lower = variables.sole_m * problem.drop
    skeleton = replace(skeleton, point_offsets_m=skeleton.point_offsets_m + lower)
    height, mass = stature_and_mass(skeleton, evidence)
    if shape is not None:
        height = shape.height_m * scale
        mass = evidence.mass_kg or shape.mass_kg * scale**3
    return bodies.build(
        skeleton,
        height_m=height,
        mass_kg=mass,
        betas=None if shape is None else shape.betas,
        shapes=None if shape is None else shape.shapes,
        distribution=distribution,
    )


def _reprojection_px(evidence: Evidence, camera: Camera | None, marks: Array) -> Array:
    """Distance (T, K) of landmarks (T, M, 3) from their detections, NaN where there are none."""
    off = np.full(evidence.scores.shape, np.nan)
    if evidence.keypoint_names and camera is not None:
        where = names.resolve(evidence.keypoint_names)
        known = where != names.IGNORED
        projected = cameras.project(camera, marks[:, where[known]])
        off[:, known] = np.linalg.norm(projected - evidence.keypoints_px[:, known], axis=-1)
    return off


def configurations(person: Body, qpos: Array) -> tuple[Array, Array]:
    """Centre of mass (T, 3) and landmark points (T, M, 3) of configurations qpos (T, nq), m."""
    model = models.compile_text(person.mjcf)
    own = locate(model)
    marks, com = poses.sites_and_com(model, qpos, own.sites(model, person.skeleton.point_names), own.body)
    return com, marks
