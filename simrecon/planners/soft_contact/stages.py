"""The search for a plan, in stages.

One without physics may come first (Xie 2021, section 3.3.3), for poses that are put on splines are no longer
the fit's. Then come rounds with ever finer units of force and moment.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from simrecon.kinematics import search
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.resumed import resume
from simrecon.plan import Plan, SoftContact
from simrecon.planners.soft_contact import person
from simrecon.planners.soft_contact.asked import asked as wished
from simrecon.planners.soft_contact.curvature import curvature
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.nodes import Nodes, laid
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import World
from simrecon.planners.soft_contact.scales import Scales
from simrecon.planners.soft_contact.spline_conditioning import condition
from simrecon.types import Body, Evidence, KinematicFit


def searched(
    fit: KinematicFit, evidence: Evidence, settings: Plan, *, lengths: bool
) -> tuple[Planned, Variables, Body | None]:
    """The objective of the last round, its best variables, and the body with these lengths; None: the fit's.

    Args:
        fit: where it begins.
        evidence: on the frames of the fit.
        settings: weights of the evidence terms, and the section `soft_contact`.
        lengths: whether size and lengths of the person may move, where they are those of the evidence.

    Raises:
        InputError: there is no evidence to plan with.
    """
    asked = settings.soft_contact
    problem, variables = resume(fit, evidence, settings.kinematics, lengths=lengths)
    lengths = len(variables.lengths) > 0
    better = partial(search.minimise, shared=lengths, anew=asked.curved_every, history=asked.history)
    if asked.node_spacing_s:
        nodes = Nodes.spread(problem.frames, asked.node_spacing_s / problem.dt)
        problem, variables = laid(problem, variables, nodes)
        better = partial(better, condition=partial(condition, nodes))
    world, begun = _world(fit, asked, float(np.exp(variables.log_scale))), variables
    world = replace(world, asked=wished(problem, variables, world.weight_N))
    stages = [(asked.weight, unit, asked.evaluations) for unit in asked.units]
    for weight, unit, evaluations in [(0.0, asked.units[0], asked.kinematic), *stages]:
        planned = Planned(problem, world.in_units(unit), weight, fit.com_m, lengths=lengths)
        variables, _ = better(planned, partial(curvature, planned), variables, evaluations)
    body = person.grown(fit.body, problem, begun, variables) if lengths else None
    return planned, variables, body


def _world(fit: KinematicFit, asked: SoftContact, scale: float) -> World:
    """What the term of a fit's person, of a scale, and scene knows, in the units that are asked for."""
    surfaces = [fit.scene.ground.friction, *(item.friction for item in fit.scene.items)]
    friction = np.array([surface.sliding for surface in surfaces])
    return World(Masses.of(fit.body).scaled(1.0 / scale), fit.body.height_m, friction, Scales.of(asked))
