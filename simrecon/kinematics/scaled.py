"""A motion at the size of another body."""

from __future__ import annotations

import numpy as np

from simrecon import prior
from simrecon import scene as scenes
from simrecon.contact import labels
from simrecon.kinematics.contacts import ContactPoints
from simrecon.kinematics.observations import Observations
from simrecon.kinematics.supports import Supports
from simrecon.plan import Kinematics
from simrecon.types import Array, Scene, Skeleton


def observations(
    skeleton: Skeleton,
    touch: ContactPoints,
    marks_m: Array,
    rest: Supports,
    scene: Scene,
    scale: float,
    interval_s: float,
    plan: Kinematics,
) -> Observations:
    """The scaled landmarks as what the objective holds the pose against.

    Args:
        skeleton: of the other body.
        touch: its contact points.
        marks_m: (M, T, 3) landmarks of the motion before.
        rest: what that touched.
        scene: floor and items.
        scale: of the other body.
        interval_s: between frames.
        plan: names the prior on poses.
    """
    count, frames = marks_m.shape[:2]
    roots = np.zeros(count)
    roots[[skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]] = 0.5
    root = np.tensordot(roots, marks_m, axes=1)  # (T, 3)
    gaussian = prior.gaussian(skeleton)
    standing = rest.held[touch.soles].mean(axis=1)  # (2, T - 1)
    sitting = rest.held[touch.seat].max(axis=(0, 1))  # (T - 1,)
    return Observations(
        interval_s=interval_s,
        rays=np.zeros((count, frames, 2)),
        ray_weights=np.zeros((count, frames)),
        ray_sigma=1.0,
        world_to_camera=None,
        joints_m=scale * (marks_m - root),
        joint_weights=np.ones((count, frames)),
        place_m=places(scene, root, rest.height_m, scale),
        place_weights=np.ones(frames),
        root_weights=roots,
        labels=labels.of_feet_and_hips(
            np.concatenate((standing[:, :1], standing), axis=1), np.append(sitting[:1], sitting), "motion"
        ),
        scale_sigma=1.0,
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=prior.make(plan.prior_model, skeleton),
    )


def places(scene: Scene, places_m: Array, support_m: Array, scale: float) -> Array:
    """Where places (T, 3) of a scaled person are, given the heights (T,) on which the person rests.

    On bare ground all is scaled about the ground under the first place. Among items only heights are, over
    the support.
    """
    if scene.items:
        above = places_m[:, 2] - support_m
        return np.column_stack((places_m[:, :2], support_m + scale * above))
    centre = places_m[0].copy()
    centre[2] = scenes.support_height(scene, centre[None, :2])[0]
    scaled: Array = centre + scale * (places_m - centre)
    return scaled
