"""The scale of the arrows of forces: one of a body weight, as it would be where the person is."""

from __future__ import annotations

import numpy as np

from simrecon.drawing import canvas
from simrecon.drawing.canvas import Colour, Image
from simrecon.types import Array

_LEAST_SIDE_PX, _LEAST_PX, _MOST_SHARE = 400, 8.0, 0.5


def scale(image: Image, ends_px: Array, text: str, colour: Colour) -> None:
    """Draw the scale at the lower left of an image, if it is large enough for that.

    Args:
        image: to draw on.
        ends_px: (2, 2) ends of an arrow of one body weight where the person is, NaN if out of view.
        text: what it stands for.
        colour: of the arrow.
    """
    height, side = image.shape[0], max(image.shape[:2])
    length = float(np.linalg.norm(ends_px[1] - ends_px[0]))
    if side < _LEAST_SIDE_PX or not _LEAST_PX < length < _MOST_SHARE * height:
        return
    foot = np.array([side / 60, height - side / 60])
    canvas.arrow(image, foot, np.array([foot[0], foot[1] - length]), colour)
    canvas.write(image, text, np.array([foot[0] + side / 90, foot[1]]), canvas.LIGHT)
