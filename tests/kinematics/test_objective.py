"""The gradient of the whole kinematic objective, and that its check catches a wrong one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.kinematics import layout, terms
from simrecon.kinematics import objective as objectives
from simrecon.kinematics.layout import FREE
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.types import Array
from tests.kinematics.conftest import Repeated
from tests.support.gradients import error


def test_the_gradient_is_that_of_finite_differences(problem: Problem, point: Array) -> None:
    assert error(Objective(problem), point) < 1e-6


@pytest.mark.parametrize(
    ("shared", "index"),
    [
        (False, 0),
        (False, 40),
        (True, layout.LOG_SCALE),
        (True, layout.SOLE),
        (True, layout.LENGTHS),
        (True, -1),
    ],
    ids=["root", "rotation", "scale", "sole", "length", "lean"],
)
def test_the_check_catches_a_wrong_gradient(problem: Problem, point: Array, shared: bool, index: int) -> None:
    objective = Objective(problem)

    def wrong(x: Array) -> tuple[float, Array]:
        loss, gradient = objective(x)
        largest = np.abs(gradient).max()
        part = gradient[FREE * problem.frames :] if shared else gradient  # views
        part[index] += 1e-5 * largest
        return loss, gradient

    assert error(wrong, point) > 5e-6


def test_the_check_catches_a_wrong_term(problem: Problem, point: Array) -> None:
    objective = Objective(problem)
    contact = Objective(replace(problem, plan=terms.only(problem.plan, ("contact",))))

    def wrong(x: Array) -> tuple[float, Array]:
        return objective(x)[0], objective(x)[1] - contact(x)[1]

    assert error(wrong, point) > 1e-4


def test_the_loss_is_the_sum_of_the_terms(problem: Problem, point: Array) -> None:
    objective = Objective(problem)
    loss, _ = objective(point)
    known = (term for term in terms.TERMS if term.applies(problem))  # nothing is wished for
    assert tuple(objective.losses) == tuple(term.name for term in known)
    assert loss == sum(objective.losses.values())


def test_a_missing_part_of_the_evidence_is_no_term(problem: Problem, point: Array) -> None:
    see = replace(
        problem.observations,
        world_to_camera=None,
        joint_weights=np.zeros_like(problem.observations.joint_weights),
    )
    blind = Objective(replace(problem, observations=see))
    loss, gradient = blind(point)
    assert {"keypoint", "joint", "place"}.isdisjoint(blind.losses)
    assert np.isfinite(loss)
    assert np.isfinite(gradient).all()


@pytest.mark.parametrize("frames", [9, 11, 12, 13, 14])
def test_a_clip_in_blocks_is_the_clip_as_a_whole(
    repeated: Repeated, monkeypatch: pytest.MonkeyPatch, frames: int
) -> None:
    long, x = repeated(frames)
    whole, blocks = Objective(long), Objective(long)
    loss, gradient = whole(x)
    monkeypatch.setattr(objectives, "BLOCK", 4)
    again, slope = blocks(x)
    assert again == pytest.approx(loss, rel=1e-12)
    np.testing.assert_allclose(slope, gradient, rtol=0, atol=1e-10 * np.abs(gradient).max())
    assert blocks.losses == pytest.approx(whole.losses)
    # three frames in a row count once, and no more than three belong together
    monkeypatch.setattr(objectives, "OVERLAP", 1)
    assert abs(blocks(x)[0] - loss) > 1e-3 * loss
