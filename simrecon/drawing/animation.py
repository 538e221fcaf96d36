"""What is drawn of a motion: its model and poses, and what is known of camera, landmarks and forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.body.clothed import Skin
from simrecon.contact import rules
from simrecon.types import Array, Camera, Motion, Part


@dataclass(frozen=True, eq=False)
class Animation:
    """What is drawn. T frames, J landmarks, C body parts.

    Attributes:
        model: body and scene; geoms that don't move and those named `item/...` are scene.
        times_s: (T,).
        qpos: (T, nq).
        camera: None, or without extrinsics: a view is made up, and there is nothing to draw on.
        keypoints_px: (T, J, 2) in the camera's image, NaN = not seen.
        scores: (T, J) in [0, 1].
        contact_point_m: (T, C, 3), NaN without contact.
        contact_force_N: (T, C, 3) on the body.
        contact_body: (C,) primitives that they are on, which are marked while the scene pushes them.
        status: (T,) other than 0 where a frame is not simulated.
        part: which frames of its source, and of a video of it, these are; None: all.
        skin: of the person, drawn instead of the primitives; None: these are drawn.
        ground_m: (N, 2) points that the floor is drawn around; None: the person's path.
    """

    model: mujoco.MjModel
    times_s: Array
    qpos: Array
    camera: Camera | None = None
    keypoints_px: Array | None = None
    scores: Array | None = None
    contact_point_m: Array | None = None
    contact_force_N: Array | None = None
    contact_body: tuple[str, ...] = ()
    status: NDArray[np.uint8] | None = None
    part: Part | None = None
    skin: Skin | None = None
    ground_m: Array | None = None

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        motion: Motion,
        *,
        camera: Camera | None = None,
        keypoints_px: Array | None = None,
        scores: Array | None = None,
        part: Part | None = None,
        skin: Skin | None = None,
    ) -> Self:
        """What is drawn of a result's motion; see the attributes.

        A frame at which a simulation begins has no forces: they would be those of a single instant, before
        motors and contacts have settled, and not a mean since the frame before.
        """
        began = motion.begins  # (T,)
        return cls(
            model=model,
            times_s=motion.times_s,
            qpos=motion.qpos,
            camera=camera,
            keypoints_px=keypoints_px,
            scores=scores,
            contact_point_m=motion.contact_point_m,
            contact_force_N=np.where(began[:, None, None], 0.0, motion.contact_force_N),
            contact_body=motion.contact_body,
            status=motion.status,
            part=part,
            skin=skin,
        )

    def touching(self, frame: int) -> tuple[str, ...]:
        """The primitives that the scene pushes in a frame."""
        if self.contact_force_N is None or not self.contact_body:
            return ()
        pushed = rules.pushed(np.linalg.norm(self.contact_force_N[frame], axis=-1))
        return tuple(name for name, flag in zip(self.contact_body, pushed, strict=True) if flag)
