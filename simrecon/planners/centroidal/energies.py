"""The energies of Rempe 2020, B.3 (eqs. B1 to B7), as residuals with their derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simrecon.geometry import rotations
from simrecon.kinematics import forward, layout
from simrecon.kinematics.jacobian import of_points
from simrecon.kinematics.layout import AXES, FREE
from simrecon.kinematics.observations import Observations
from simrecon.planners.centroidal.plane import Floor
from simrecon.planners.centroidal.settings import Initial
from simrecon.types import Array, Flags, IntArray, KinematicFit

Rows = tuple[Array, sparse.csr_matrix]
"""Residuals (N,), and their derivatives (N, T · FREE)."""


@dataclass(frozen=True, eq=False)
class Data:
    """What the motion is held to; J joints, F foot points, T frames.

    Attributes:
        fit: body and where the search begins; base: (T, 3, 3) orientation of its root.
        joints: (J,) rows of the body's points.
        see: projections and 3D estimates of all points.
        segments: (F,), offsets_m: (F, 3), radii_m: (F,) of the foot points.
        contact: (F, T); floor: that they are on, or None.
        numbers: weights α and units.
    """

    fit: KinematicFit
    base: Array
    joints: IntArray
    see: Observations
    segments: IntArray
    offsets_m: Array
    radii_m: Array
    contact: Flags
    floor: Floor | None
    numbers: Initial

    def pose(self, x: Array) -> forward.Pose:
        """Of unknowns (T · FREE,), one frame after the other."""
        root, rotvecs, _ = layout.split(layout.from_frames(x, np.zeros(0)), len(self.base))
        return forward.forward(self.fit.body.skeleton, root, self.base, rotvecs, 1.0)

    def feet_m(self, x: Array) -> Array:
        """Foot points, (F, T, 3)."""
        return forward.points(self.pose(x), self.segments, self.offsets_m)


def rows(data: Data, x: Array) -> Rows:
    """All residuals; half the sum of their squares is half the objective."""
    pose, skeleton, count = data.pose(x), data.fit.body.skeleton, len(data.base)
    numbers, unit = data.numbers, 1 / data.numbers.unit_m
    segments = skeleton.point_segments[data.joints]
    world = forward.points(pose, segments, skeleton.point_offsets_m[data.joints])  # (J, T, 3)
    moved = of_points(skeleton, pose, segments, world)  # (T, J, 3, FREE)
    inner = moved.copy()
    inner[..., :AXES] = 0.0  # q is relative to the root
    own = np.swapaxes(world, 0, 1) - x.reshape(count, FREE)[:, None, :AXES]  # (T, J, 3)
    q, by_q = unit * own.ravel(), unit * _blocks(inner)
    first, second = (_differences(count, order, AXES * len(data.joints)) for order in (1, 2))
    parts = [
        (numbers.velocity, first @ q, first @ by_q),  # B2
        (numbers.angle, *_angles(data, x)),  # B3
        (numbers.acceleration, second @ q, second @ by_q),  # B4
        (numbers.data, *_estimate(data, own, inner)),  # B5
        *_feet(data, pose),  # B6, B7
    ]
    if data.see.world_to_camera is not None:
        parts.append((numbers.projection, *_projected(data, data.see.world_to_camera, world, moved)))  # B1
    return (
        np.concatenate([np.sqrt(weight) * value for weight, value, _ in parts]),
        sparse.vstack([np.sqrt(weight) * slope for weight, _, slope in parts], format="csr"),
    )


def _blocks(moved: Array) -> sparse.csr_matrix:
    """Derivatives (T, ..., FREE) by the unknowns of their frame as one matrix."""
    count = len(moved)
    flat = np.ascontiguousarray(moved.reshape(count, -1, FREE))
    row = np.arange(count + 1)
    return sparse.bsr_matrix((flat, row[:-1], row), shape=(count * flat.shape[1], count * FREE)).tocsr()


def _differences(count: int, order: int, width: int) -> sparse.csr_matrix:
    """From (T · width,) to the differences from a frame to the next."""
    steps = np.diff(np.eye(count), order, axis=0)
    return sparse.kron(sparse.csr_matrix(steps), sparse.identity(width), format="csr")


def _angles(data: Data, x: Array) -> Rows:
    """Turns of all joints from a frame to the next; of the root over the fit's, to first order."""
    count, width = len(data.base), FREE - AXES
    select = sparse.kron(sparse.identity(count), sparse.identity(FREE, format="csr")[AXES:], format="csr")
    by = _differences(count, 1, width) @ select
    value = (by @ x).reshape(count - 1, width)
    turned = np.swapaxes(data.base[:-1], 1, 2) @ data.base[1:]
    value[:, :AXES] += rotations.log(rotations.from_matrix(turned))
    return value.ravel(), by


def _estimate(data: Data, own: Array, inner: Array) -> Rows:
    """Joints from their places in the 3D estimate, both relative to the root."""
    sure = np.sqrt(_shares(data.see.joint_weights[data.joints])).T  # (T, J)
    root = data.see.root_weights[data.joints]
    share = root / max(float(root.sum()), 1e-9)
    off = own - np.einsum("p,tpi->ti", share, own)[:, None]
    off -= np.nan_to_num(np.swapaxes(data.see.joints_m[data.joints], 0, 1))
    by = inner - np.einsum("p,tpik->tik", share, inner)[:, None]
    unit = sure[..., None] / data.numbers.unit_m
    return (unit * off).ravel(), _blocks(unit[..., None] * by)


def _projected(data: Data, camera: Array, world: Array, moved: Array) -> Rows:
    """Detections from projected joints, pixels."""
    see, focal = data.see, data.numbers.focal_px
    turn, shift = camera[:, :3, :3], camera[:, :3, 3]
    seen = np.einsum("tij,ptj->tpi", turn, world) + shift[:, None]  # (T, J, 3)
    depth = np.maximum(seen[..., 2:], 0.1)
    weight = focal * np.sqrt(_shares(see.ray_weights[data.joints])).T[..., None]  # (T, J, 1)
    rays = np.nan_to_num(np.swapaxes(see.rays[data.joints], 0, 1))
    off = weight * (seen[..., :2] / depth - rays)
    by = np.einsum("tij,tpjk->tpik", turn, moved)
    slope = (by[..., :2, :] - (seen[..., :2] / depth)[..., None] * by[..., 2:, :]) / depth[..., None]
    return off.ravel(), _blocks(weight[..., None] * slope)


def _feet(data: Data, pose: forward.Pose) -> list[tuple[float, Array, sparse.csr_matrix]]:
    """Contacts stay where they are, and on the floor, if there is one yet."""
    places = forward.points(pose, data.segments, data.offsets_m)  # (F, T, 3)
    moved = of_points(data.fit.body.skeleton, pose, data.segments, places)  # (T, F, 3, FREE)
    unit, contact = 1 / data.numbers.unit_m, data.contact.T.astype(float)  # (T, F)
    step = _differences(len(contact), 1, AXES * len(data.segments))
    held = sparse.diags(np.repeat(contact[:-1].ravel(), AXES) * unit)
    by = held @ step
    parts = [(data.numbers.contact_velocity, by @ np.swapaxes(places, 0, 1).ravel(), by @ _blocks(moved))]
    if data.floor is not None:
        off = data.floor.over_m(np.swapaxes(places, 0, 1)) - data.radii_m
        slope = np.einsum("i,tfik->tfk", data.floor.normal, moved)
        on = unit * contact
        parts.append((data.numbers.floor, (on * off).ravel(), _blocks(on[..., None] * slope)))
    return parts


def _shares(weights: Array) -> Array:
    """Weights as shares of the largest, as confidences are."""
    return np.asarray(np.nan_to_num(weights) / max(float(np.nanmax(weights, initial=0.0)), 1e-12))
