"""From a fit to a plan and its full body; all that needs CasADi is behind this door."""

from __future__ import annotations

from simrecon.planners.centroidal.fullbody import full_body
from simrecon.planners.centroidal.inputs import inputs
from simrecon.planners.centroidal.planned import Planned, at_frames
from simrecon.planners.centroidal.residual import wrench
from simrecon.planners.centroidal.settings import Settings
from simrecon.planners.centroidal.stages import solve
from simrecon.types import KinematicFit


def planned(fit: KinematicFit, settings: Settings) -> Planned:
    """The plan of a kinematic fit."""
    return at_frames(solve(inputs(fit, settings), settings))


__all__ = ["full_body", "planned", "wrench"]
