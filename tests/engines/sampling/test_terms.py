"""Loss terms: values that can be worked out by hand, and vectors that have the gradient of the value."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon.engines.borne import Borne as BorneForces
from simrecon.engines.problem import Problem
from simrecon.engines.sampling import terms
from simrecon.engines.sampling.terms import LossTerm, Seen, Targets
from simrecon.engines.sampling.terms.borne import Borne
from simrecon.engines.sampling.terms.centre import ComPosition, ComVelocity
from simrecon.engines.sampling.terms.force import Force, Moment
from simrecon.engines.sampling.terms.landmarks import Landmark, LandmarkVelocity, Reprojection, TotalVariation
from simrecon.engines.sampling.terms.planted import Planted
from simrecon.engines.sampling.terms.pose import JointLimit, Pose, Prior
from simrecon.engines.sampling.terms.wished import Wished
from simrecon.engines.wished import Wished as WishedPlaces
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.optim import gauss_newton
from simrecon.plan import LossWeights
from simrecon.types import Array, IntArray
from tests.engines.conftest import Makers
from tests.support.residuals import residuals

LIMITS = np.tile([-0.5, 0.4], (16, 3, 1))
CAMERA = np.eye(4)
CAMERA[2, 3] = 3.0
NOTHING = np.zeros(1)
NOWHERE = Targets(NOTHING, NOTHING, NOTHING, NOTHING, NOTHING, NOTHING, None)
"""Targets of a term that looks at none."""
UNFELT = np.zeros((1, 1, 0, 6))
"""Of rollouts of which no body is felt."""


class Code:
    """A prior whose latent code is the first joint's vector part."""

    def latent(self, joints: Array) -> Array:
        return joints[..., 0, 1:]

    def slope(self, rotvecs: Array) -> Array:
        raise NotImplementedError("the loss of a rollout needs the code alone")

    def squared(self, rotvecs: Array) -> tuple[Array, Array]:
        raise NotImplementedError("the loss of a rollout needs the code alone")


def seen(
    com: Array = NOWHERE.com_m, points: Array = NOWHERE.points_m, turns: Array = NOWHERE.orientations
) -> Seen:
    """One rollout, and as its targets zeros and the identity."""
    com, points, turns = (np.asarray(array, float)[None] for array in (com, points, turns))
    identity = np.zeros_like(turns[0])
    identity[..., 0] = 1.0
    targets = replace(NOWHERE, com_m=0 * com[0], points_m=0 * points[0], orientations=identity)
    return Seen(com, points, turns, targets, UNFELT)


def viewed(points: Array, rays: Array, scores: Array, camera: Array) -> Seen:
    """One rollout before a camera."""
    targets = replace(
        NOWHERE, rays=rays, scores=scores, world_to_camera=np.broadcast_to(camera, (len(rays), 4, 4))
    )
    return Seen(NOWHERE.com_m[None], points[None], NOWHERE.orientations[None], targets, UNFELT)


def test_com_position_sums_squares_over_frames() -> None:
    com = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 2.0], [0.0, 3.0, 0.0]])
    assert ComPosition(1.0).value(seen(com)) == pytest.approx(9.0 + 9.0)


def test_com_velocity_is_of_differences_per_second() -> None:
    com = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.2]])
    # 1 m/s along x, then 2 m/s along z; a constant offset has no velocity
    assert ComVelocity(1.0, 0.1).value(seen(com + np.array([5.0, 0.0, 0.0]))) == pytest.approx(1.0 + 4.0)


def test_pose_sums_half_the_angles() -> None:
    angles = np.array([[0.0, 0.4], [1.0, 3.0]])  # (F, 2)
    turned = rotations.exp(angles[..., None] * [0.6, 0.0, 0.8])
    # eq. 2 takes arccos of the quaternions' product, which is half of the angle of rotation
    assert Pose(1.0).value(seen(turns=turned)) == pytest.approx(angles.sum() / 2)
    assert Pose(1.0).value(seen(turns=-turned)) == pytest.approx(angles.sum() / 2)


def test_pose_bears_rounding() -> None:
    unit = np.zeros((1, 1, 4))
    unit[..., 0] = 1 + 1e-15
    assert np.isfinite(Pose(1.0).value(seen(turns=unit)))


def test_reprojection_is_a_distance_weighted_by_scores() -> None:
    points = np.array([[[0.0, 0.0, 1.0], [1.0, 2.0, -1.0]]])  # (1, 2, 3), at depths 4 and 2
    rays = np.array([[[0.3, 0.4], [0.5, 0.5]]])
    view = viewed(points, rays, np.array([[1.0, 0.5]]), CAMERA)
    assert Reprojection(1.0).value(view) == pytest.approx(0.5 + 0.5 * 0.5)


def test_reprojection_with_a_moving_camera() -> None:
    moving = np.stack([CAMERA, CAMERA])
    moving[1, 0, 3] = 3.0  # the camera's x is 3 m more: image moves by 1 at depth 3
    view = viewed(np.zeros((2, 1, 3)), np.zeros((2, 1, 2)), np.ones((2, 1)), moving)
    assert Reprojection(1.0).value(view) == pytest.approx(1.0)
    later = viewed(np.zeros((1, 1, 3)), np.zeros((1, 1, 2)), np.ones((1, 1)), moving[1:])
    assert Reprojection(1.0).value(later) == pytest.approx(1.0)


def test_points_beside_or_behind_the_camera_stay_finite() -> None:
    points = np.array([[[1.0, 0.0, -3.0], [1.0, 0.0, -9.0]]])
    view = viewed(points, np.zeros((1, 2, 2)), np.ones((1, 2)), CAMERA)
    # as if 0.1 m in front
    assert Reprojection(1.0).value(view) == pytest.approx(20.0)


def test_reprojection_without_a_camera_is_an_error() -> None:
    with pytest.raises(ValueError, match="world_to_camera"):
        Reprojection(1.0).value(seen())


def test_prior_is_a_length_by_frame() -> None:
    turns = np.zeros((3, 17, 4))
    turns[:, 1, 1:] = [[3.0, 4.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 7.0]]
    every = Prior(1.0, Code(), np.arange(3), 1.0)
    assert every.value(seen(turns=turns)) == pytest.approx(5.0 + 2.0 + 7.0)
    some = Prior(1.0, Code(), np.array([0, 2]), 1.5)
    assert some.value(seen(turns=turns)) == pytest.approx(1.5 * (5.0 + 7.0))


def test_total_variation_is_of_accelerations() -> None:
    frames = np.arange(6.0)
    steady = np.stack((frames**2, 2 * frames, 1 + 0 * frames), axis=-1)[:, None]  # (F, 1, 3)
    term = TotalVariation(1.0, np.array([0, 1]))
    jerky = steady.repeat(3, axis=1)  # (F, 3, 3)
    np.testing.assert_allclose(term.value(seen(points=jerky)), 0.0, atol=1e-12)
    jerky[:, 0, 2] += frames**3
    jerky[:, 2] *= frames[:, None] ** 4  # is no joint
    # third differences of t³ are 6, at three places, on one of two joints
    assert term.value(seen(points=jerky)) == pytest.approx(3 * 6.0 / 2)


def test_joint_limit_grows_exponentially_outside_the_range() -> None:
    term, rotvecs = JointLimit(1.0, LIMITS), np.zeros((2, 17, 3))
    rotvecs[:, 0, 0] = 3.0  # the base has no range
    rotvecs[0, 4] = [0.4, 0.1, -0.5]
    assert term.value(seen(turns=rotations.exp(rotvecs))) == pytest.approx(0.0, abs=1e-12)
    rotvecs[0, 4], rotvecs[1, 6, 2] = [0.5, 0.0, 0.0], -0.7
    assert term.value(seen(turns=rotations.exp(rotvecs))) == pytest.approx(math.e - 1 + math.e**2 - 1)


def test_the_penalty_of_a_joint_limit_stays_finite() -> None:
    far = np.tile([0.0, -1e3], (16, 3, 1))
    assert np.isfinite(JointLimit(1.0, far).value(seen(turns=rotations.exp(np.zeros((1, 17, 3))))))


def test_landmark_sums_squares() -> None:
    points = np.zeros((2, 3, 3))
    points[0, 1], points[1, 2] = [1.0, 2.0, 2.0], [0.0, 0.0, 1.0]
    assert Landmark(1.0, np.ones(3)).value(seen(points=points)) == pytest.approx(10.0)
    assert Landmark(1.0, np.array([1.0, 2.0, 3.0])).value(seen(points=points)) == pytest.approx(21.0)


def test_landmark_velocity_is_that_of_the_distance() -> None:
    points = np.zeros((3, 2, 3))
    points[:, 1, 0] = [0.0, 0.1, 0.3]  # 1 and 2 m/s
    term = LandmarkVelocity(1.0, np.array([9.0, 0.5]), 0.1)
    assert term.value(seen(points=points)) == pytest.approx(2.5)
    assert term.value(seen(points=points + 7.0)) == pytest.approx(2.5)


def test_planted_is_the_velocity_of_what_stands_at_both_frames() -> None:
    points = np.zeros((4, 3, 3))
    points[:, 1, 0] = [0.0, 0.1, 0.3, 0.3]  # 1, 2 and 0 m/s
    points[:, 2, 2] = [0.0, 0.0, 0.0, 0.3]  # 3 m/s at last, of a point that stands until then
    rollout = seen(points=points)
    planted = np.array([[0.0, 0.5, 1.0], [0.0, 0.5, 1.0], [0.0, 0.25, 1.0], [0.0, 0.25, 0.0]])
    standing = replace(rollout, targets=replace(rollout.targets, planted=planted))
    assert Planted(1.0, np.array([1, 2]), 0.1).value(standing) == pytest.approx(0.5 * 1.0 + 0.25 * 4.0)


def test_wished_is_how_far_points_are_from_where_they_are_wanted() -> None:
    points = np.zeros((3, 2, 3))
    points[1, 1], points[2, 1] = [0.0, 0.0, 2.0], [5.0, 0.0, 0.0]
    wanted = WishedPlaces(np.zeros((3, 2, 3)), np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 0.0]]))
    rollout = seen(points=points)
    wished = replace(rollout, targets=replace(rollout.targets, wished=wanted))
    assert Wished(1.0, np.array([1])).value(wished) == pytest.approx(4.0)


def test_a_term_without_wishes_is_left_out(make: type[Makers]) -> None:
    plain = make.clip(make.settings(wished=1.0, landmark=1.0))
    assert "wished" not in [term.name for term in terms.of_window(plain, 9)]


def test_force_is_in_body_weights_and_knows_each_foot() -> None:
    rollout = seen(com=np.zeros((2, 3)))
    felt, planned = np.zeros((1, 2, 2, 6)), np.zeros((2, 2, 6))
    felt[0, 1, 0, 3:] = [0.0, 50.0, 300.0]
    planned[1, 1, 5] = 300.0  # the other foot bears it
    planned[:, :, :3] = 7.0  # moments do not count
    standing = replace(rollout, wrenches=felt, targets=replace(rollout.targets, wrenches=planned))
    assert Force(1.0, 100.0).value(standing) == pytest.approx(0.25 + 9.0 + 9.0)


def test_what_is_borne_is_force_and_moment_about_where_it_is_planned() -> None:
    felt, planned = np.zeros((1, 2, 2, 6)), np.zeros((2, 1, 6))
    place = np.array([1.0, 2.0, 3.0])
    force, aside = np.array([0.0, 0.0, 50.0]), np.array([0.0, 0.02, 0.0])
    felt[0, :, 1] = np.concatenate((np.cross(place + aside, force), force))
    planned[:, 0] = np.concatenate((np.cross(place, 2 * force), 2 * force))
    borne = BorneForces(("right_ankle",), planned, np.tile(place, (2, 1, 1)), np.array([[0.0], [1.0]]))
    rollout = seen(com=np.zeros((2, 3)))
    sitting = replace(rollout, wrenches=felt, targets=replace(rollout.targets, borne=borne))
    # half a body weight is missing, and what there is acts 2 cm aside, a fifth of the lever
    assert Borne(1.0, np.array([1]), 100.0).value(sitting) == pytest.approx(0.5**2 + (0.5 * 0.2) ** 2)


def test_moments_are_about_the_middle_of_each_foot() -> None:
    points = np.zeros((2, 4, 3))
    points[:, :2, 1], points[:, 2:, 1] = 0.1, -0.1  # heel and toe of the left foot, then of the right
    points[:, 1::2, 0] = 0.2
    rollout = seen(com=np.zeros((2, 3)))
    planned = np.zeros((2, 2, 6))
    planned[1, 0, :3] = np.cross([0.1, 0.1, 0.0], [0.0, 0.0, 300.0])  # 300 N under the middle
    planned[1, 0, 5] = 300.0
    term = Moment(1.0, 20.0, np.array([[0, 1], [2, 3]]))
    targets = replace(rollout.targets, points_m=points, wrenches=planned)

    def borne(place: tuple[float, float, float], newton: float) -> float:
        felt = np.zeros((1, 2, 2, 6))
        felt[0, 1, 0] = [*np.cross(place, [0.0, 0.0, newton]), 0.0, 0.0, newton]
        return float(term.value(replace(rollout, wrenches=felt, targets=targets))[0])

    assert borne((0.1, 0.1, 0.0), 300.0) == pytest.approx(0.0)
    assert borne((0.1, 0.1, 0.0), 100.0) == pytest.approx(0.0)  # less, but there
    assert borne((0.2, 0.1, 0.0), 300.0) == pytest.approx((300.0 * 0.1 / 20.0) ** 2)  # at the toe


def test_planned_forces_are_means_since_the_frame_before(problem: Problem) -> None:
    pushed = np.zeros((len(problem.com_m), 2, 6))
    pushed[:, 0, 5] = np.arange(len(pushed)) ** 2
    found = Targets.at(replace(problem, pushed=pushed), np.array([0, 2, 3])).wrenches
    assert found is not None
    # by the trapezoidal rule (0 + 1) / 2 and (1 + 4) / 2, over two intervals; then (4 + 9) / 2
    np.testing.assert_allclose(found[:, 0, 5], [0.0, 1.5, 6.5])
    assert not found[:, 1].any()


# All terms together, on a clip of a person who sways before a camera.


@pytest.fixture(scope="module")
def problem(make: type[Makers]) -> Problem:
    weights = {term.name: 0.5 + 0.1 * number for number, term in enumerate(terms.TERMS)}
    fit = make.standing(make.camera)
    problem = make.clip(make.settings(**weights, prior_rate_hz=15.0), fit)
    rng = np.random.default_rng(4)
    scores = rng.uniform(0.2, 1.0, problem.scores.shape)
    planted = rng.uniform(0.2, 1.0, problem.planted.shape)
    # ranges below what is seen, for most joints
    limits = np.stack((problem.limits_rad[..., 0] - 9.0, np.full((16, 3), -0.4)), axis=-1)
    wished = WishedPlaces(problem.points_m + 0.02, rng.uniform(0.2, 1.0, problem.planted.shape))
    pushed = rng.uniform(0.0, 300.0, (len(planted), 2, 6))
    on = (rng.uniform(0.0, 300.0, (len(planted), 1, 6)), rng.normal(size=(len(planted), 1, 3)))
    borne = BorneForces(("right_ankle",), *on, rng.uniform(0.2, 1.0, (len(planted), 1)))
    bare = replace(problem, scores=scores, planted=planted, limits_rad=limits)
    return replace(bare, wished=wished, pushed=pushed, borne=borne)


@pytest.fixture(scope="module")
def frames(problem: Problem) -> IntArray:
    return np.arange(len(problem.com_m))


def near(problem: Problem, frames: IntArray, scale: float, count: int = 3) -> Seen:
    """Rollouts a little off their targets, the same ones for the same scale."""
    rng, targets = np.random.default_rng(5), Targets.at(problem, frames)
    assert targets.wrenches is not None
    turns = rotations.exp(scale * rng.normal(size=(count, len(frames), 17, 3)))
    return Seen(
        targets.com_m + scale * rng.normal(size=(count, *targets.com_m.shape)),
        targets.points_m + scale * rng.normal(size=(count, *targets.points_m.shape)),
        rotations.multiply(targets.orientations, turns),
        targets,
        targets.wrenches + 1e3 * scale * rng.normal(size=(count, len(frames), 2, 6)),
    )


def rows(view: Seen, row: int) -> Seen:
    return replace(
        view,
        com_m=view.com_m[row : row + 1],
        points_m=view.points_m[row : row + 1],
        orientations=view.orientations[row : row + 1],
        wrenches=view.wrenches[row : row + 1],
    )


def slopes(
    value: Callable[[Seen], Array],
    vectors: Callable[[Seen], gauss_newton.Term],
    problem: Problem,
    frames: IntArray,
) -> tuple[Array, Array]:
    """Slopes of a value, and of the squares that stand for it, on the way from one rollout to others.

    The squares are those without a floor, below which their gradient is not that of the value.
    """
    here, step = near(problem, frames, 0.05, 1), 1e-5
    rng = np.random.default_rng(8)
    pushes = [rng.normal(size=(6, *array.shape[1:])) for array in (here.com_m, here.points_m)]
    turns = rng.normal(size=(6, len(frames), 17, 3))
    wrenches = 1e3 * rng.normal(size=(6, len(frames), 2, 6))

    def moved(by: float) -> Seen:
        return replace(
            here,
            com_m=here.com_m + by * pushes[0],
            points_m=here.points_m + by * pushes[1],
            orientations=rotations.multiply(here.orientations, rotations.exp(by * turns)),
            wrenches=here.wrenches + by * wrenches,
        )

    roots = [replace(vectors(here), floor=1e-12).roots()]
    before, after, back = (residuals([vectors(view)], roots) for view in (here, moved(step), moved(-step)))
    squares = np.sum((after - back) / step * before, axis=(1, 2))
    return (value(moved(step)) - value(moved(-step))) / (2 * step), squares


@pytest.mark.parametrize("kind", terms.TERMS, ids=lambda kind: kind.name)
def test_the_vectors_have_the_gradient_of_the_value(
    problem: Problem, frames: IntArray, kind: type[LossTerm]
) -> None:
    term = kind.of(0.7, problem, len(frames))
    value, squares = slopes(lambda view: 0.7 * term.value(view), term.residual, problem, frames)
    assert np.abs(value).min() > 1e-3
    np.testing.assert_allclose(squares, value, rtol=1e-4, atol=1e-4 * np.abs(value).max())


def test_vectors_of_another_weight_are_told(problem: Problem, frames: IntArray) -> None:
    value, squares = slopes(ComPosition(0.7).value, ComPosition(0.8).residual, problem, frames)
    assert not np.allclose(squares, value, rtol=0.05)


@pytest.mark.parametrize("kind", terms.TERMS, ids=lambda kind: kind.name)
def test_a_term_is_plain_squares_or_robust(problem: Problem, frames: IntArray, kind: type[LossTerm]) -> None:
    term = kind.of(0.7, problem, len(frames))
    view = near(problem, frames, 0.05, 1)
    vectors = term.residual(view)
    if vectors.slope is None:
        squares = np.sum(residuals([vectors], [vectors.roots()]) ** 2)
        assert squares == pytest.approx(0.7 * term.value(view)[0])


@pytest.mark.parametrize("kind", terms.TERMS, ids=lambda kind: kind.name)
def test_a_frame_looks_at_no_more_earlier_ones_than_it_says(
    problem: Problem, frames: IntArray, kind: type[LossTerm]
) -> None:
    term, view = kind.of(0.7, problem, len(frames)), near(problem, frames, 0.05)
    changed = replace(
        view,
        com_m=np.concatenate((view.com_m[:, :4] + 1.0, view.com_m[:, 4:]), axis=1),
        points_m=np.concatenate((view.points_m[:, :4] + 1.0, view.points_m[:, 4:]), axis=1),
        orientations=np.concatenate((view.orientations[:, 4:8], view.orientations[:, 4:]), axis=1),
    )
    one, two = (term.residual(v).vectors[:, 4 - len(frames) :] for v in (view, changed))  # frames from 4 on
    same = (one == two).reshape(3, len(frames) - 4, -1).all(axis=(0, 2))
    assert same.tolist() == [False] * term.differences + [True] * (len(frames) - 4 - term.differences)


@pytest.mark.parametrize("kind", terms.TERMS, ids=lambda kind: kind.name)
def test_terms_are_batched_over_rollouts(problem: Problem, frames: IntArray, kind: type[LossTerm]) -> None:
    term, view = kind.of(1.0, problem, len(frames)), near(problem, frames, 0.1)
    value = term.value(view)
    assert value.shape == (3,)
    for row in range(3):
        assert value[row] == pytest.approx(term.value(rows(view, row))[0])


@pytest.mark.parametrize("kind", terms.TERMS, ids=lambda kind: kind.name)
def test_terms_grow_away_from_the_targets(problem: Problem, frames: IntArray, kind: type[LossTerm]) -> None:
    term = kind.of(1.0, problem, len(frames))
    # arccos keeps half of the digits near zero
    at_targets = near(problem, frames, 0.0)
    if kind in (ComPosition, ComVelocity, Pose, Landmark, LandmarkVelocity):
        assert np.abs(term.value(at_targets)).max() < 1e-5
    assert (term.value(at_targets) < term.value(near(problem, frames, 0.3))).all()


def test_every_term_has_a_weight_in_the_plan_and_every_weight_a_term(problem: Problem) -> None:
    weights = {field.name for field in dataclasses.fields(LossWeights)}
    assert weights - {term.name for term in terms.TERMS} == {"prior_model", "prior_rate_hz", "rate_hz"}
    assert {term.name for term in terms.TERMS} < weights
    on = terms.of_window(problem, 9)
    assert [term.name for term in on] == [term.name for term in terms.TERMS]
    assert [term.weight for term in on] == [getattr(problem.plan.loss, term.name) for term in on]


def without(problem: Problem, **weights: Any) -> Problem:
    return replace(problem, plan=replace(problem.plan, loss=replace(problem.plan.loss, **weights)))


def test_a_weight_of_zero_and_a_missing_camera_switch_terms_off(problem: Problem) -> None:
    changed = replace(without(problem, pose=0.0), world_to_camera=None)
    off = {term.name for term in terms.TERMS} - {term.name for term in terms.of_window(changed, 9)}
    assert off == {"pose", "reprojection"}


def test_a_plan_without_forces_switches_their_term_off(problem: Problem) -> None:
    on = {term.name for term in terms.of_window(replace(problem, pushed=None, borne=None), 9)}
    assert {term.name for term in terms.TERMS} - on == {"force", "moment", "borne"}


def test_a_loss_without_terms_is_an_error(problem: Problem) -> None:
    nothing = {term.name: 0.0 for term in terms.TERMS}
    with pytest.raises(InputError, match=r"\[loss\].*valid: com_position, "):
        terms.of_window(without(problem, **nothing), 9)
    blind = replace(without(problem, **(nothing | {"reprojection": 1.0})), world_to_camera=None)
    with pytest.raises(InputError, match=r"\[loss\]"):
        terms.of_window(blind, 9)
