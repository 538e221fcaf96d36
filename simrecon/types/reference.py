"""What the simulation is asked to do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon.types.arrays import Array
from simrecon.types.body import Body
from simrecon.types.camera import Camera
from simrecon.types.scene import Scene


@dataclass(frozen=True, eq=False)
class KinematicFit:
    """Root and joint angles of all frames, in the world of the scene; no physics yet.

    Attributes:
        body, scene: what was fitted, where.
        camera: with extrinsics resolved to the world of `scene`, or None.
        times_s: (T,) uniform.
        qpos: (T, 7 + 4 * 16) root position, root quaternion, joint quaternions.
        com_m: (T, 3).
        reprojection_px: (T, J), NaN where a landmark was not seen.
        interpolated: (T,) frames in which the person was out of view.
        iterations: of the optimiser.
        loss: at the end, by term.
    """

    body: Body
    scene: Scene
    camera: Camera | None
    times_s: Array
    qpos: Array
    com_m: Array
    reprojection_px: Array
    interpolated: NDArray[np.bool_]
    iterations: int
    loss: dict[str, float]
