"""Other programs' axes: a world with y up, and bodies whose rest pose faces z."""

from __future__ import annotations

import numpy as np

from simrecon.evidence.axes import to_z_up

TO_Y_UP = to_z_up("y").T
"""Our world (z up) to one with y up, as `evidence` reads it back."""
LOCAL = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Axes of a segment, x forward and z up, to those of a joint of BVH, glTF or SMPL, z forward and y up."""
