"""The kinematic half: person, world and poses from evidence alone."""

from simrecon.kinematics.fitting import fit
from simrecon.kinematics.posing import pose
from simrecon.kinematics.result import configurations
from simrecon.kinematics.retargeting import retarget
from simrecon.kinematics.stature import fit_to_stature
from simrecon.kinematics.terms import floating

__all__ = ["configurations", "fit", "fit_to_stature", "floating", "pose", "retarget"]
