"""A motion on another body: what stood stands, heights scale, and nothing changes without reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics, prior
from simrecon import plan as plans
from simrecon.body import known
from simrecon.exports import legs
from simrecon.geometry import rotations
from simrecon.kinematics import forward, layout, retargeting
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.layout import FREE
from simrecon.kinematics.supports import supports
from simrecon.plan import Kinematics
from simrecon.types import Array, Body, Ground, KinematicFit, Scene, SceneItem
from tests.kinematics.conftest import Makers
from tests.support.gradients import differences

RATE_HZ = 15.0
STEP_M = 0.3
STEP = SceneItem("step", "box", (0.0, 0.0, 0.0), {"size_m": (0.8, 0.8, STEP_M)})


def fitted(body: Body, qpos: Array, scene: Scene | None = None) -> KinematicFit:
    frames = len(qpos)
    return KinematicFit(
        body=body,
        scene=scene or Scene(),
        camera=None,
        times_s=np.arange(frames) / RATE_HZ,
        qpos=qpos,
        com_m=np.zeros((frames, 3)),
        reprojection_px=np.zeros((frames, 2)),
        interpolated=np.zeros(frames, dtype=bool),
        iterations=0,
        loss={},
    )


def squat(body: Body, floor_m: float = 0.0, frames: int = 14) -> Array:
    """Configurations (T, nq): down and up again, leaning forward, soles level on the floor, arms relaxed."""
    skeleton = body.skeleton
    depth = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(frames) / frames)
    bend = {"hip": -0.8, "knee": 1.2, "ankle": -0.6}
    joints = np.broadcast_to(rotations.exp(prior.gaussian(skeleton).mean_rad), (frames, 16, 4)).copy()
    for column, name in enumerate(skeleton.names[1:]):
        if (joint := name.split("_")[-1]) in bend:
            turn = rotations.exp(bend[joint] * depth[:, None] * [0.0, 1.0, 0.0])
            joints[:, column] = rotations.multiply(rotations.conjugate(skeleton.rest[column + 1]), turn)
    lean = rotations.exp(-sum(bend.values()) * depth[:, None] * [0.0, 1.0, 0.0])
    qpos = np.concatenate((np.zeros((frames, 3)), lean, joints.reshape(frames, -1)), axis=1)
    soles = touching_points(fitted(body, qpos))[1]
    qpos[:, :3] -= soles.mean(axis=0) - [0.0, 0.0, floor_m]
    return qpos


def touching_points(fit: KinematicFit) -> tuple[Array, Array]:
    """Lowest place (T,) of all contact points, and the corners of both soles (8, T, 3)."""
    touch = contact_points(fit.body.skeleton, fit.body.primitives)
    pose = forward.forward(fit.body.skeleton, *layout.from_qpos(fit.qpos), 1.0)
    points = forward.points(pose, touch.segments, touch.offsets_m)
    return (points[..., 2] - touch.radii_m[:, None]).min(axis=0), points[touch.soles.ravel()]


def landmarks(fit: KinematicFit) -> Array:
    return kinematics.configurations(fit.body, fit.qpos)[1]


@pytest.fixture(scope="module")
def weights() -> Kinematics:
    return replace(plans.read("default").kinematics, evaluations=400)


@pytest.fixture(scope="module")
def person() -> Body:
    return bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=73.0)


OTHERS: dict[str, Callable[[Body], Body]] = {
    "heavy_head": lambda person: known.changed(person, height_m=1.1, mass_kg=36.5, distribution="heavy_head"),
    "heavy_arms": lambda person: known.changed(person, mass_kg=146.0, distribution="heavy_arms"),
    "tall": lambda _: bodies.build(betas=np.array([-2.0, 1.0, 1.0])),
    "small": lambda _: bodies.build(betas=np.array([2.0, 0.5, -1.0])),
}


def test_the_same_body_keeps_its_motion(person: Body, weights: Kinematics) -> None:
    fit = fitted(person, squat(person))
    again = kinematics.retarget(fit, known.changed(person), weights)
    off = np.linalg.norm(landmarks(again) - landmarks(fit), axis=-1)  # (T, M)
    assert off.mean() < 0.002
    assert off.max() < 0.005
    np.testing.assert_allclose(again.com_m, kinematics.configurations(person, fit.qpos)[0], atol=0.005)
    assert np.isnan(again.reprojection_px).all()


@pytest.mark.parametrize("floor_m", [0.0, STEP_M], ids=["ground", "step"])
@pytest.mark.parametrize("other", OTHERS)
def test_standing_feet_stand(person: Body, weights: Kinematics, other: str, floor_m: float) -> None:
    body = OTHERS[other](person)
    scene = Scene(items=(STEP,)) if floor_m else Scene()
    fit = fitted(person, squat(person, floor_m), scene)
    moved = kinematics.retarget(fit, body, weights)
    lowest, soles = touching_points(moved)
    np.testing.assert_allclose(soles[..., 2], floor_m, atol=0.004)
    assert np.linalg.norm(np.diff(soles, axis=1), axis=-1).max() * RATE_HZ < 0.03  # m/s
    assert lowest.min() > floor_m - 0.004
    scale = retargeting.scale_of(fit, body)
    assert scale == pytest.approx(known.leg_m(body.skeleton) / known.leg_m(person.skeleton))
    rows = [person.skeleton.point_names.index(name) for name in ("left_hip", "right_hip")]
    before, after = (landmarks(f)[:, rows, 2] - floor_m for f in (fit, moved))
    np.testing.assert_allclose(after, scale * before, atol=0.04)
    assert moved.body is body


def test_soles_slide_less_than_two_millimetres_a_frame_on_longer_legs(
    person: Body, weights: Kinematics
) -> None:
    other = legs.with_legs(person, 1.15)
    assert retargeting.scale_of(fitted(person, squat(person)), other) == pytest.approx(1.15, abs=0.02)
    fit = kinematics.retarget(fitted(person, squat(person)), other, weights)
    soles = touching_points(fit)[1]
    slide_m = np.linalg.norm(np.diff(soles, axis=1), axis=-1)
    print(f"{1e3 * slide_m.max():.2f} mm a frame at most")
    assert slide_m.max() < 2e-3


def test_the_way_scales_on_bare_ground_only(make: Makers, person: Body, weights: Kinematics) -> None:
    walk = make.walking(14, RATE_HZ)
    base = rotations.exp(walk.rotvecs[0])
    joints = rotations.exp(np.swapaxes(walk.rotvecs[1:], 0, 1)).reshape(walk.frames, -1)
    qpos = np.concatenate((walk.root_m, base, joints), axis=1)
    small = known.changed(person, height_m=1.4)
    far = replace(STEP, position_m=(9.0, 0.0, 0.0))
    ways = {}
    for name, scene in (("bare", Scene()), ("items", Scene(items=(far,)))):
        moved = kinematics.retarget(fitted(person, qpos, scene), small, weights)
        assert touching_points(moved)[0].min() > -0.005
        ways[name] = moved.qpos[-1, :3] - moved.qpos[0, :3]
    way = float(np.linalg.norm(walk.root_m[-1] - walk.root_m[0]))
    assert np.linalg.norm(ways["bare"]) == pytest.approx(0.8 * way, rel=0.05)
    assert np.linalg.norm(ways["items"]) == pytest.approx(way, rel=0.05)


def test_contacts_are_what_touches_and_rests(person: Body) -> None:
    qpos = squat(person, frames=6)
    qpos[:, 0] += np.array([0.0, 0.0, 0.0, 0.0, 0.05, 0.1])  # slides at 0.75 m/s
    qpos[5, 2] += 0.1  # jumps
    touch = contact_points(person.skeleton, person.primitives)
    pose = forward.forward(person.skeleton, *layout.from_qpos(qpos), 1.0)
    rest = supports(Scene(), touch, pose, 1 / RATE_HZ)
    soles = touch.soles.ravel()
    np.testing.assert_allclose(rest.touching[0, soles, :5], 1.0, atol=1e-6)
    assert rest.touching[0, soles, 5].max() < 1e-6
    np.testing.assert_allclose(rest.held[soles, :3], 1.0, atol=1e-6)
    assert rest.held[:, 3:].max() < 1e-3
    np.testing.assert_allclose(rest.height_m, 0.0, atol=1e-6)
    head = touch.segments == person.skeleton.names.index("head")
    assert rest.touching[0, head].max() < 1e-6


def test_the_gradient_is_that_of_finite_differences(person: Body, weights: Kinematics) -> None:
    rng = np.random.default_rng(3)
    scene = Scene(Ground(0.01), (STEP,))
    fit = fitted(person, squat(person, STEP_M, frames=3), scene)
    objective, start = retargeting.retargeting(fit, OTHERS["small"](person), weights)
    near = replace(
        start,
        root_m=start.root_m + rng.normal(scale=0.02, size=start.root_m.shape),
        rotvecs=start.rotvecs + rng.normal(scale=0.1, size=start.rotvecs.shape),
    ).pack()
    objective(near)
    assert min(objective.losses[name] for name in ("touch", "hold", "turn", "joint", "place")) > 1e-3
    free = FREE * 3  # what all frames share is known with the body
    assert not objective(near)[1][free:].any()
    gradient, slopes = objective(near)[1][:free], differences(objective, near)[:free]
    np.testing.assert_allclose(gradient, slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())
    gradient[7] += 1e-5 * np.abs(gradient).max()  # and the check catches a wrong one
    assert np.abs(gradient - slopes).max() > 5e-6 * np.abs(slopes).max()
