"""Kinematic fits of a person who stands in one pose and is moved as a whole."""

from __future__ import annotations

import numpy as np

from simrecon import body as bodies
from simrecon import prior
from simrecon.contact.parts import names
from simrecon.kinematics import configurations, forward, layout
from simrecon.kinematics.contacts import contact_points
from simrecon.types import Array, Body, ContactLabels, KinematicFit, Scene

FRAME_S = 1 / 30
STATURE_M, MASS_KG = 1.7, 70.0
FEET = ("left_toe", "left_heel", "right_toe", "right_heel")


def person(mass_kg: float = MASS_KG, distribution: str = "standard") -> Body:
    """Of average lengths."""
    skeleton = bodies.scaled({}, STATURE_M)
    return bodies.build(skeleton, height_m=STATURE_M, mass_kg=mass_kg, distribution=distribution)


def stance(body: Body) -> tuple[Array, float]:
    """Rotation vectors (SEGMENTS, 3) of a stance on level soles, and the height of the pelvis over them."""
    turns = np.concatenate((np.zeros((1, 3)), prior.gaussian(body.skeleton).mean_rad))
    touch = contact_points(body.skeleton, body.primitives)
    ankles = [body.skeleton.names.index(f"{side}_ankle") for side in ("left", "right")]
    for _ in range(3):
        pose = forward.forward(
            body.skeleton, np.zeros((1, 3)), np.eye(3)[None], np.asarray(turns)[:, None], 1.0
        )
        corners = forward.points(pose, touch.segments, touch.offsets_m)[touch.soles, 0]  # (2, 4, 3)
        along = corners[:, 2:].mean(axis=1) - corners[:, :2].mean(axis=1)
        turns[ankles, 1] += np.arctan2(along[:, 2], along[:, 0])
    return turns, -float(corners[..., 2].mean())


def fit(moves_m: Array, contact: Array, body: Body | None = None, scene: Scene | None = None) -> KinematicFit:
    """A fit of T frames.

    Args:
        moves_m: (T, 3) of the whole person, from a stance on the floor.
        contact: (T,) whether all of both feet touch, or (T, 4) in the order of `FEET`.
        body: of the person.
        scene: without an item if None.
    """
    body, count = body or person(), len(moves_m)
    turns, height = stance(body)
    root = moves_m + np.array([0.0, 0.0, height])
    base = np.tile(np.eye(3), (count, 1, 1))
    qpos = layout.to_qpos(root, base, np.repeat(turns[:, None], count, axis=1))
    probability = np.zeros((count, len(names())))
    flags = np.broadcast_to(np.atleast_2d(np.asarray(contact, float).T).T, (count, len(FEET)))
    for column, name in enumerate(FEET):
        probability[:, names().index(name)] = flags[:, column]
    return KinematicFit(
        body=body,
        scene=scene or Scene(),
        camera=None,
        times_s=np.asarray(FRAME_S * np.arange(count), np.float64),
        qpos=qpos,
        com_m=configurations(body, qpos)[0],
        reprojection_px=np.full((count, 0), np.nan),
        interpolated=np.zeros(count, bool),
        iterations=0,
        loss={},
        contacts=ContactLabels(names(), probability, "made"),
    )


def jump(stand_s: float = 0.5, flight_s: float = 0.5) -> KinematicFit:
    """Who stands, jumps straight up, and stands again."""
    times = FRAME_S * np.arange(round((2 * stand_s + flight_s) / FRAME_S) + 1)
    since = np.clip(times - stand_s, 0.0, flight_s)
    height = 0.5 * 9.81 * since * (flight_s - since)
    moves = np.column_stack((np.zeros((len(times), 2)), height))
    return fit(moves, height < 1e-9)
