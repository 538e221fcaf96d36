from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon.geometry import rotations
from simrecon.metrics import alignment
from simrecon.types import Array


@pytest.fixture
def pose(rng: np.random.Generator) -> Array:
    """(T, J, 3) any motion."""
    return rng.normal(size=(6, 12, 3))


@given(st.floats(0.1, 10), st.integers(0, 2**31))
def test_procrustes_undoes_any_similarity_of_each_frame(scale: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=(4, 12, 3))
    turn = rotations.matrix(rotations.exp(rng.normal(size=(4, 3))))  # (T, 3, 3)
    moved = scale * truth @ np.swapaxes(turn, -1, -2) + rng.normal(size=(4, 1, 3))
    np.testing.assert_allclose(alignment.procrustes(moved, truth), truth, atol=1e-9)


def test_procrustes_does_not_mirror(pose: Array) -> None:
    off = alignment.procrustes(pose * [1, 1, -1], pose) - pose
    assert np.linalg.norm(off, axis=-1).mean() > 0.1


def test_procrustes_of_one_point_is_the_centre(pose: Array) -> None:
    collapsed = alignment.procrustes(np.zeros_like(pose), pose)
    np.testing.assert_allclose(collapsed, np.broadcast_to(pose.mean(1, keepdims=True), pose.shape))


def test_pieces_are_aligned_each_on_its_own(pose: Array) -> None:
    """Two pieces of three frames, turned differently."""
    turn = rotations.matrix(rotations.exp([0.3, -0.2, 1.0]))
    moved = np.concatenate((1.3 * pose[:3] @ turn.T + 4.0, pose[3:] @ turn + 1.0))
    for first in (True, False):
        np.testing.assert_allclose(alignment.chunked(moved, pose, first=first, frames=3), pose, atol=1e-9)
    assert np.abs(alignment.chunked(moved, pose, first=False, frames=6) - pose).max() > 0.1
    assert np.abs(alignment.chunked(moved, pose, first=False, with_scale=False, frames=3) - pose).max() > 0.1


def test_first_frame_aligned_takes_out_heading_and_place_but_no_drift() -> None:
    rng = np.random.default_rng(5)
    truth = rng.normal(size=(4, 12, 3))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = truth @ turn.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(alignment.first_frame_aligned(moved, truth), truth, atol=1e-12)
    moved[3] += 0.1 * turn[:, 0]  # (1, 0, 0) in the truth's axes
    off = alignment.first_frame_aligned(moved, truth) - truth
    np.testing.assert_allclose(off[3], np.tile([0.1, 0.0, 0.0], (12, 1)), atol=1e-12)
    moved[0, 0] = np.nan
    assert np.isnan(alignment.first_frame_aligned(moved, truth)).all()
