"""The kinematic half: person, world and poses from evidence alone."""

from simrecon.kinematics.fitting import configurations, fit
from simrecon.kinematics.retargeting import retarget

__all__ = ["configurations", "fit", "retarget"]
