"""The forces that explain a wrench best, against the conditions of an optimum."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.planners.soft_contact.forces import explain, project
from simrecon.types import Array

FRAMES, CONTACTS = 12, 7


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def test_the_projection_is_the_nearest_point_of_the_cone(rng: np.random.Generator) -> None:
    vectors, normals = rng.standard_normal((200, 3)), unit(rng.standard_normal((200, 3)))
    friction = rng.uniform(0.1, 1.2, 200)
    near, _ = project(vectors, normals, friction)
    along = np.sum(near * normals, axis=1)
    across = np.linalg.norm(near - along[:, None] * normals, axis=1)
    assert (across <= friction * along + 1e-12).all()
    # of a convex cone: what is left is normal to the point, and on the other side of all of the cone
    left = vectors - near
    np.testing.assert_allclose(np.sum(left * near, axis=1), 0.0, atol=1e-12)
    others = project(rng.standard_normal((200, 3)), normals, friction)[0]
    assert (np.sum(left * others, axis=1) <= 1e-12).all()
    assert 20 < np.count_nonzero(~near.any(axis=1)) < 180


def test_the_slope_of_the_projection(rng: np.random.Generator) -> None:
    vectors, normals = rng.standard_normal((100, 3)), unit(rng.standard_normal((100, 3)))
    friction, step = np.full(100, 0.7), 1e-6
    moves = [
        (project(vectors + e, normals, friction)[0] - project(vectors - e, normals, friction)[0]) / (2 * step)
        for e in step * np.eye(3)
    ]
    np.testing.assert_allclose(project(vectors, normals, friction)[1], np.stack(moves, axis=-1), atol=1e-8)


@pytest.mark.parametrize("asked", [False, True])
def test_no_other_forces_are_better(rng: np.random.Generator, *, asked: bool) -> None:
    wrench = 20.0 * rng.standard_normal((FRAMES, 6))
    arms = 20.0 * rng.standard_normal((FRAMES, CONTACTS, 6, 3))
    cost = 10.0 ** rng.uniform(-3, 3, (FRAMES, CONTACTS))
    normals, friction = unit(rng.standard_normal((FRAMES, CONTACTS, 3))), np.full((FRAMES, CONTACTS), 0.8)

    wanted = rng.standard_normal((FRAMES, CONTACTS, 3)) if asked else np.zeros((FRAMES, CONTACTS, 3))

    def loss(forces: Array) -> Array:
        left = wrench - np.einsum("tcij,tcj->ti", arms, forces)
        paid = np.sum(cost * np.sum(forces**2, axis=2) - 2 * np.sum(wanted * forces, axis=2), axis=1)
        return np.asarray(0.5 * np.sum(left**2, axis=1) + 0.5 * paid)

    found = explain(wrench, arms, cost, normals, friction, wanted=wanted if asked else None)
    np.testing.assert_allclose(
        found.residual, wrench - np.einsum("tcij,tcj->ti", arms, found.forces), atol=1e-5
    )
    np.testing.assert_allclose(project(found.forces, normals, friction)[0], found.forces, atol=1e-9)
    for size in (1e-4, 1e-2, 1.0):
        moved = found.forces + size * rng.standard_normal(found.forces.shape)
        assert (loss(project(moved, normals, friction)[0]) >= loss(found.forces)).all()
    start = rng.standard_normal((FRAMES, 6))
    again = explain(wrench, arms, cost, normals, friction, start, wanted)
    np.testing.assert_allclose(again.residual, found.residual, atol=1e-5)


def test_nothing_to_push_explains_nothing() -> None:
    wrench = np.ones((2, 6))
    arms = np.zeros((2, 1, 6, 3))
    arms[:, 0, :3] = np.eye(3)
    down = np.tile([0.0, 0.0, -1.0], (2, 1, 1))
    found = explain(wrench, arms, np.ones((2, 1)), down, np.zeros((2, 1)))
    np.testing.assert_array_equal(found.forces, 0.0)  # the scene pushes down only, and the wrench goes up
    np.testing.assert_allclose(found.residual, wrench)
