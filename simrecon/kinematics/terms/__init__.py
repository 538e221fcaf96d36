"""Terms of the kinematic objective, one class each: weight, loss and gradient, curvature.

term        what a term is
kernels     pure functions that several of them share
image       landmarks in the image
estimate    the 3D estimate
smoothness  what ties frames to each other
touch       floor and items
wishes      contacts that a user wishes
mass        centre of mass
shared      priors on what all frames share
joints      rotation vectors in a frame
kept        those of a motion on another body (`retargeting`)
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

from simrecon.kinematics.terms.estimate import Joint, Place
from simrecon.kinematics.terms.image import Keypoint
from simrecon.kinematics.terms.joints import Limit, PosePrior
from simrecon.kinematics.terms.mass import Balance, SmoothCom
from simrecon.kinematics.terms.shared import Lean, Lengths, Size
from simrecon.kinematics.terms.smoothness import (
    SmoothPosition,
    SmoothRotation,
    Still,
    TravelPosition,
    TravelRotation,
)
from simrecon.kinematics.terms.term import Term
from simrecon.kinematics.terms.touch import Contact, Penetration
from simrecon.kinematics.terms.wishes import Free, Stays, Touches
from simrecon.plan import Kinematics

TERMS: tuple[Term, ...] = (
    Keypoint(),
    Joint(),
    Place(),
    Still(),
    SmoothPosition(),
    TravelPosition(),
    Penetration(),
    Contact(),
    Touches(),
    Stays(),
    Free(),
    SmoothCom(),
    Balance(),
    Size(),
    Lengths(),
    Lean(),
    Limit(),
    SmoothRotation(),
    TravelRotation(),
    PosePrior(),
)
"""All terms of the kinematic fit, in the order in which they are added up."""
PLANNED = tuple(term for term in TERMS if term.planned)
"""Those with a weight in the plan."""


def without(plan: Kinematics, terms: Collection[Term]) -> Kinematics:
    """A plan in which some terms have no weight."""
    off: dict[str, Any] = {term.name: 0.0 for term in terms}
    return replace(plan, **off)


def only(plan: Kinematics, names: Collection[str]) -> Kinematics:
    """A plan in which no term has a weight but those of some names."""
    return without(plan, [term for term in PLANNED if term.name not in names])


def floating(plan: Kinematics) -> Kinematics:
    """A plan in which nothing holds the person to floor and items."""
    return without(plan, [term for term in PLANNED if term.needs_floor])


def switched(plan: Kinematics) -> Kinematics:
    """A plan without the terms of the letters G and T of the ablation, where these are off."""
    plan = plan if plan.ground else floating(plan)
    return plan if plan.temporal else without(plan, [term for term in TERMS if term.temporal])
