"""The world in which a clip is fitted: camera as given, or level; floor from the lowest foot points."""

from __future__ import annotations

import cv2
import numpy as np

from simrecon import camera as cameras
from simrecon import rotations
from simrecon.types import Array, Camera, Evidence

LEVEL = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""World to camera of a camera at the origin that looks along x and stands upright."""

LOWEST_SHARE = 0.05
LEVEL_SIGMA_RAD = 0.03


def provisional(evidence: Evidence) -> Camera | None:
    """The camera with extrinsics, to begin with.

    Without extrinsics it is placed by the 3D estimate where that is in the world (perspective-n-point over
    all frames), and taken for upright at the origin otherwise.
    """
    camera = evidence.camera
    if camera is None or camera.world_to_camera is not None:
        return camera
    shared = [name for name in evidence.joint_names if name in evidence.keypoint_names]
    if evidence.joints_frame != "world" or len(shared) < 4:
        return cameras.with_extrinsics(camera, LEVEL)
    world = evidence.joints_m[:, [evidence.joint_names.index(name) for name in shared]].reshape(-1, 3)
    pixels = evidence.keypoints_px[:, [evidence.keypoint_names.index(name) for name in shared]].reshape(-1, 2)
    known = np.isfinite(world).all(axis=1) & np.isfinite(pixels).all(axis=1)
    if known.sum() < 6:
        return cameras.with_extrinsics(camera, LEVEL)
    solved, rotvec, translation = cv2.solvePnP(
        world[known], pixels[known], camera.matrix_px, camera.distortion, flags=cv2.SOLVEPNP_SQPNP
    )
    transform = np.eye(4)
    transform[:3, :3] = rotations.matrix(rotations.exp(np.ravel(rotvec)))
    transform[:3, 3] = np.ravel(translation)
    return cameras.with_extrinsics(camera, transform if solved else LEVEL)


def floor_transform(feet_m: Array, *, tilt: bool) -> Array:
    """Rigid transform (4, 4) that brings the lowest foot points to z = 0.

    Args:
        feet_m: (G, T, 3) foot points in the provisional world.
        tilt: whether the floor's slope is fitted too, with a level floor as prior; for a camera whose angle
            is unknown.
    """
    lowest = feet_m[np.argmin(feet_m[..., 2], axis=0), np.arange(feet_m.shape[1])]  # (T, 3)
    share = max(LOWEST_SHARE, min(1.0, 5 / len(lowest)))
    normal = np.array([0.0, 0.0, 1.0])
    if tilt:
        normal = _normal(lowest, share)
    height = lowest @ normal
    level = float(np.median(np.sort(height)[: max(1, int(share * len(height)))]))
    axis = np.cross(normal, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    rotvec = axis / sine * np.arctan2(sine, normal[2]) if sine > 1e-9 else np.zeros(3)
    transform = np.eye(4)
    transform[:3, :3] = rotations.matrix(rotations.exp(rotvec))
    transform[2, 3] = -level
    return transform


def _normal(lowest: Array, share: float) -> Array:
    """Plane under the lowest points: ridge regression of height on position, on points that stay low."""
    slope = np.zeros(2)
    centre = lowest.mean(axis=0)
    low = lowest
    for _ in range(5):
        residual = (lowest - centre)[:, 2] - (lowest - centre)[:, :2] @ slope
        low = lowest[residual <= np.quantile(residual, max(0.5, share))]
        centre = low.mean(axis=0)
        flat = low[:, :2] - centre[:2]
        # noise of a foot's height is about 2 cm
        ridge = (0.02 / LEVEL_SIGMA_RAD) ** 2 * np.eye(2)
        slope = np.linalg.solve(flat.T @ flat + ridge, flat.T @ (low[:, 2] - centre[2]))
    normal: Array = np.array([-slope[0], -slope[1], 1.0])
    return normal / float(np.linalg.norm(normal))


def moved(camera: Camera | None, transform: Array) -> Camera | None:
    """The camera after the world was moved by `transform` (4, 4)."""
    if camera is None:
        return None
    return cameras.with_extrinsics(camera, cameras.extrinsics(camera) @ np.linalg.inv(transform))
