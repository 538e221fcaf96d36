"""Change of variables after which all unknowns of the kinematic fit matter about alike, as L-BFGS wants it.

Over time the unknowns are taken by frequency (cosine transform), since smoothness holds high frequencies
stiffly and low ones not at all; the root's place is taken along the camera's axes, since an image holds depth
hundreds of times less firmly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, idct

from simrecon.body import t_pose_m
from simrecon.kinematics.objective import (
    SIGMA_COM_MPS2,
    SIGMA_SMOOTH_MPS2,
    SIGMA_SMOOTH_RADPS2,
    SIGMA_SOLE_M,
    SIGMA_TOUCH_M,
    Objective,
)
from simrecon.types import Array, Skeleton

# Twists that nothing sees must have some unit where a plan has no prior.
LEAST_PRIOR = 2e-4


@dataclass(frozen=True, eq=False)
class Conditioning:
    """A linear map between the packed variables x (n,) and well-scaled ones u (n,).

    Attributes:
        axes: (3, 3) rows are the directions in which the root's place is taken.
        root: (T, 3) units of the root's place by frequency.
        joints: (17, T, 3) units of the rotation vectors by frequency.
        shared: (2,) units of log scale and sole.
    """

    axes: Array
    root: Array
    joints: Array
    shared: Array

    def to_variables(self, u: Array) -> Array:
        """The packed variables x (n,) of u (n,)."""
        root, joints = self._split(u)
        place = idct(self.root * root, axis=0, norm="ortho") @ self.axes  # (T, 3)
        turned = idct(self.joints * joints, axis=1, norm="ortho")  # (17, T, 3)
        return np.concatenate((place.ravel(), turned.ravel(), self.shared * u[-2:]))

    def from_variables(self, x: Array) -> Array:
        """The scaled variables u (n,) of x (n,)."""
        root, joints = self._split(x)
        place = dct(root @ self.axes.T, axis=0, norm="ortho") / self.root  # (T, 3)
        turned = dct(joints, axis=1, norm="ortho") / self.joints  # (17, T, 3)
        return np.concatenate((place.ravel(), turned.ravel(), x[-2:] / self.shared))

    def gradient(self, g: Array) -> Array:
        """Gradient with respect to u of one with respect to x: the map's transpose."""
        root, joints = self._split(g)
        place = dct(root @ self.axes.T, axis=0, norm="ortho") * self.root  # (T, 3)
        turned = dct(joints, axis=1, norm="ortho") * self.joints  # (17, T, 3)
        return np.concatenate((place.ravel(), turned.ravel(), g[-2:] * self.shared))

    def _split(self, x: Array) -> tuple[Array, Array]:
        frames = len(self.root)
        return x[: 3 * frames].reshape(frames, 3), x[3 * frames : -2].reshape(-1, frames, 3)


def condition(objective: Objective, depth_m: float) -> Conditioning:
    """Units from a rough diagonal of the objective's Hessian.

    Args:
        objective: the problem.
        depth_m: distance of the person from the camera.
    """
    see, w, skeleton = objective.observations, objective.weights, objective.skeleton
    dt, frames = see.interval_s, len(objective.base)
    image = np.zeros(len(skeleton.point_names))
    axes = np.eye(3)
    if see.world_to_camera is not None:
        image = 2 * w.keypoint * see.ray_weights.mean(axis=1) / (see.ray_sigma * depth_m) ** 2  # (M,)
        axes = see.world_to_camera[..., :3, :3].reshape(-1, 3, 3)[0]
    estimate = 2 * w.joint * see.joint_weights.mean(axis=1) / w.joint_scale_m**2  # (M,)
    # second differences by frequency, per s⁴
    wave = (2 - 2 * np.cos(np.pi * np.arange(frames) / frames)) ** 2 / dt**4  # (T,)

    place = 2 * w.place * see.place_weights.mean() / w.place_scale_m**2
    standing = 2 * w.contact / SIGMA_TOUCH_M**2
    across = np.array([image.sum(), image.sum(), 0.02 * image.sum()]) + place  # (3,) along `axes`
    stiff = (
        2 * w.smooth_com / SIGMA_COM_MPS2.min() ** 2
        + 2 * w.smooth_position * len(image) / SIGMA_SMOOTH_MPS2**2
    )
    root = dt * (across + 0.1 * standing + stiff * wave[:, None]) + 1e-6  # (T, 3)

    levers, below = _levers(skeleton)
    weight = image + estimate
    turning = np.sum(below * levers * weight, axis=1)  # (17,)
    held = np.concatenate((np.full((1, 3), 0.1), 2 * max(w.prior, LEAST_PRIOR) / see.spread**2))  # (17, 3)
    swing = 2 * w.smooth_position * np.sum(below * levers, axis=1) / SIGMA_SMOOTH_MPS2**2  # (17,)
    swing = swing + 2 * w.smooth_rotation / SIGMA_SMOOTH_RADPS2**2
    joints = dt * ((turning[:, None] + held)[:, None] + swing[:, None, None] * wave[:, None])  # (17, T, 3)

    drop = np.abs(objective.drop).sum(axis=1)
    scale = 2 / see.scale_sigma**2 + dt * frames * float(levers[0] @ weight)
    sole = 2 / SIGMA_SOLE_M**2 + dt * frames * float(drop @ weight)
    return Conditioning(axes, 1 / np.sqrt(root), 1 / np.sqrt(joints), 1 / np.sqrt([scale, sole]))


def _levers(skeleton: Skeleton) -> tuple[Array, Array]:
    """Squared distances (17, M) of points from joints in T-pose, and which points a joint moves (17, M)."""
    origins = t_pose_m(skeleton)
    places = origins[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    count = len(skeleton.names)
    below = np.zeros((count, count))  # [joint, segment]
    for b in range(count):
        joint = b
        while joint >= 0:
            below[joint, b] = 1.0
            joint = int(skeleton.parents[joint])
    return np.sum((places - origins[:, None]) ** 2, axis=-1), below[:, skeleton.point_segments]
