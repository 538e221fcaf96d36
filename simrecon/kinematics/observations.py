"""What the kinematic fit holds the pose against."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from simrecon.contact import labels
from simrecon.prior import Prior
from simrecon.types import Array, ContactLabels, ContactTargets, IntArray


@dataclass(frozen=True, eq=False)
class Observations:
    """What the pose is held against; M points of the body, T frames.

    Attributes:
        interval_s: between frames.
        rays: (M, T, 2) undistorted detections x/z, y/z; ray_weights: (M, T); ray_sigma: in the same units.
        world_to_camera: (T, 4, 4), or None without 2D landmarks.
        joints_m: (M, T, 3) 3D estimate, world axes, relative to its root; joint_weights: (M, T).
        place_m: (T, 3) where the 3D estimate puts its root; place_weights: (T,).
        root_weights: (M,) with which points' mean is the root of the 3D estimate.
        labels: how surely which part of the body rests; targets: what a user wishes of them, or None.
        scale_sigma: how well the skeleton's scale is known (natural logarithm); length_sigma: single lengths.
        lean_sigma: how far the 3D estimate may lean, rad.
        metric: the 3D estimate has the person's true size, and does not grow with the person's.
        neutral, spread: (JOINTS, 3) of the joints' rotation vectors: where the search begins, its scale.
        prior: on poses.
    """

    interval_s: float
    rays: Array
    ray_weights: Array
    ray_sigma: float
    world_to_camera: Array | None
    joints_m: Array
    joint_weights: Array
    place_m: Array
    place_weights: Array
    root_weights: Array
    labels: ContactLabels
    scale_sigma: float
    neutral: Array
    spread: Array
    prior: Prior
    length_sigma: float = 0.25
    lean_sigma: float = 0.15
    metric: bool = False
    targets: ContactTargets | None = None

    @cached_property
    def standing(self) -> Array:
        """How surely the left and the right foot stand, (2, T), 0 to 1."""
        return labels.standing(self.labels)

    @cached_property
    def sitting(self) -> Array:
        """How surely the hips rest, (T,), 0 to 1."""
        return labels.sitting(self.labels)

    def part(self, frames: slice | IntArray) -> Observations:
        """Those of some frames."""
        camera = self.world_to_camera
        return replace(
            self,
            rays=self.rays[:, frames],
            ray_weights=self.ray_weights[:, frames],
            world_to_camera=None if camera is None else camera[frames],
            joints_m=self.joints_m[:, frames],
            joint_weights=self.joint_weights[:, frames],
            place_m=self.place_m[frames],
            place_weights=self.place_weights[frames],
            labels=self.labels.at(frames),
            targets=None if self.targets is None else self.targets.at(frames),
        )
