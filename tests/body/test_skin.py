"""The skin follows the segments."""

from __future__ import annotations

import numpy as np

from simrecon.body import shape, skin
from simrecon.body.skeleton import template
from simrecon.geometry import rotations

BETAS = np.array([0.5, -1.0, 0.8, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0])


def test_the_relaxed_stance_is_the_shape_itself() -> None:
    space = shape.space()
    origins, axes = space.frames(BETAS)
    np.testing.assert_allclose(skin.posed(space, BETAS, origins, axes), space.vertices_m(BETAS), atol=1e-12)
    larger = skin.posed(space, BETAS, 1.1 * origins, axes, scale=1.1)
    np.testing.assert_allclose(larger, 1.1 * space.vertices_m(BETAS), atol=1e-12)


def test_a_body_that_moves_as_a_whole_is_not_bent() -> None:
    space = shape.space()
    origins, axes = space.frames(BETAS)
    turns = rotations.matrix(rotations.exp(np.array([[0.3, -0.5, 1.2], [0.0, 2.0, 0.1]])))  # (2, 3, 3)
    shift = np.array([[1.0, 2.0, 0.5], [0.0, 0.0, -1.0]])
    placed = np.einsum("tij,sj->tsi", turns, origins) + shift[:, None]
    rows = np.array([0, 5, 100, 2000])
    posed = skin.posed(space, BETAS, placed, turns[:, None] @ axes, rows=rows)
    expected = np.einsum("tij,vj->tvi", turns, space.vertices_m(BETAS)[rows]) + shift[:, None]
    np.testing.assert_allclose(posed, expected, atol=1e-12)


def test_a_raised_forearm_moves_the_hand_and_not_the_foot() -> None:
    space = shape.space()
    origins, axes = space.frames(BETAS)
    bent, places, order = axes.copy(), origins.copy(), template().names
    e, w = order.index("left_elbow"), order.index("left_wrist")
    turn = rotations.matrix(rotations.exp(axes[e] @ np.array([0.0, 0.0, -0.8])))
    bent[e], bent[w] = turn @ axes[e], turn @ axes[w]
    places[w] = origins[e] + turn @ (origins[w] - origins[e])
    moved = np.linalg.norm(skin.posed(space, BETAS, places, bent) - space.vertices_m(BETAS), axis=1)
    labels = space.weights.argmax(axis=1)
    assert moved[labels == w].min() > 0.1
    assert moved[labels == order.index("left_ankle")].max() < 1e-6
