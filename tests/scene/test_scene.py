"""Scene files, the model built from them, and support heights."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.scene import kinds
from simrecon.types import Friction, Ground, Scene, SceneItem

BODY = """
<mujoco>
  <option integrator="discrete" timestep="0.002" iterations="7"/>
  <default><geom friction="2 0.1 0.1" solref="0.01 1" contype="2" conaffinity="2"/></default>
  <worldbody>
    <body name="pelvis" pos="0 0 1">
      <freejoint/>
      <geom name="pelvis" type="box" size="0.1 0.1 0.1" contype="1" conaffinity="1"/>
    </body>
  </worldbody>
</mujoco>
"""
TEXT = """
[ground]
height_m = -0.1
friction = 0.7

[[item]]
name = "bench"
kind = "box"
position_m = [1, 0.5, -0.1]
size_m = [0.4, 1.2, 0.45]
yaw_rad = 0.5

[[item]]
name = "rail"
kind = "beam"
position_m = [0.0, 0.0, 0.0]
length_m = 3.0
width_m = 0.1
height_m = 0.05
friction = 0.5
"""


RAIL = {"length_m": 3.0, "width_m": 0.1, "height_m": 0.05}


def block(
    name: str,
    position_m: tuple[float, float, float],
    size_m: tuple[float, float, float],
    yaw_rad: float = 0.0,
    friction: float = 0.9,
) -> SceneItem:
    return SceneItem(name, "box", position_m, {"size_m": size_m}, yaw_rad, Friction(friction))


def test_parse() -> None:
    scene = scenes.parse(TEXT)
    assert scene.ground == Ground(-0.1, Friction(0.7))
    assert scene.items == (
        SceneItem("bench", "box", (1.0, 0.5, -0.1), {"size_m": (0.4, 1.2, 0.45)}, yaw_rad=0.5),
        SceneItem("rail", "beam", (0.0, 0.0, 0.0), RAIL, friction=Friction(0.5)),
    )


def test_an_empty_file_is_a_floor() -> None:
    assert scenes.parse("") == Scene()


positions = st.floats(-999.0, 1000.0)
names = st.text(min_size=1).filter(lambda text: text.strip() and text.isprintable())
frictions = st.builds(Friction, st.floats(0, 10)) | st.builds(Friction, *(st.floats(0, 1),) * 3)
SIMPLE = [kind for kind in kinds.table().values() if kind.name != "mesh"]


def values(of: kinds.Parameter) -> st.SearchStrategy:
    if of.type == "flag":
        return st.booleans()
    if of.type == "count":
        return st.integers(int(of.low), int(of.high))
    number = st.floats(of.low, of.high, exclude_min=of.above)
    return st.tuples(*[st.floats(1e-6, of.high)] * 3) if of.type == "vector" else number


@st.composite
def items(draw: st.DrawFn) -> SceneItem:
    kind = draw(st.sampled_from(SIMPLE))
    return SceneItem(
        draw(names),
        kind.name,
        draw(st.tuples(positions, positions, positions)),
        {parameter.name: draw(values(parameter)) for parameter in kind.parameters},
        draw(st.floats(-7, 7)),
        draw(frictions),
        draw(st.none() | st.floats(0.01, 1e5)) if kind.movable else None,
    )


grounds = st.builds(Ground, st.floats(-100, 100), frictions) | st.builds(
    Ground,
    st.floats(-100, 100),
    frictions,
    st.floats(1e-6, 1.0),
    st.floats(-7, 7),
    calibrate=st.booleans(),
)
sprung = st.builds(Ground, stiffness_Npm=st.floats(100, 1e7), damping_Nspm=st.floats(0, 1e5))


@given(
    st.builds(
        Scene,
        grounds | sprung,
        st.lists(items(), max_size=3, unique_by=lambda item: item.name).map(tuple),
    )
)
def test_round_trip(scene: Scene) -> None:
    assert scenes.parse(scenes.dumps(scene)) == scene


def test_a_floor_to_be_calibrated() -> None:
    scene = scenes.parse('[ground]\nstiffness_Npm = "fit"')
    assert scene.ground == Ground(calibrate=True)
    assert 'stiffness_Npm = "fit"' in scenes.dumps(scene)
    with pytest.raises(InputError, match='"fit" is found by `simrecon run`'):
        model_of(scene)
    assert scenes.hard_floor(scene) == Scene()
    sprung = scenes.parse("[ground]\nstiffness_Npm = 2e4\ndamping_Nspm = 300")
    assert scenes.hard_floor(sprung) is sprung


def test_files_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    scenes.write(scenes.parse(TEXT), path)
    assert scenes.read(path) == scenes.parse(TEXT)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("friction = 0.7", "fricton = 0.7", ("s.toml", "[ground]", "'fricton'", "did you mean 'friction'")),
        ("friction = 0.7", "friction = -1", ("[ground]", "friction", "from 0 to 10", "-1")),
        ("friction = 0.7", "friction = true", ("[ground]", "friction", "number", "True")),
        ("friction = 0.7", "stiffness_Npm = 2e4", ("[ground]", "stiffness_Npm", "needs damping_Nspm")),
        ("friction = 0.7", 'stiffness_Npm = "soft"', ("[ground]", "stiffness_Npm", '"fit"', "'soft'")),
        ("friction = 0.7", "stiffness_Npm = 2\ndamping_Nspm = 3", ("stiffness_Npm", "from 100", "2")),
        ("friction = 0.7", "damping_Nspm = 3", ("damping_Nspm needs a number stiffness_Npm",)),
        ("friction = 0.7", 'stiffness_Npm = "fit"\ndamping_Nspm = 3', ("damping_Nspm", "'fit'")),
        ("friction = 0.7", "friction_rolling_m = 0.1", ("friction_rolling_m", "friction_torsional_m")),
        ("friction = 0.7", "slope_rad = 1.5", ("slope_rad", "from 0 to 1", "1.5")),
        ("friction = 0.7", "slope_yaw_rad = 1.5", ("slope_yaw_rad needs slope_rad",)),
        ("[ground]", "[floor]", ("unknown key 'floor'", "ground, item")),
        ("height_m = -0.1", "height_m = nan", ("height_m", "nan")),
        ('kind = "box"', 'kind = "chair"', ("bench", "unknown key 'size_m'", "seat_height_m", "arms")),
        ('kind = "box"', 'kind = "boxx"', ("bench", "'boxx' is unknown", "did you mean 'box'", "box, beam")),
        ("friction = 0.5", "mass_kg = -1", ("rail", "mass_kg", "from 0.01", "-1")),
        ('kind = "box"\n', "", ("item 1", "kind must be text in quotes", "None")),
        ('name = "bench"', "name = 3", ("item 1", "name", "3")),
        ('name = "bench"', 'name = "rail"', ("two items", "'rail'")),
        ("yaw_rad = 0.5", "yaw_deg = 30", ("bench", "'yaw_deg'", "yaw_rad")),
        ("[0.4, 1.2, 0.45]", "[0.4, 0, 0.45]", ("bench", "size_m", "above 0", "[0.4, 0, 0.45]")),
        (
            "size_m = [0.4, 1.2, 0.45]",
            "size_m = [0.4, 1.2]",
            ("bench", "size_m", "a list of three numbers above 0 and at most 1000"),
        ),
        ("size_m = [0.4, 1.2, 0.45]", "length_m = 2", ("bench", "'length_m'", "size_m")),
        ("size_m = [0.4, 1.2, 0.45]\n", "", ("bench", "lacks", "'size_m'")),
        ("position_m = [1, 0.5, -0.1]", 'position_m = "here"', ("bench", "position_m", "'here'")),
        ("width_m = 0.1", "width_m = 0.0", ("rail", "width_m", "above 0", "0.0")),
        ("length_m = 3.0", "length_m = 1e9", ("rail", "length_m", "1000")),
        ("[ground]", "[ground", ("not valid TOML",)),
        ("[[item]]", "[item]", ("TOML",)),
    ],
)
def test_bad_scenes_are_one_clear_line(old: str, new: str, words: tuple[str, ...]) -> None:
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        scenes.parse(TEXT.replace(old, new, 1), "s.toml")
    message = str(caught.value)
    assert message.startswith("s.toml:")
    assert "\n" not in message
    for word in words:
        assert word in message


def test_a_single_table_item_is_refused() -> None:
    with pytest.raises(InputError, match=r"list of tables, each under \[\[item\]\]"):
        scenes.parse('[item]\nname = "x"')


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: cannot read"):
        scenes.read(tmp_path / "none.toml")


def test_unwritable_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        scenes.write(Scene(), tmp_path / "no" / "scene.toml")


def model_of(scene: Scene, timestep_s: float = 0.01) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(scenes.build(BODY, scene, timestep_s))


def test_build_places_floor_and_items() -> None:
    model = model_of(scenes.parse(TEXT))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.geom("ground").xpos, [0, 0, -0.1])
    np.testing.assert_allclose(data.geom("item/bench").xpos, [1, 0.5, 0.125], atol=1e-6)
    np.testing.assert_allclose(model.geom("item/bench").size, [0.2, 0.6, 0.225])
    x_axis = data.geom("item/bench").xmat.reshape(3, 3)[:, 0]
    np.testing.assert_allclose(x_axis, [math.cos(0.5), math.sin(0.5), 0], atol=1e-5)
    np.testing.assert_allclose(model.geom("item/rail").size, [1.5, 0.05, 0.025])


def test_options_of_the_body_stay() -> None:
    model = model_of(Scene())
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
    assert model.opt.iterations == 7
    np.testing.assert_allclose(model.geom("ground").solref, [0.01, 1])


@pytest.mark.parametrize("timestep_s", [1 / 90, 1 / 59.94 / 2, 0.01, 1e-5 / 3])
def test_timestep_keeps_all_digits(timestep_s: float) -> None:
    assert model_of(Scene(), timestep_s).opt.timestep == timestep_s


def test_timestep_of_a_body_without_options() -> None:
    body = BODY.replace('<option integrator="discrete" timestep="0.002" iterations="7"/>', "")
    mjcf = scenes.build(body, Scene(), 0.002)
    assert mujoco.MjModel.from_xml_string(mjcf).opt.timestep == 0.002


def test_contacts_have_the_friction_of_the_scene() -> None:
    model = model_of(Scene(Ground(0.0, Friction(0.3)), (block("s", (2, 0, 0), (1, 1, 0.5), 0.0, 0.6),)))
    data = mujoco.MjData(model)
    for x, z, friction in ((0.0, 0.099, 0.3), (2.0, 0.599, 0.6)):
        data.qpos[:3] = x, 0, z
        mujoco.mj_forward(model, data)
        assert data.ncon > 0
        np.testing.assert_allclose(data.contact.friction[:, 0], friction)


def test_a_body_comes_to_rest_at_the_support_height() -> None:
    scene = scenes.parse(TEXT)
    model = model_of(scene, 0.005)
    for xy in ((-1.0, 2.0), (1.0, 0.5)):
        data = mujoco.MjData(model)
        height = float(scenes.support_height(scene, np.array(xy)))
        data.qpos[:3] = *xy, height + 0.15
        mujoco.mj_step(model, data, 400)
        assert data.qpos[2] == pytest.approx(height + 0.1, abs=5e-3)


def test_support_height() -> None:
    stack = Scene(
        Ground(0.1),
        (
            block("low", (0, 0, 0.1), (2, 2, 0.2)),
            block("high", (0.5, 0, 0.3), (1, 0.2, 0.3), math.pi / 2),
            block("pit", (5, 5, -1), (1, 1, 0.5)),
        ),
    )
    points = np.array([[[3, 0], [0, 0], [0.5, 0]], [[0.5, 0.45], [0.9, 0.0], [5, 5]]], float)  # (2, 3, 2)
    np.testing.assert_allclose(scenes.support_height(stack, points), [[0.1, 0.3, 0.6], [0.6, 0.3, 0.1]])


def test_support_height_turns_the_right_way() -> None:
    scene = Scene(items=(block("rail", (0, 0, 0), (2, 0.1, 0.05), math.pi / 4),))
    assert scenes.support_height(scene, np.array([0.6, 0.6])) == pytest.approx(0.05)
    assert scenes.support_height(scene, np.array([0.6, -0.6])) == 0.0


BLOCK = Scene(Ground(-0.2), (block("b", (1, 0, 0), (0.4, 1.0, 0.5), math.pi / 2),))


@pytest.mark.parametrize(
    ("point", "ground", "item"),
    [
        ((1, 0, 0.8), 1.0, 0.3),  # above
        ((1, 0.5, 0.3), 0.5, 0.3),  # beside its long face
        ((1.8, 0.4, 0.5), 0.7, math.hypot(0.3, 0.2)),  # off an upright edge
        ((1, 0, 0.4), 0.6, -0.1),  # inside, below the top
        ((1, 0.15, 0.1), 0.3, -0.05),  # inside, near a side
        ((1, 0, -0.5), -0.3, -0.2),  # under it: nothing gets there, the long side is nearest
    ],
)
def test_distances(point: tuple[float, ...], ground: float, item: float) -> None:
    apart, _ = scenes.distances(BLOCK, np.array(point, float))
    np.testing.assert_allclose(apart, [ground, item], atol=1e-12)


def test_distances_have_their_gradients(rng: np.random.Generator) -> None:
    points = rng.uniform(-1, 2, (200, 3))
    _, gradient = scenes.distances(BLOCK, points)
    step = 1e-6
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        change = scenes.distances(BLOCK, points + shift)[0] - scenes.distances(BLOCK, points - shift)[0]
        np.testing.assert_allclose(change / (2 * step), gradient[..., axis], atol=1e-5)


def test_far_frames_of_things_are_left_out() -> None:
    items = (
        block("a", (0, 0, 0), (1, 1, 1)),
        block("b", (5, 0, 3), (1, 1, 1)),
        block("c", (9, 0, 0), (1, 1, 1)),
    )
    scene = Scene(items=items)
    body = np.array([[[0.0, 0.0, 1.0], [4.0, 0.0, 1.0]], [[0.3, 0.2, 1.5], [3.9, 0.3, 0.0]]])  # (G, T, 3)
    apart, normals = scenes.nearby(scene, body)
    exact, slopes = scenes.distances(scene, body)
    assert apart.shape == (3, 2, 2)
    np.testing.assert_array_equal(apart[0], exact[0])
    np.testing.assert_array_equal(apart[1, :, 0], exact[1, :, 0])
    np.testing.assert_array_equal(apart[2, :, 1], exact[2, :, 1])
    np.testing.assert_array_equal(normals[2, :, 1], slopes[2, :, 1])
    assert np.isinf(apart[1, :, 1]).all()
    assert np.isinf(apart[2, :, 0]).all()
    for near, expected in zip(
        scenes.nearby(scenes.parse(TEXT), body[:, :1]),
        scenes.distances(scenes.parse(TEXT), body[:, :1]),
        strict=True,
    ):
        np.testing.assert_array_equal(near, expected)


def test_a_scene_of_too_many_items_is_refused_at_once() -> None:
    text = "".join(
        f'[[item]]\nname = "b{i}"\nkind = "box"\nposition_m = [{i}, 0, 0]\nsize_m = [0.5, 0.5, 0.5]\n'
        for i in range(501)
    )
    with pytest.raises(InputError, match="item: found 501; valid: at most 500"):
        scenes.parse(text)
