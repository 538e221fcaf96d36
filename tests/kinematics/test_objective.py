"""The gradient of the whole kinematic objective, and that its check catches a wrong one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import prior
from simrecon.body import primitives
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import objective as objectives
from simrecon.kinematics.conditioning import Conditioning, by_frame, condition
from simrecon.kinematics.contacts import contact_points, pulls
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.objective import Objective, Observations
from simrecon.kinematics.variables import Variables, leans
from simrecon.plan import Kinematics
from simrecon.types import Array, Ground, Scene, SceneItem

T = 4
LENGTHS = len(bodies.length_names())
LEANS = leans(T, 1 / 30).shape[1]
SWITCHES = ("shape", "poses", "ground", "temporal", "seed_frames")
SCALES = (*SWITCHES, "keypoint_scale_px", "joint_scale_m", "place_scale_m", "prior_model", "evaluations")
WEIGHTS = tuple(field.name for field in fields(Kinematics) if field.name not in SCALES)
BOX = SceneItem("step", "box", (0.25, 0.1, 0.0), {"size_m": (0.4, 0.8, 0.12)}, yaw_rad=0.3)


@pytest.fixture(scope="module")
def objective(make, weights) -> Objective:
    """Every term counts: feet within the floor and a box, joints beyond their limits, noise on everything."""
    rng = np.random.default_rng(7)
    walk = make.walking(T)
    skeleton, count = walk.skeleton, len(walk.skeleton.point_names)
    camera = make.looking_at(np.array([4.0, -1.0, 1.5]), np.array([0.0, 0.0, 1.0]))
    rays = cameras.undistort(camera.lens, cameras.project(camera, walk.points_m))
    roots = np.zeros(count)
    roots[[skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]] = 0.5
    gaussian = prior.gaussian(skeleton)
    see = Observations(
        interval_s=1 / 30,
        rays=rays + rng.normal(scale=0.02, size=rays.shape),
        ray_weights=rng.uniform(0, 1, (count, T)),
        ray_sigma=0.01,
        world_to_camera=cameras.extrinsics(cameras.lasting(camera, T)),
        joints_m=walk.points_m - walk.root_m + rng.normal(scale=0.05, size=walk.points_m.shape),
        joint_weights=rng.integers(0, 2, (count, T)).astype(float),
        place_m=walk.root_m + 0.1,
        place_weights=np.array([1.0, 0.0, 1.0, 1.0]),
        root_weights=roots,
        standing=rng.uniform(0, 1, (2, T)),
        sitting=rng.uniform(0, 1, T),
        scale_sigma=0.1,
        neutral=gaussian.mean_rad,
        spread=gaussian.spread_rad,
        prior=gaussian,
    )
    base = np.broadcast_to(rotations.matrix(rotations.exp(np.array([0.1, 0.0, 0.4]))), (T, 3, 3))
    touch = contact_points(skeleton, primitives.make(skeleton, 1.75, 70.0, 0.0))
    return Objective(skeleton, touch, Scene(Ground(0.02), (BOX,)), base, see, weights)


@pytest.fixture(scope="module")
def point(make) -> Array:
    """Somewhere near the walk."""
    rng = np.random.default_rng(8)
    walk = make.walking(T)
    rotvecs = walk.rotvecs + rng.normal(scale=0.2, size=walk.rotvecs.shape)
    rotvecs[walk.skeleton.names.index("left_elbow"), :, 2] += 2.0
    root = walk.root_m + np.array([0.0, 0.0, -0.03]) + rng.normal(scale=0.02, size=walk.root_m.shape)
    lengths, lean = rng.normal(scale=0.03, size=LENGTHS), rng.normal(scale=0.1, size=(LEANS, 3))
    return Variables(root, rotvecs, 0.07, 0.012, lengths, lean).pack()


def conditioned(objective: Objective, point: Array) -> Conditioning:
    return condition(curvature(objective, Variables.unpack(point, T, LENGTHS)))


def error(function: Callable[[Array], tuple[float, Array]], x: Array) -> float:
    """Largest difference from central differences, relative to the largest component of the gradient."""
    _, gradient = function(x)
    slopes = np.empty_like(x)
    for i in range(len(x)):
        step = np.zeros_like(x)
        step[i] = 1e-6
        slopes[i] = (function(x + step)[0] - function(x - step)[0]) / 2e-6
    return float(np.abs(gradient - slopes).max() / np.abs(slopes).max())


def test_the_gradient_is_that_of_finite_differences(objective: Objective, point: Array) -> None:
    assert error(objective, point) < 1e-6


def only(objective: Objective, name: str) -> Objective:
    """The objective with one weight of one and no other."""
    weights = replace(objective.weights, **{key: float(key == name) for key in WEIGHTS})
    see = objective.observations
    return Objective(objective.skeleton, objective.contacts, objective.scene, objective.base, see, weights)


@pytest.mark.parametrize("name", WEIGHTS)
def test_the_gradient_of_each_term_is_too(objective: Objective, point: Array, name: str) -> None:
    alone = only(objective, name)
    alone(point)
    assert alone.terms[name] > 1e-6
    shared = sum(alone.terms.pop(key) for key in ("shared", "lengths", "lean"))
    assert {key for key, value in alone.terms.items() if value} == {name}
    assert alone(point)[0] == pytest.approx(alone.terms[name] + shared)
    assert error(alone, point) < 1e-6


def test_the_gradient_by_the_learned_prior_is_too(objective: Objective, point: Array) -> None:
    alone = only(objective, "prior")
    see = replace(alone.observations, prior=prior.flow())
    learned = Objective(alone.skeleton, alone.contacts, alone.scene, alone.base, see, alone.weights)
    assert learned(point)[0] != pytest.approx(alone(point)[0])
    assert error(learned, point) < 1e-6


@pytest.mark.parametrize(
    "index",
    [0, 40, 54 * T, 54 * T + 1, 54 * T + 2, -1],
    ids=["root", "rotation", "scale", "sole", "length", "lean"],
)
def test_the_check_catches_a_wrong_gradient(objective: Objective, point: Array, index: int) -> None:
    def wrong(x: Array) -> tuple[float, Array]:
        loss, gradient = objective(x)
        largest = np.abs(gradient).max()
        gradient[index] += 1e-5 * largest
        return loss, gradient

    assert error(wrong, point) > 5e-6


def test_the_check_catches_a_wrong_term(objective: Objective, point: Array) -> None:
    def wrong(x: Array) -> tuple[float, Array]:
        return objective(x)[0], objective(x)[1] - only(objective, "contact")(x)[1]

    assert error(wrong, point) > 1e-4


def test_a_missing_part_of_the_evidence_is_no_term(objective: Objective, point: Array) -> None:
    see = replace(
        objective.observations,
        world_to_camera=None,
        joint_weights=np.zeros_like(objective.observations.joint_weights),
    )
    blind = Objective(
        objective.skeleton, objective.contacts, objective.scene, objective.base, see, objective.weights
    )
    loss, gradient = blind(point)
    assert {"keypoint", "joint", "place"}.isdisjoint(blind.terms)
    assert np.isfinite(loss)
    assert np.isfinite(gradient).all()


def test_variables_survive_packing(rng: np.random.Generator) -> None:
    places, turns = rng.normal(size=(T, 3)), rng.normal(size=(17, T, 3))
    variables = Variables(places, turns, 0.1, -0.02, rng.normal(size=LENGTHS), rng.normal(size=(LEANS, 3)))
    again = Variables.unpack(variables.pack(), T, LENGTHS)
    np.testing.assert_array_equal(again.root_m, variables.root_m)
    np.testing.assert_array_equal(again.rotvecs, variables.rotvecs)
    np.testing.assert_array_equal(again.lengths, variables.lengths)
    np.testing.assert_array_equal(again.lean, variables.lean)
    assert (again.log_scale, again.sole_m) == (0.1, -0.02)


def test_contact_points_are_those_of_the_primitives(objective: Objective) -> None:
    touch = objective.contacts
    assert touch.mass_share.sum() == pytest.approx(1.0)
    assert len(touch.segments) == 22 * 2 + 4 * 8
    for side, rows in zip(("left", "right"), touch.soles, strict=True):
        ankle = objective.skeleton.names.index(f"{side}_ankle")
        assert (touch.segments[rows] == ankle).all()
        feet = touch.segments == ankle
        corners = touch.offsets_m[feet & (touch.radii_m == 0)]
        np.testing.assert_allclose(touch.offsets_m[rows, 2], corners[:, 2].min())
        assert len({tuple(place) for place in touch.offsets_m[rows]}) == 4
        np.testing.assert_array_equal(touch.drop[rows], np.tile([0.0, 0.0, -1.0], (4, 1)))


def test_both_buttocks_of_hips_at_rest_are_held_to_a_seat(objective: Objective) -> None:
    touch = objective.contacts
    for side, rows in zip(("left", "right"), touch.seat, strict=True):
        assert (touch.segments[rows] == objective.skeleton.names.index("pelvis")).all()
        assert ((touch.offsets_m[rows, 1] > 0) == (side == "left")).all()
    clearance = np.full((2, len(touch.segments), T), 0.5)
    clearance[1, touch.seat[:, 1]] = 0.03  # over the second thing
    see = replace(objective.observations, sitting=np.array([1.0, 0.5, 0.0, 0.0]))
    for pull, rows in zip(pulls(touch, see.standing, see.sitting, clearance)[-2:], touch.seat, strict=True):
        thing, point, frame = pull.at
        assert (thing == 1).all()
        assert (point == rows[1]).all()
        np.testing.assert_array_equal(frame, np.arange(T))
        np.testing.assert_array_equal(pull.weights, see.sitting)
    # over the ground alone they are not
    assert len(pulls(touch, see.standing, see.sitting, clearance[:1])) == 2


def test_hips_at_rest_on_a_seat_need_no_balance_over_the_feet(objective: Objective, point: Array) -> None:
    """The pelvis of the fixture is half a metre over the step; a block of that height is a seat."""
    pelvis = Variables.unpack(point, T, LENGTHS).root_m.mean(axis=0)
    size = (1.0, 1.0, float(pelvis[2]) - 0.1)
    seat = SceneItem("seat", "box", (float(pelvis[0]), float(pelvis[1]), 0.0), {"size_m": size})

    def balance(sitting: float) -> float:
        made = only(objective, "balance")
        made.scene = replace(made.scene, items=(seat,))
        made.observations = replace(made.observations, sitting=np.full(T, sitting))
        assert error(made, point) < 1e-6
        return made.terms["balance"]

    assert balance(1.0) < 0.3 * balance(0.0)


def test_the_curvature_is_that_of_the_quadratic_terms(objective: Objective, point: Array) -> None:
    """Along random directions of places and of the lean, in which the loss is a sum of squares."""
    quadratic = {"smooth_com", "smooth_position", "smooth_rotation", "prior"}
    weights = replace(objective.weights, **{key: float(key in quadratic) for key in WEIGHTS})
    see = replace(objective.observations, joint_weights=np.zeros_like(objective.observations.joint_weights))
    smooth = Objective(objective.skeleton, objective.contacts, objective.scene, objective.base, see, weights)
    (found,) = curvature(smooth, Variables.unpack(point, T, LENGTHS))
    rng = np.random.default_rng(12)
    for rows in (slice(0, 3 * T), slice(54 * T + 2 + LENGTHS, None)):
        step = np.zeros_like(point)
        step[rows] = rng.normal(size=len(point[rows]))
        slope = (smooth(point + 1e-5 * step)[1] - smooth(point - 1e-5 * step)[1]) @ step / 2e-5
        own, shared = by_frame(step, 54 * T)
        own = own.reshape(T, 54)
        bent = 2 * np.einsum("ti,tij,j->", own, found.wide(), shared) + shared @ found.corner @ shared
        for k, block in enumerate(found.blocks):
            bent += (2 if k else 1) * np.einsum("ti,tij,tj->", own[k:], block, own[: T - k])
        assert bent == pytest.approx(slope, rel=0.02)


def test_conditioning_is_an_invertible_change_of_variables(objective: Objective, point: Array) -> None:
    rng = np.random.default_rng(9)
    better = conditioned(objective, point)
    np.testing.assert_allclose(better.to_variables(better.from_variables(point)), point, atol=1e-10)
    u, g = rng.normal(size=(2, len(point)))
    np.testing.assert_allclose(better.from_variables(better.to_variables(u)), u, atol=1e-8)
    # linear, and the gradient's map is its transpose: ⟨A u, g⟩ = ⟨u, Aᵀ g⟩
    np.testing.assert_allclose(
        better.to_variables(u) + better.to_variables(2 * g), better.to_variables(u + 2 * g), atol=1e-9
    )
    assert better.to_variables(u) @ g == pytest.approx(u @ better.gradient(g))


def test_conditioning_keeps_the_gradient_right(objective: Objective, point: Array) -> None:
    better = conditioned(objective, point)

    def scaled(u: Array) -> tuple[float, Array]:
        loss, gradient = objective(better.to_variables(u))
        return loss, better.gradient(gradient)

    u, rng = better.from_variables(point), np.random.default_rng(10)
    gradient = scaled(u)[1]
    for _ in range(20):
        step = 1e-5 * rng.normal(size=len(u))
        slope = (scaled(u + step)[0] - scaled(u - step)[0]) / 2
        assert gradient @ step == pytest.approx(slope, rel=1e-4, abs=1e-7)


def test_conditioning_makes_curvatures_alike(objective: Objective, point: Array) -> None:
    """By a random direction in each kind of variable: without it they differ by many orders of magnitude."""
    better, rng = conditioned(objective, point), np.random.default_rng(11)

    def curvature(function: Callable[[Array], float], x: Array, rows: slice, size: float) -> float:
        step = np.zeros_like(x)
        step[rows] = rng.normal(size=len(x[rows]))
        step *= size / np.linalg.norm(step)
        return abs(function(x + step) + function(x - step) - 2 * function(x)) / size**2

    kinds = (slice(0, 3 * T), slice(3 * T, 54 * T), slice(54 * T, 54 * T + 1), slice(54 * T + 1, 54 * T + 2))
    u = better.from_variables(point)
    raw = [curvature(lambda x: objective(x)[0], point, rows, 1e-4) for rows in kinds]
    new = [curvature(lambda x: objective(better.to_variables(x))[0], u, rows, 1e-2) for rows in kinds]
    assert max(new) / min(new) < max(raw) / min(raw)


def repeated(objective: Objective, point: Array, rows: Array) -> tuple[Objective, Array]:
    """The objective of some frames again and again, and a point of it."""
    short, see = Variables.unpack(point, T, LENGTHS), objective.observations.part(rows)
    base, weights = objective.base[rows], objective.weights
    long = Objective(objective.skeleton, objective.contacts, objective.scene, base, see, weights)
    rng = np.random.default_rng(14)
    lean = rng.normal(scale=0.1, size=(long.leans.shape[1], 3))
    return long, replace(short.part(rows), lean=lean).pack()


@pytest.mark.parametrize("frames", [9, 11, 12, 13, 14])
def test_a_clip_in_blocks_is_the_clip_as_a_whole(objective, point, monkeypatch, frames: int) -> None:
    long, x = repeated(objective, point, np.arange(frames) % T)
    loss, gradient = long(x)
    terms = long.terms
    monkeypatch.setattr(objectives, "BLOCK", 4)
    again, slope = long(x)
    assert again == pytest.approx(loss, rel=1e-12)
    np.testing.assert_allclose(slope, gradient, rtol=0, atol=1e-10 * np.abs(gradient).max())
    assert long.terms == pytest.approx(terms)
    # three frames in a row count once, and no more than three belong together
    monkeypatch.setattr(objectives, "OVERLAP", 1)
    assert abs(long(x)[0] - loss) > 1e-3 * loss


@pytest.mark.parametrize("frames", [9, 12, 14])
def test_a_curvature_in_blocks_is_that_of_the_whole(objective, point, monkeypatch, frames: int) -> None:
    long, x = repeated(objective, point, np.arange(frames) % T)
    variables = Variables.unpack(x, frames, LENGTHS)
    (whole,) = curvature(long, variables)
    better = condition([whole])
    monkeypatch.setattr("simrecon.kinematics.curvature.BLOCK", 4)
    parts = list(curvature(long, variables))
    assert len(parts) == -(-frames // 4)
    for k, block in enumerate(whole.blocks):
        found = np.concatenate([part.blocks[k] for part in parts])
        np.testing.assert_allclose(found, block, rtol=0, atol=1e-9 * np.abs(block).max())
    wide = np.concatenate([part.wide() for part in parts])
    np.testing.assert_allclose(wide, whole.wide(), rtol=0, atol=1e-9 * np.abs(wide).max())
    corner = sum(part.corner for part in parts)
    np.testing.assert_allclose(corner, whole.corner, rtol=0, atol=1e-9 * np.abs(corner).max())
    again = condition(parts)
    for name in ("to_variables", "from_variables", "gradient"):
        one, other = (getattr(found, name)(x) for found in (better, again))
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-4 * np.abs(one).max())


def test_the_factor_is_that_of_the_hessian(objective: Objective, point: Array) -> None:
    """M Mᵀ is H, but for the digits that L lacks and the damping."""
    (part,) = curvature(objective, Variables.unpack(point, T, LENGTHS))
    own, count = 54 * T, len(part.corner)
    hessian = np.zeros((own + count, own + count))
    for k, block in enumerate(part.blocks):
        for t, values in enumerate(block):
            row, column = slice(54 * (t + k), 54 * (t + k + 1)), slice(54 * t, 54 * (t + 1))
            hessian[row, column] = values
            hessian[column, row] = values.T
    hessian[:own, own:] = part.wide().reshape(own, -1)
    hessian[own:, :own] = hessian[:own, own:].T
    hessian[own:, own:] = part.corner
    better, eye = condition([part]), np.eye(own + count)
    order = by_frame(np.arange(own + count, dtype=float), own)
    packed = np.concatenate(order).astype(int)  # where the unknowns of frame after frame are packed
    across = np.stack([better.from_variables(row[np.argsort(packed)]) for row in eye])  # Mᵀ by columns
    np.testing.assert_allclose(across @ across.T, hessian, rtol=0, atol=1e-5 * np.abs(hessian).max())


def test_long_clips_have_no_more_leans_than_short_ones() -> None:
    ten_minutes = leans(18_000, 1 / 30)
    assert ten_minutes.shape[1] == leans(600, 1 / 30).shape[1] < 40
    np.testing.assert_allclose(np.sqrt((ten_minutes**2).mean(axis=0)), 1.0, rtol=1e-6)
