"""What the simulator does with scenes, against formulas."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from simrecon import scene as scenes
from simrecon.bench import statics
from simrecon.scene import sheets
from simrecon.types import Array, Friction, Ground, Scene, SceneItem

GRAVITY = 9.81
HALF_M = 0.15


def block(mass_kg: float, height_m: float) -> str:
    return f"""
<mujoco>
  <option integrator="discrete"/>
  <worldbody>
    <body name="block" pos="0 0 {height_m + HALF_M}">
      <freejoint/>
      <geom name="block" type="box" size="{HALF_M} {HALF_M} {HALF_M}" mass="{mass_kg}"/>
    </body>
  </worldbody>
</mujoco>
"""


def built(scene: Scene, mass_kg: float, timestep_s: float, height_m: float = 0.0) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(scenes.build(block(mass_kg, height_m), scene, timestep_s))


def sinks(model: mujoco.MjModel, duration_s: float, height_m: float = 0.0) -> Array:
    """How far the block's underside is below its height at rest, after every step."""
    data = mujoco.MjData(model)
    depths = []
    for _ in range(round(duration_s / model.opt.timestep)):
        mujoco.mj_step(model, data)
        depths.append(height_m + HALF_M - data.qpos[2])
    return np.array(depths)


def soft(stiffness: float, damping: float) -> Scene:
    return Scene(Ground(stiffness_Npm=stiffness, damping_Nspm=damping))


def item_of(kind: str, mass_kg: float | None = None, **options: object) -> SceneItem:
    text = {"name": "piece", "kind": kind, "position_m": [0.0, 0.0, 0.0], **options}
    if mass_kg is not None:
        text["mass_kg"] = mass_kg
    return scenes.item(text, "test:")


@pytest.mark.parametrize("timestep_s", [0.004, 0.012])
@pytest.mark.parametrize("mass_kg", [30.0, 70.0])
@pytest.mark.parametrize("stiffness", [5e3, 2e4, 1e5])
def test_a_block_sinks_by_weight_over_stiffness(stiffness: float, mass_kg: float, timestep_s: float) -> None:
    damping = 0.7 * 2 * np.sqrt(stiffness * mass_kg)
    depths = sinks(built(soft(stiffness, damping), mass_kg, timestep_s), 3.0)
    assert depths[-1] == pytest.approx(mass_kg * GRAVITY / stiffness, rel=0.02)


@pytest.mark.parametrize("timestep_s", [0.004, 0.012])
@pytest.mark.parametrize(
    ("mass_kg", "stiffness", "damping"),
    [(70.0, 2e4, 400.0), (70.0, 5e3, 60.0), (30.0, 1e4, 200.0)],
)
def test_a_block_bounces_as_a_damped_oscillator(
    mass_kg: float, stiffness: float, damping: float, timestep_s: float
) -> None:
    """Put down without speed it swings about its rest without leaving the floor."""
    options = {
        "mass_kg": mass_kg,
        "stiffness_Npm": stiffness,
        "damping_Nspm": damping,
        "timestep_s": timestep_s,
    }
    for result in (statics.period(**options), statics.decay(**options)):
        assert result.measured == pytest.approx(result.expected, rel=0.03)


def dropped(mass_kg: float, stiffness: float, damping: float, times_s: Array, height_m: float) -> Array:
    """Height of a body dropped on a spring and damper that can't pull, by small steps."""
    height, speed, fine = height_m, 0.0, 1e-5
    heights = []
    for k in range(round(times_s[-1] / fine)):
        force = max(0.0, -stiffness * height - damping * speed) if height < 0 else 0.0
        speed += fine * (force / mass_kg - GRAVITY)
        height += fine * speed
        if k % 100 == 99:
            heights.append(height)
    return np.interp(times_s, 1e-3 * np.arange(1, len(heights) + 1), heights)


def test_a_stiff_floor_swings_right_at_small_steps() -> None:
    """At 26 rad/s a step of 12 ms is too coarse."""
    test_a_block_bounces_as_a_damped_oscillator(70.0, 5e4, 500.0, 0.004)


def test_a_dropped_block_comes_back_as_the_formula_says() -> None:
    heights = 0.2 - sinks(built(soft(2e4, 150.0), 70.0, 0.004, 0.2), 1.6, 0.2)
    times = 0.004 * np.arange(1.0, len(heights) + 1)
    expected = dropped(70.0, 2e4, 150.0, times, 0.2)
    for start, within in ((100, 0.03), (225, 0.1)):  # after the first and the second landing
        here, there = heights[start : start + 100], expected[start : start + 100]
        assert here.max() == pytest.approx(there.max(), rel=within)
        assert here.argmax() == pytest.approx(there.argmax(), abs=3)
    assert heights.min() == pytest.approx(expected.min(), rel=0.03)


def test_damping_below_what_is_stable_stays_stable() -> None:
    depths = sinks(built(soft(1e6, 0.0), 70.0, 0.012), 4.0)
    assert np.isfinite(depths).all()
    assert np.abs(depths[-100:] - 70 * GRAVITY / 1e6).max() < 1e-3


def test_a_mat_sinks_by_pressure_over_stiffness() -> None:
    mat = item_of("mat", stiffness_Npm3=3e5, damping_Nspm3=1e4, tile_m=0.1, length_m=1.0, width_m=1.0)
    depths = sinks(built(Scene(items=(mat,)), 60.0, 0.01, 0.2), 2.0, 0.2)
    # the block's 0.3 m reach over four tiles of 0.1 m along each side
    share = 16 * 0.01
    assert depths[-1] == pytest.approx(60 * GRAVITY / (3e5 * share), rel=0.02)


def test_a_mat_bottoms_out() -> None:
    mat = item_of("mat", stiffness_Npm3=1e4, damping_Nspm3=1e4, height_m=0.1)
    depths = sinks(built(Scene(items=(mat,)), 200.0, 0.01, 0.1), 3.0, 0.1)
    assert depths[-1] == pytest.approx(0.095, abs=0.01)


@pytest.mark.parametrize("factor", [1.0, 4.0, 16.0])
def test_a_trampoline_is_as_stiff_as_it_says(factor: float) -> None:
    bed = item_of("trampoline", stiffness_Npm=5e3 * factor, damping_Nspm=1e3 * np.sqrt(factor))
    model = built(Scene(items=(bed,)), 70.0, 0.008, 1.155)
    depths = sinks(model, 4.0, 1.155)
    # 7 tiles of 0.306 m: the block of 0.3 m stands on the middle one
    assert depths[-1] == pytest.approx(70 * GRAVITY / (5e3 * factor), rel=0.1)


def test_a_stiffer_trampoline_gives_way_less_and_throws_sooner() -> None:
    deepest, back, up = [], [], []
    for factor in (1.0, 4.0, 16.0):
        bed = item_of("trampoline", stiffness_Npm=5e3 * factor, damping_Nspm=60.0 * np.sqrt(factor))
        heights = 1.155 - sinks(built(Scene(items=(bed,)), 70.0, 0.004, 1.655), 2.0, 1.155)
        landed = int(np.argmax(heights < 1.155))
        lowest = landed + int(np.argmin(heights[landed : landed + 150]))
        deepest.append(1.155 - heights[lowest])
        back.append((lowest - landed) * 0.004)
        up.append(heights[lowest:].max() - 1.155)
    assert deepest[0] > deepest[1] > deepest[2] > 0
    assert back[0] > back[1] > back[2]
    assert min(up) > 0


def test_the_membrane_is_the_discrete_poisson_problem() -> None:
    sheet = sheets.sheet_of(item_of("trampoline"))
    assert sheet is not None
    matrix = sheet.matrix()
    np.testing.assert_allclose(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > 0
    load = np.zeros(sheet.tiles)
    load[sheet.tiles[0] // 2, sheet.tiles[1] // 2] = 1.0
    sink = np.linalg.solve(matrix, load.ravel())
    assert sink.argmax() == load.argmax()


def test_things_move_only_with_a_mass() -> None:
    for mass in (None, 5.0):
        item = item_of("box", mass, size_m=[0.4, 0.4, 0.4])
        model = built(Scene(items=(item,)), 20.0, 0.005, 0.4)
        data = mujoco.MjData(model)
        data.qvel[0] = 3.0  # the block slides over it and drags it along
        mujoco.mj_step(model, data, 100)
        x = data.geom("item/piece").xpos[0]
        assert (abs(x) > 0.01) == (mass is not None)


@pytest.mark.parametrize("kind", ["box", "table", "chair", "ramp", "ball"])
def test_movable_things_have_their_mass_and_rest_on_the_floor(kind: str) -> None:
    options = {"size_m": [0.5, 0.4, 0.3]} if kind == "box" else {}
    item = item_of(kind, 8.0, friction_torsional_m=0.01, friction_rolling_m=0.001, **options)
    scene = Scene(items=(SceneItem(**{**vars(item), "position_m": (2.0, 0.0, 0.0)}),))
    model = built(scene, 20.0, 0.005)
    assert model.body("item/piece").subtreemass[0] == pytest.approx(8.0)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 300)
    np.testing.assert_allclose(data.qpos[7:10], [2.0, 0.0, 0.0], atol=0.01)


def test_friction_decides_whether_a_block_slides_down_a_slope() -> None:
    for friction, slides in ((0.2, True), (0.5, False)):
        ground = Ground(0.3, Friction(friction), slope_rad=0.3, slope_yaw_rad=np.pi / 2)
        model = built(Scene(ground), 20.0, 0.004, 0.3)
        data = mujoco.MjData(model)
        data.qpos[3:7] = np.cos(0.15), np.sin(0.15), 0, 0  # it rises towards +y
        mujoco.mj_step(model, data, 250)
        expected = -0.5 * GRAVITY * (np.sin(0.3) - friction * np.cos(0.3)) * np.cos(0.3)
        if slides:
            assert data.qpos[1] == pytest.approx(expected, rel=0.05)
        else:
            assert abs(data.qpos[1]) < 0.02


@pytest.mark.parametrize("rolling", [None, 0.01])
def test_rolling_friction_stops_a_ball(rolling: float | None) -> None:
    options = {} if rolling is None else {"friction_torsional_m": 0.005, "friction_rolling_m": rolling}
    ball = item_of("ball", 2.0, **options)
    ground = Ground(friction=Friction(0.9, *(options.values())))
    model = built(Scene(ground, (SceneItem(**{**vars(ball), "position_m": (5.0, 0.0, 0.0)}),)), 20.0, 0.005)
    data = mujoco.MjData(model)
    data.qvel[10] = 1.0 / 0.11  # about the point that touches the floor
    mujoco.mj_step(model, data, 200)
    loss = 0.0 if rolling is None else 5 / 7 * GRAVITY * rolling / 0.11  # m/s in a second
    assert data.geom("item/piece").xpos[0] - 5.0 == pytest.approx(1.0 - loss / 2, rel=0.05)


@pytest.mark.parametrize(
    "kind", ["ramp", "stairs", "table", "chair", "bed", "wall", "ball", "trampoline", "mat"]
)
def test_support_and_distance_agree_with_the_simulator(kind: str, rng: np.random.Generator) -> None:
    """A ray from above hits what `support_height` says; `distances` is zero there."""
    item = SceneItem(**{**vars(item_of(kind, yaw_rad=0.4)), "position_m": (0.3, -0.2, 0.1)})
    scene = Scene(items=(item,))
    model = built(scene, 20.0, 0.005, 50.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    xy = [0.3, -0.2] + rng.uniform(-1, 1, (150, 2)) * (0.13 if kind == "ball" else 1.3)
    heights = scenes.support_height(scene, xy)
    groups = np.ones(6, np.uint8)
    hits = 0
    for (x, y), height in zip(xy, heights, strict=True):
        start = np.array([x, y, 10.0])
        far = mujoco.mj_ray(model, data, start, np.array([0, 0, -1.0]), groups, 1, -1, np.zeros(1, np.int32))
        assert 10.0 - far == pytest.approx(height, abs=1e-4)
        if height > 0:
            hits += 1
            apart, _ = scenes.distances(scene, np.array([x, y, height]))
            assert apart[1] == pytest.approx(0.0, abs=2e-3)
    assert hits > 1
