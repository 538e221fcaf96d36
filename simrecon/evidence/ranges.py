"""What numbers of evidence and cameras may be: beyond it a unit or a file is wrong."""

from __future__ import annotations

POSITION_MAX_M = 1e5
"""Of a joint or a camera from the origin of its world: a hundred kilometres."""
SIDE_PX = (1, 65_536)
"""Of an image."""
PIXEL_SIDES = 100.0
"""Of a landmark or the centre of the lens from the image's corner, in its longer sides."""
FOCAL_SIDES = (0.02, 200.0)
"""Focal length in longer sides of the image: from a fisheye to a field of view of a third of a degree."""
DISTORTION_MAX = 1e6
"""Of a coefficient; long lenses have large ones."""
TURN_MAX = 1e3
"""Of a number of a camera's rotation: a vector in radians, or a matrix."""
