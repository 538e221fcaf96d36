"""Primitives fitted to a skin (Gärtner 2022, eq. 9): distances, derivatives, recovery, and the regressor."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from trimesh import proximity

from simrecon.body import fitting, pieces, shape, sizes, surface, targets
from simrecon.types import Array

CAPSULE = np.array([0.02, -0.1, 0.05, 0.03, 0.15, 0.1, 0.06, 0.0, 0.0])
BOX = np.array([0.02, 0.05, -0.1, 0.0, 0.0, 0.0, 0.05, 0.08, 0.02])


@pytest.mark.parametrize(("kind", "values"), [("capsule", CAPSULE), ("box", BOX)])
def test_signed_distance_and_its_derivative(kind: str, values: Array, rng: np.random.Generator) -> None:
    on, area, _ = surface.samples(kind, values)
    np.testing.assert_allclose(surface.distance(kind, values, on)[0], 0.0, atol=1e-12)
    points = values[:3] + rng.uniform(-0.15, 0.15, (200, 3))
    apart, slope = surface.distance(kind, values, points)
    for k in range(9):
        step = np.zeros(9)
        step[k] = 1e-6
        numeric = (
            surface.distance(kind, values + step, points)[0]
            - surface.distance(kind, values - step, points)[0]
        ) / 2e-6
        np.testing.assert_allclose(slope[:, k], numeric, atol=1e-4)
    whole = 2 * np.pi * 0.06 * np.linalg.norm(CAPSULE[3:6] - CAPSULE[:3]) + 4 * np.pi * 0.06**2
    assert area.sum() == pytest.approx(
        whole if kind == "capsule" else 8 * (0.05 * 0.08 + 0.08 * 0.02 + 0.02 * 0.05)
    )
    assert (apart < 0).any()
    assert (apart > 0).any()


@pytest.mark.parametrize(("kind", "values"), [("capsule", CAPSULE), ("box", BOX)])
def test_samples_move_as_their_derivative_says(kind: str, values: Array, rng: np.random.Generator) -> None:
    _, _, slope = surface.samples(kind, values)
    step = 1e-6 * rng.normal(size=9) * (np.arange(9) < 7 if kind == "capsule" else np.arange(9) != 4)
    before, after = surface.samples(kind, values)[0], surface.samples(kind, values + step)[0]
    # a turn about the axis is along the surface: compare along the normal
    normal = before - (before - 1e-3 * _outward(kind, values, before))
    moved, predicted = np.sum((after - before) * normal, axis=1), np.sum((slope @ step) * normal, axis=1)
    np.testing.assert_allclose(moved, predicted, atol=2e-12)


def _outward(kind: str, values: Array, points: Array) -> Array:
    h = 1e-6
    columns = [
        (
            surface.distance(kind, values, points + h * axis)[0]
            - surface.distance(kind, values, points - h * axis)[0]
        )
        / (2 * h)
        for axis in np.eye(3)
    ]
    return np.stack(columns, axis=1)


def test_pieces_are_closed_and_share_out_all_faces() -> None:
    space = shape.space()
    parts = pieces.cut(space.faces, space.weights.argmax(axis=1))
    assert sorted(parts) == list(range(17))
    assert sum((~piece.fans).sum() for piece in parts.values()) == len(space.faces)
    for piece in parts.values():
        edges = np.sort(piece.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()  # a fan may fold at a notch


def test_closest_points_are_those_of_trimesh(rng: np.random.Generator) -> None:
    goal = targets.of_shape(shape.space(), np.zeros(10))["left_hip"]
    points = goal.vertices_m[rng.integers(len(goal.vertices_m), size=60)] + rng.normal(
        scale=0.02, size=(60, 3)
    )
    mesh = trimesh.Trimesh(goal.vertices_m, goal.piece.faces, process=False)
    _, expected, _ = proximity.closest_point_naive(mesh, points)
    nearest = pieces.closest(goal.piece, goal.vertices_m, points)
    far = np.linalg.norm(nearest - points, axis=1)
    assert (far >= expected - 1e-9).all()
    assert np.mean(far - expected) < 2e-4


def test_sizes_and_values_are_each_others_inverse(rng: np.random.Generator) -> None:
    layout = sizes.layout()
    assert len(layout.names) == 17
    psi = rng.normal(size=len(layout.lower))
    np.testing.assert_allclose(sizes.pack(sizes.values(psi)), psi, atol=1e-12)
    for name, central, row in zip(layout.names, layout.central, sizes.values(psi), strict=True):
        if central:
            mirrored = np.concatenate((row[:3] * [1, -1, 1], row[3:6] * [1, -1, 1]))
            swapped = np.concatenate((mirrored[3:], mirrored[:3]))
            assert np.allclose(mirrored, row[:6]) or np.allclose(swapped, row[:6]), name


def capsule_goal(values: Array) -> targets.Target:
    """A forearm that is a capsule."""
    mesh = trimesh.creation.capsule(height=0.2, radius=0.04, count=[24, 24])
    mesh.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], [0, 1, 0]))
    mesh.apply_translation(values)
    faces = np.asarray(mesh.faces, dtype=np.int64)
    piece = pieces.cut(faces, np.zeros(len(mesh.vertices), np.int64))[0]
    area = pieces.vertex_areas(np.asarray(mesh.vertices), faces)
    return targets.Target(
        piece, np.asarray(mesh.vertices), np.asarray(mesh.vertices), area / area.sum(), False
    )


def test_a_capsule_is_recovered_from_its_mesh() -> None:
    goal = capsule_goal(np.array([0.01, 0.12, -0.02]))
    begin = fitting.start(1.7)
    psi = fitting.fit({"left_elbow": goal}, begin)
    values = sizes.values(psi)[sizes.layout().names.index("left_forearm")]
    ends = values[:6].reshape(2, 3)
    ends = ends[np.argsort(ends[:, 1])]
    np.testing.assert_allclose(ends, [[0.01, 0.02, -0.02], [0.01, 0.22, -0.02]], atol=2e-3)
    assert values[6] == pytest.approx(0.04, abs=1e-3)


def test_the_gradient_of_the_loss_and_a_wrong_one() -> None:
    goal = capsule_goal(np.array([0.03, 0.13, -0.02]))
    layout, psi = sizes.layout(), fitting.start(1.7)
    rows = [layout.names.index("left_forearm")]
    columns = np.flatnonzero(np.abs(layout.matrix[rows]).sum(axis=(0, 1)))
    problem = fitting._Segment(goal, rows, columns, psi)
    slope = problem(psi[columns])[1]
    steps = 1e-6 * np.eye(len(columns))
    ahead, behind = (np.array([problem(psi[columns] + sign * step)[0] for step in steps]) for sign in (1, -1))
    numeric = (ahead - behind) / 2e-6
    np.testing.assert_allclose(slope, numeric, atol=1e-4)
    assert np.abs(1.01 * slope - numeric).max() > 1e-3


@pytest.mark.slow
def test_the_regressor_is_nearly_as_good_as_a_direct_fit(rng: np.random.Generator) -> None:
    betas = rng.normal(size=10)
    goals = targets.of_shape(shape.space(), betas)
    direct, fast = fitting.fit(goals, fitting.start(shape.stature_m(betas))), sizes.regress(betas)
    names = sizes.layout().segments
    pairs = [
        [fitting.loss(goal, [i for i, s in enumerate(names) if s == name], psi) / 2 for psi in (direct, fast)]
        for name, goal in goals.items()
    ]
    best, ours = np.mean(pairs, axis=0)
    assert best < 0.009
    assert ours < best + 0.0015
