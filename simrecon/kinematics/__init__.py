"""The kinematic half: person, world and poses from evidence alone."""

from simrecon.kinematics.clip import configurations, fit

__all__ = ["configurations", "fit"]
