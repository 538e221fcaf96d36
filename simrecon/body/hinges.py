"""The person with three hinges for each ball joint, for tools that know only free, slide and hinge joints.

The axes are the segment's x, y and z, in this order: the rotation of a joint is R_x(a) R_y(b) R_z(c), which
is what MuJoCo makes of three hinges of one body. Angles count from the middle of the joint's range, as ours.
"""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array, Body, Skeleton

AXES = "xyz"


def mjcf(body: Body) -> str:
    """The MJCF of a person, whose ball joints are hinges, with a motor on each."""
    spec = mujoco.MjSpec.from_string(body.mjcf)
    for name, limits in zip(body.skeleton.names[1:], body.skeleton.limits_rad, strict=True):
        ball, owner = spec.joint(name), spec.body(name)
        damping, armature = float(ball.damping[0]), float(ball.armature)
        spec.delete(ball)
        for axis, letter in enumerate(AXES):
            owner.add_joint(
                name=f"{name}_{letter}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=np.eye(3)[axis],
                range=limits[axis],
                damping=damping,
                armature=armature,
            )
            motor = spec.actuator(f"{name}_{letter}")
            motor.target, motor.gear = f"{name}_{letter}", [1.0, 0, 0, 0, 0, 0]
    text: str = spec.to_xml()
    return text


def joint_names(skeleton: Skeleton) -> tuple[str, ...]:
    """Of the free joint, then of the hinges."""
    return ("root", *(f"{name}_{letter}" for name in skeleton.names[1:] for letter in AXES))


def configurations(qpos: Array) -> Array:
    """Configurations (G, 7 + 48) of the hinges: place, quaternion w x y z, and angles that do not jump."""
    quats = qpos[:, 3:].reshape(len(qpos), -1, 4)
    angles = angles_xyz(rotations.matrix(quats[:, 1:]))
    return np.concatenate((qpos[:, :3], quats[:, 0], angles.reshape(len(qpos), -1)), axis=1)


def angles_xyz(matrices: Array) -> Array:
    """Angles a, b, c (G, J, 3), rad, of R = R_x(a) R_y(b) R_z(c), the nearest to those of the frame before.

    The same rotation has the angles a + π, π - b, c + π; past b = ±π/2 these go on without a jump.
    """
    b = np.arcsin(np.clip(matrices[..., 0, 2], -1.0, 1.0))
    a = np.arctan2(-matrices[..., 1, 2], matrices[..., 2, 2])
    c = np.arctan2(-matrices[..., 0, 1], matrices[..., 0, 0])
    found = np.stack((a, b, c), axis=-1)
    for frame in range(1, len(found)):
        near = found[frame - 1]
        one, two = found[frame], np.stack((a[frame] + np.pi, np.pi - b[frame], c[frame] + np.pi), axis=-1)
        both = np.stack([near + _wrapped(angles - near) for angles in (one, two)])  # (2, J, 3)
        farther = np.abs(both - near).sum(axis=-1)  # (2, J)
        found[frame] = np.where((farther[1] < farther[0])[:, None], both[1], both[0])
    return found


def _wrapped(angles: Array) -> Array:
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
