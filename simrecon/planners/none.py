"""The planner `none`: the simulation follows the kinematic fit as it is, as in Gärtner et al. 2022."""

from __future__ import annotations

from dataclasses import replace

from simrecon.plan import Plan
from simrecon.types import Evidence, KinematicFit, Reference


def plan(fit: KinematicFit, _evidence: Evidence, _settings: Plan) -> Reference:
    """The poses of the fit, and its contacts."""
    bare = Reference("none", fit.times_s, fit.qpos, fit.com_m)
    if fit.contacts is None:
        return bare
    return replace(bare, contact_names=fit.contacts.parts, contact=fit.contacts.probability)
