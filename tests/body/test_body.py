"""The person: what its MJCF holds, its symmetry, and lengths measured in evidence."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import prior, resources
from simrecon import scene as scenes
from simrecon.body import primitives
from simrecon.body.skeleton import joints
from simrecon.geometry import rotations
from simrecon.sim.models import compile_text
from simrecon.types import Array, Body, Evidence, Ground, Scene, SceneItem, Skeleton

MIRROR = np.array([1.0, -1.0, 1.0])


def person(height_m: float = 1.75, mass_kg: float = 70.0) -> Body:
    return bodies.build(bodies.scaled({}, height_m), height_m=height_m, mass_kg=mass_kg, sole_m=0.0)


@pytest.fixture(scope="module")
def body() -> Body:
    return person()


@pytest.fixture(scope="module")
def model(body: Body) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(body.mjcf)


def posed(model: mujoco.MjModel, rotvecs: Array) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate(([0, 0, 0, 1, 0, 0, 0], rotations.exp(rotvecs).ravel()))
    mujoco.mj_forward(model, data)
    return data


def t_pose(skeleton: Skeleton) -> Array:
    return rotations.log(rotations.conjugate(skeleton.rest[1:]))


def observed(skeleton: Skeleton, frames: int = 5, noise_m: float = 0.0) -> Evidence:
    """A person in T-pose as a 3D estimate sees it."""
    points = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    jitter = np.random.default_rng(0).normal(scale=noise_m, size=(frames, *points.shape))
    return Evidence(
        times_s=np.arange(frames) / 30,
        keypoint_names=(),
        keypoints_px=np.zeros((frames, 0, 2)),
        scores=np.zeros((frames, 0)),
        joint_names=skeleton.point_names,
        joints_m=points + jitter,
        joints_frame="world",
    )


def test_joints_motors_and_primitives_are_those_of_the_design(model: mujoco.MjModel) -> None:
    assert (model.ngeom, model.nu, model.nq, model.nv) == (26, 48, 7 + 16 * 4, 6 + 16 * 3)
    assert list(model.jnt_type) == [mujoco.mjtJoint.mjJNT_FREE] + [mujoco.mjtJoint.mjJNT_BALL] * 16
    boxes = [model.geom(i).name for i in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_BOX)]
    assert sorted(boxes) == ["left_foot", "left_hand", "right_foot", "right_hand"]
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE).sum() == 22


def test_segments_and_motors_stand_in_the_order_of_the_skeleton(body: Body, model: mujoco.MjModel) -> None:
    order = body.skeleton.names
    assert [model.body(i).name for i in range(1, model.nbody)] == list(order)
    assert [model.joint(i).name for i in range(1, model.njnt)] == list(order[1:])
    assert [model.actuator(i).name for i in range(model.nu)] == [
        f"{name}_{axis}" for name in order[1:] for axis in "xyz"
    ]


def test_nothing_drives_the_root(body: Body, model: mujoco.MjModel, rng: np.random.Generator) -> None:
    assert (model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT).all()
    assert set(model.actuator_trnid[:, 0]) == set(range(1, 17))
    data = posed(model, t_pose(body.skeleton))
    data.ctrl[:] = rng.uniform(-1, 1, model.nu)
    mujoco.mj_forward(model, data)
    assert np.abs(data.qfrc_actuator[6:]).max() > 10
    np.testing.assert_array_equal(data.qfrc_actuator[:6], 0.0)
    np.testing.assert_array_equal(data.qfrc_passive[:6], 0.0)
    assert (model.neq, model.nmocap, model.ntendon) == (0, 0, 0)


def test_motors_have_the_limits_and_gains_of_the_data(model: mujoco.MjModel) -> None:
    for i, joint in enumerate(joints()):
        for axis in range(3):
            motor = 3 * i + axis
            torque, stiffness = (70.0 * joint[key] for key in ("torque_Nmpkg", "stiffness_Nmpradkg"))
            assert model.actuator_forcerange[motor] == pytest.approx([-torque, torque], rel=1e-5)
            assert model.actuator_gainprm[motor, 0] == pytest.approx(stiffness, rel=1e-5)
            damping = 70.0 * joint["damping_Nmspradkg"]
            assert model.actuator_biasprm[motor, 1:3] == pytest.approx([-stiffness, -damping], rel=1e-5)
            low, high = np.radians(joint["range_deg"][axis])
            assert model.actuator_ctrlrange[motor] == pytest.approx([low, high], rel=1e-5)
            assert low < 0 < high
    assert model.actuator_forcelimited.all()
    assert model.actuator_ctrllimited.all()


def test_joints_are_limited_by_the_cone_of_their_range(body: Body, model: mujoco.MjModel) -> None:
    corners = np.linalg.norm(np.abs(body.skeleton.limits_rad).max(axis=2), axis=1)
    cones = np.minimum(corners, math.radians(170))
    assert model.jnt_limited[1:].all()
    np.testing.assert_allclose(model.jnt_range[1:, 1], cones, rtol=1e-5)
    assert corners.max() > math.radians(170)


@pytest.mark.parametrize(("height_m", "mass_kg"), [(1.5, 45.0), (1.75, 70.0), (1.95, 110.0)])
def test_masses_add_up(height_m: float, mass_kg: float) -> None:
    body = person(height_m, mass_kg)
    assert sum(part.mass_kg for part in body.primitives) == pytest.approx(mass_kg, rel=1e-12)
    model = mujoco.MjModel.from_xml_string(body.mjcf)
    assert model.body_mass.sum() == pytest.approx(mass_kg, rel=1e-5)
    assert (model.body_mass[1:] > 0).all()


def test_legs_have_their_share_of_the_mass(body: Body) -> None:
    # de Leva 1996, table 4: thigh, shank and foot, mean of both sexes
    share = (
        sum(
            part.mass_kg
            for part in body.primitives
            if part.name.startswith("left_") and part.segment in ("left_hip", "left_knee", "left_ankle")
        )
        / 70.0
    )
    assert share == pytest.approx(0.2037, abs=0.002)


def test_a_heavier_person_is_thicker_not_taller() -> None:
    light, heavy = person(1.75, 60.0), person(1.75, 120.0)
    for a, b in zip(light.primitives, heavy.primitives, strict=True):
        if a.kind == "capsule":
            wider = 1.0 if a.name == "skull" else math.sqrt(2)
            np.testing.assert_allclose(b.size_m, wider * a.size_m)
            np.testing.assert_array_equal(b.points_m, a.points_m)


def test_left_and_right_are_mirror_images(body: Body) -> None:
    parts = {part.name: part for part in body.primitives}
    for name, left in parts.items():
        if name.startswith("left_"):
            right = parts[name.replace("left_", "right_")]
            np.testing.assert_allclose(right.points_m, left.points_m * MIRROR, atol=1e-12)
            np.testing.assert_array_equal(right.size_m, left.size_m)
            assert right.mass_kg == left.mass_kg
        elif not name.startswith("right_"):
            assert np.abs(left.points_m[:, 1].sum()) < 1e-12
    skeleton = body.skeleton
    for i, name in enumerate(skeleton.names):
        if name.startswith("left_"):
            j = skeleton.names.index(name.replace("left_", "right_"))
            np.testing.assert_allclose(skeleton.offsets_m[j], skeleton.offsets_m[i] * MIRROR, atol=1e-12)
            swapped = skeleton.limits_rad[i - 1] * [[-1], [1], [-1]]
            np.testing.assert_allclose(skeleton.limits_rad[j - 1], np.sort(swapped, axis=1), atol=1e-12)


def test_mirrored_poses_are_mirrored_bodies(
    body: Body, model: mujoco.MjModel, rng: np.random.Generator
) -> None:
    names = body.skeleton.names[1:]
    swap = [
        names.index(n.replace("left_", "#").replace("right_", "left_").replace("#", "right_")) for n in names
    ]
    pose = rng.uniform(-0.5, 0.5, (16, 3))
    here, there = posed(model, pose), posed(model, (pose * [-1, 1, -1])[swap])
    geoms = [model.geom(i).name for i in range(model.ngeom)]
    other = [
        geoms.index(n.replace("left_", "#").replace("right_", "left_").replace("#", "right_")) for n in geoms
    ]
    np.testing.assert_allclose(there.geom_xpos[other], here.geom_xpos * MIRROR, atol=1e-6)
    np.testing.assert_allclose(there.subtree_com[1], here.subtree_com[1] * MIRROR, atol=1e-6)


def test_a_relaxed_stance_and_a_t_pose_touch_nothing(body: Body, model: mujoco.MjModel) -> None:
    relaxed = posed(model, prior.gaussian(body.skeleton).mean_rad)
    assert relaxed.ncon == 0
    assert posed(model, t_pose(body.skeleton)).ncon == 0
    # the check can fail: an upper arm that leans inwards meets the trunk
    i = body.skeleton.names.index("left_shoulder")
    inwards = rotations.exp(np.radians([-110.0, 0.0, 0.0]))
    leaning = prior.gaussian(body.skeleton).mean_rad.copy()
    leaning[i - 1] = rotations.log(rotations.multiply(rotations.conjugate(body.skeleton.rest[i]), inwards))
    assert posed(model, leaning).ncon > 0


@pytest.mark.parametrize("height_m", [1.5, 1.75, 2.0])
def test_height_is_respected(height_m: float) -> None:
    mass_kg = primitives.default_mass_kg(height_m)
    body = person(height_m, mass_kg)
    assert bodies.stature_m(body.skeleton) == pytest.approx(height_m, rel=1e-12)
    model = mujoco.MjModel.from_xml_string(body.mjcf)
    data = posed(model, t_pose(body.skeleton))
    capsule = model.geom("skull").id
    reach = abs(data.geom_xmat[capsule, 8]) * model.geom_size[capsule, 1] + model.geom_size[capsule, 0]
    foot = model.geom("left_foot").id
    sole = data.geom_xpos[foot, 2] - model.geom_size[foot, 2]
    assert data.geom_xpos[capsule, 2] + reach - sole == pytest.approx(height_m, abs=0.01)


def test_default_mass_is_of_normal_weight() -> None:
    assert primitives.default_mass_kg(2.0) == pytest.approx(88.0)
    assert 1.5 < primitives.default_height_m() < 1.9


def unusual() -> Skeleton:
    """Long legs, short arms, broad hips."""
    lengths = bodies.measure_template(bodies.scaled({}, 1.8))
    factors = {"thigh": 1.1, "shank": 1.07, "upper_arm": 0.9, "forearm": 0.95, "hip_width": 1.2, "head": 1.05}
    return bodies.scaled({name: value * factors.get(name, 1.0) for name, value in lengths.items()})


def test_measured_lengths_are_recovered() -> None:
    truth = unusual()
    measured = bodies.measure(observed(truth))
    skeleton = bodies.scaled(measured)
    expected = bodies.measure_template(truth)
    assert len(expected) == 11
    for name, value in bodies.measure_template(skeleton).items():
        assert value == pytest.approx(expected[name], rel=1e-9), name
    np.testing.assert_allclose(skeleton.offsets_m, truth.offsets_m, atol=1e-9)


def test_feet_take_the_triangle_that_was_measured() -> None:
    truth = unusual()
    rows = [truth.point_names.index(f"left_{end}") for end in ("heel", "toe")]
    offsets = truth.point_offsets_m.copy()
    for side in ("left", "right"):
        offsets[truth.point_names.index(f"{side}_heel")] = [-0.05, 0.0, -0.07]
        offsets[truth.point_names.index(f"{side}_toe")] = [0.16, 0.0, -0.07]
    truth = replace(truth, point_offsets_m=offsets)
    skeleton = bodies.scaled(bodies.measure(observed(truth)))
    np.testing.assert_allclose(skeleton.point_offsets_m[rows], offsets[rows], atol=1e-9)


def test_feet_that_no_one_has_are_not_believed() -> None:
    truth = unusual()
    offsets = truth.point_offsets_m.copy()
    for side in ("left", "right"):
        offsets[truth.point_names.index(f"{side}_toe")] = [0.6, 0.0, -0.07]
    skeleton = bodies.scaled(bodies.measure(observed(replace(truth, point_offsets_m=offsets))))
    assert 0.1 < skeleton.point_offsets_m[truth.point_names.index("left_toe"), 0] < 0.25


def test_noise_and_missing_joints() -> None:
    truth = unusual()
    evidence = observed(truth, frames=201, noise_m=0.01)
    joints_m = evidence.joints_m.copy()
    joints_m[::3] = np.nan
    joints_m[:, truth.point_names.index("right_knee")] = np.nan
    measured = bodies.measure(replace(evidence, joints_m=joints_m))
    expected = bodies.measure_template(truth)
    assert measured["thigh"] == pytest.approx(expected["thigh"], rel=0.01)
    assert measured["hip_width"] == pytest.approx(expected["hip_width"], rel=0.02)
    few = [truth.point_names.index(name) for name in ("left_knee", "left_ankle")]
    alone = replace(evidence, joint_names=("left_knee", "left_ankle"), joints_m=evidence.joints_m[:, few])
    assert set(bodies.measure(alone)) == {"shank"}


def test_lengths_that_are_not_measured_follow_the_others() -> None:
    unit = bodies.measure_template(bodies.template())
    lengths = bodies.measure_template(bodies.scaled({"thigh": 2 * unit["thigh"]}))
    for name in unit:
        assert lengths[name] == pytest.approx(2 * unit[name]), name


def test_a_known_height_scales_what_was_measured() -> None:
    lengths = bodies.measure_template(unusual())
    skeleton = bodies.scaled(lengths, 1.6)
    assert bodies.stature_m(skeleton) == pytest.approx(1.6)
    again = bodies.measure_template(skeleton)
    ratios = [again[name] / lengths[name] for name in lengths]
    np.testing.assert_allclose(ratios, ratios[0])


def test_the_sole_lies_under_heel_and_toe(body: Body) -> None:
    foot = next(part for part in body.primitives if part.name == "left_foot")
    skeleton = body.skeleton
    heel, toe = (
        skeleton.point_offsets_m[skeleton.point_names.index(f"left_{end}")] for end in ("heel", "toe")
    )
    low, high = foot.points_m[0] - foot.size_m, foot.points_m[0] + foot.size_m
    assert low[2] == pytest.approx(0.5 * (heel[2] + toe[2]))
    assert low[0] == pytest.approx(heel[0])
    assert toe[0] <= high[0] < toe[0] + 0.35 * (toe[0] - heel[0])
    assert high[2] < 0
    lower = primitives.make(skeleton, 1.75, 70.0, 0.02)
    sunk = next(part for part in lower if part.name == "left_foot")
    assert sunk.points_m[0, 2] - sunk.size_m[2] == pytest.approx(low[2] - 0.02)


@pytest.mark.parametrize("sole_m", [-0.3, -0.1, -0.07, 0.1])
def test_feet_have_a_thickness_wherever_the_sole_is(sole_m: float) -> None:
    """A fit of few evaluations may put the sole above the ankle."""
    person = bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0, sole_m=sole_m)
    feet = [part for part in person.primitives if part.name.endswith("_foot")]
    assert len(feet) == 2
    assert min(foot.size_m[2] for foot in feet) >= 0.004
    assert mujoco.MjModel.from_xml_string(person.mjcf).ngeom >= 26


@pytest.mark.parametrize("mass_kg", [50.0, 110.0])
def test_who_stands_upright_is_as_tall_as_the_skeleton(mass_kg: float) -> None:
    """Where nobody measured the head, skull and points of the head are of one size, whatever the weight."""
    body = person(1.6, mass_kg)
    assert bodies.stature_m(body.skeleton) == pytest.approx(1.6)
    assert primitives.upright_m(body) == pytest.approx(1.6, rel=0.002)


def test_a_body_of_shape_parameters_is_as_tall_as_it_should_be() -> None:
    body = bodies.build(height_m=1.6, mass_kg=60.0, betas=np.array([1.0, -1.0, 0.5]))
    assert primitives.upright_m(body) == pytest.approx(1.6, rel=0.01)


def test_a_head_of_another_size_than_the_body_leaves_the_simulated_stature_to_the_skull() -> None:
    lengths = bodies.measure_template(bodies.scaled({}, 1.7))
    skeleton = bodies.scaled(lengths | {"skull": 0.85 * 0.125 * 1.7}, 1.7)
    body = bodies.build(skeleton, height_m=1.7, mass_kg=60.0)
    top = skeleton.point_offsets_m[skeleton.point_names.index("head_top"), 2]
    higher_m = primitives.upright_m(body) - bodies.stature_m(skeleton)
    assert higher_m == pytest.approx(0.125 * 1.7 - top)
    assert higher_m > 0.02


def test_contact_gives_way_on_the_person_and_on_what_they_touch(body: Body) -> None:
    """The scene's contact counts, so it has to be as soft; a sprung floor gives way by itself."""
    soft = resources.toml("models", "body", "mass.toml")["contact"]["solimp"]
    step = SceneItem("step", "box", (1.0, 0.0, 0.0), {"size_m": (0.4, 0.8, 0.12)})
    model = compile_text(scenes.build(body.mjcf, Scene(items=(step,)), 0.005))
    np.testing.assert_allclose(model.geom_solimp, np.tile(soft, (model.ngeom, 1)))
    sprung = Scene(Ground(stiffness_Npm=2e4, damping_Nspm=400.0))
    ground = compile_text(scenes.build(body.mjcf, sprung, 0.005)).geom(scenes.GROUND_GEOM)
    assert ground.solimp[0] > 0.999
