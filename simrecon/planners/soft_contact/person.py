"""What all frames share, where a plan may move it: scale, sole and lengths of the person.

The priors are those of the kinematic fit, whose problem is resumed with them. Masses stay as they are, since
all counts in body weights: where a segment's joint is farther off, its mass goes with it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon.body import mjcf
from simrecon.kinematics.gradient import of_lengths, of_sole
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.unscaled import resized
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.physics import Motion
from simrecon.types import Array, Body, IntArray


def gradient(motion: Motion, found: Explained, points: tuple[IntArray, Array, Array], force: Array) -> Array:
    """Of the physics by log scale, sole and lengths, (2 + L,).

    Args:
        motion: at which it is taken.
        found: the forces there.
        points: what `Motion.gradient` gives: segments, places and slopes.
        force: (SEGMENTS, T, 3) on each segment and all below it, from `forward.adjoint` of these points.
    """
    state, (segments, places, slopes) = motion.state, points
    touch = state.problem.contacts
    drop = np.concatenate((np.zeros_like(motion.world.masses.offsets_m), *[touch.drop] * 3))
    by_sole = of_sole(state, segments, drop, slopes)
    # all lengths grow with exp(log_scale), so a point moves by its distance from the root; radii grow too
    grown = float(np.sum(slopes * (places - state.variables.root_m))) - state.variables.sole_m * by_sole
    closer = motion.by_distance(motion.priced(found)).sum(axis=1)  # (G,)
    by_scale = grown - state.scale * float(closer @ touch.radii_m)
    return np.concatenate(([by_scale, by_sole], of_lengths(state, force)))


def grown(body: Body, problem: Problem, start: Variables, end: Variables) -> Body:
    """The body of a plan: that of the fit, as heavy as before, with the lengths that the plan found.

    Args:
        body: of the fit.
        problem: of the plan.
        start: its variables at the fit's end.
        end: its solution.
    """
    scale, sole_m = float(np.exp(end.log_scale)), end.sole_m
    skeleton = bodies.rescaled(problem.person(end), scale)
    skeleton = replace(skeleton, point_offsets_m=skeleton.point_offsets_m + sole_m * problem.drop)
    ratio = float(np.exp(end.log_scale - start.log_scale))
    parts = tuple(resized(part, ratio, sole_m - ratio * start.sole_m) for part in body.primitives)
    taller = bodies.stature_m(skeleton) / bodies.stature_m(body.skeleton)
    return replace(
        body,
        height_m=body.height_m * taller,
        skeleton=skeleton,
        primitives=parts,
        mjcf=mjcf.make(skeleton, parts, body.mass_kg),
    )
