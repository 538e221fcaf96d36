"""The kinematic half: person, world and poses from evidence alone."""

from simrecon.kinematics.fitting import fit
from simrecon.kinematics.result import configurations
from simrecon.kinematics.retargeting import retarget
from simrecon.kinematics.terms import floating
from simrecon.kinematics.to_stature import fit_to_stature

__all__ = ["configurations", "fit", "fit_to_stature", "floating", "retarget"]
