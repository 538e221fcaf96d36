"""Poses on cubic splines: what lies on them, and the search over their nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from simrecon.geometry import rotations
from simrecon.kinematics import layout
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.layout import FREE, LEAN, Variables
from simrecon.planners.soft_contact.nodes import Nodes, unwound
from simrecon.planners.soft_contact.spline_conditioning import SplineConditioning, condition
from simrecon.types import Array


def test_the_basis_is_that_of_cubic_hermite_splines() -> None:
    nodes, rng = Nodes.spread(33, 8), np.random.default_rng(0)
    values, slopes = rng.standard_normal((2, 5, 2))
    c = np.stack((values, 8 * slopes), axis=1).reshape(10, 2)
    expected = CubicHermiteSpline(np.arange(0, 33, 8), values, slopes)(np.arange(33))
    np.testing.assert_allclose(nodes.basis @ c, expected, atol=1e-12)


def test_nodes_are_even_and_no_farther_apart_than_asked() -> None:
    nodes = Nodes.spread(30, 8)
    assert nodes.count == 2 * 5
    np.testing.assert_allclose(nodes.weights[[0, -1]], [[1, 0, 0, 0], [0, 0, 1, 0]], atol=1e-12)
    assert np.bincount(nodes.first).max() == 8


def test_what_lies_on_a_spline_stays_and_noise_does_not() -> None:
    nodes, rng = Nodes.spread(40, 6), np.random.default_rng(1)
    on = nodes.basis @ rng.standard_normal((nodes.count, 3))
    np.testing.assert_allclose(nodes.smoothed(on), on, atol=1e-6)
    noise = rng.standard_normal((40, 3))
    assert np.linalg.norm(nodes.smoothed(noise)) < 0.8 * np.linalg.norm(noise)


@pytest.mark.parametrize("frames", [3, 4, 5, 6, 7])
def test_a_short_clip_has_splines_too(frames: int) -> None:
    nodes = Nodes.spread(frames, 3)
    values = np.random.default_rng(2).standard_normal((frames, 2))
    assert np.isfinite(nodes.smoothed(values)).all()


@pytest.mark.parametrize("spacing", [1.0, 1e-6, 5e-324, 0.0])
def test_nodes_closer_than_frames_are_as_close_as_they_may_be(spacing: float) -> None:
    assert Nodes.spread(24, spacing).count == Nodes.spread(24, 3).count


def test_rotation_vectors_go_on_where_they_pass_half_a_turn() -> None:
    angle = np.linspace(2.0, 5.0, 20)  # rotation vectors are at most π long
    axis = np.array([0.6, 0.0, 0.8])
    short = rotations.log(rotations.exp(angle[:, None] * axis))[None]
    assert np.abs(np.diff(short, axis=1)).max() > 1.0
    np.testing.assert_allclose(unwound(short)[0], angle[:, None] * axis, atol=1e-9)


def _random(frames: int, rng: np.random.Generator, last: int = 5) -> tuple[list[Curvature], Array, Variables]:
    """A curvature in two parts, with a border of the lean and five more, and the same as a matrix."""
    leans = layout.leans(frames, 1 / 30)
    shared, wide = 5 + leans.shape[1] * LEAN, 5 + LEAN
    rows = rng.standard_normal((frames, 70, 3 * FREE)) / 10  # squares of rows over three frames
    lean = np.stack([np.kron(leans[t], np.eye(LEAN)) for t in range(frames)])  # (T, 3, 3 F)
    matrix = np.eye(FREE * frames + shared)
    matrix[FREE * frames :, FREE * frames :] *= 50.0
    for t in range(frames - 2):
        whole = np.zeros((70, len(matrix)))
        whole[:, FREE * t : FREE * (t + 3)] = rows[t]
        matrix += whole.T @ whole
    border = rng.standard_normal((frames, FREE, wide)) / 10
    spread = np.concatenate((border[..., :5], border[..., 5:] @ lean), axis=-1).reshape(-1, shared)
    matrix[: FREE * frames, FREE * frames :] = spread
    matrix[FREE * frames :, : FREE * frames] = spread.T
    corner = matrix[FREE * frames :, FREE * frames :]
    square = matrix[: FREE * frames, : FREE * frames].reshape(frames, FREE, frames, FREE)
    blocks = [np.stack([square[t + k, :, t] for t in range(frames - k)]) for k in range(3)]
    cut, parts = frames - last, []
    for piece in (slice(cut), slice(cut, frames)):
        own = [block[piece] for block in blocks]
        part = Curvature((own[0], own[1], own[2]), border[piece], leans[piece], corner / 2)
        parts.append(part)
    start = Variables(
        rng.standard_normal((frames, 3)),
        rng.standard_normal((layout.SEGMENTS, frames, 3)),
        0.1,
        0.2,
        np.zeros(3),
        rng.standard_normal((leans.shape[1], LEAN)),
    )
    return parts, matrix, start


def _matrix(better: SplineConditioning, count: int) -> Array:
    """The map from u to packed variables, in the order of frames."""
    columns = []
    for unit in np.eye(count):
        own, shared = layout.by_frame(better.to_variables(unit) - better.start, len(better.nodes.first))
        columns.append(np.concatenate((own, shared)))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("last", [5, 2, 1])  # frames of the last part, which ties fewer than three
def test_the_search_s_variables_make_the_curvature_the_identity(last: int) -> None:
    rng, frames = np.random.default_rng(3), 12
    parts, matrix, start = _random(frames, rng, last)
    nodes = Nodes.spread(frames, 5)
    better = condition(nodes, parts, start)
    count = better.free + len(better.corner)
    moved = _matrix(better, count)
    np.testing.assert_allclose(moved.T @ matrix @ moved, np.eye(count), atol=1e-4)
    g = rng.standard_normal(len(start.pack()))
    own, shared = layout.by_frame(g, frames)
    np.testing.assert_allclose(better.gradient(g), moved.T @ np.concatenate((own, shared)), atol=1e-9)


def test_it_begins_where_it_is_taken_and_knows_the_way_back() -> None:
    parts, _, start = _random(12, np.random.default_rng(4))
    better = condition(Nodes.spread(12, 5), parts, start)
    np.testing.assert_allclose(better.from_variables(start.pack()), 0.0, atol=1e-9)
    u = np.random.default_rng(5).standard_normal(better.free + len(better.corner))
    np.testing.assert_allclose(better.from_variables(better.to_variables(u)), u, atol=1e-5)
    other = replace(start, log_scale=0.3)
    assert better.from_variables(other.pack())[better.free] != 0.0
