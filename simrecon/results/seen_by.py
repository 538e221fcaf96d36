"""The section `camera` of a report: through which lens and from where the frames were seen."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.geometry import camera as cameras
from simrecon.pipeline import Reconstruction

_DIGITS = 9


def make(run: Reconstruction) -> dict[str, Any] | None:
    """Intrinsics and extrinsics at the frames of the motion; None where the camera's place is not known.

    Returns:
        `image_size_px`, `K` (3 × 3), `dist` (k1 k2 p1 p2 k3), and `world_to_camera`: 3 × 4 matrices [R t],
        one for a camera that stands still, else one for each frame.
    """
    camera = run.fit.camera
    if camera is None or camera.path is None:
        return None
    placed = cameras.resampled(camera, run.fit.times_s, run.motion.times_s)
    path = cameras.extrinsics(placed)
    shown = path[:1] if cameras.is_still(placed) else path
    return {
        "image_size_px": list(placed.lens.image_size_px),
        "K": placed.lens.matrix_px,
        "dist": placed.lens.distortion,
        "world_to_camera": np.round(shown[:, :3], _DIGITS),
    }
