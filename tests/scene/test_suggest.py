"""Supports that a motion needs."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import scene as scenes
from simrecon.geometry import rotations
from simrecon.scene.suggest import Suggestion, suggest
from simrecon.types import Array, Body, Scene, SceneItem

FRAME_S = 1 / 30


@pytest.fixture(scope="module")
def person() -> Body:
    return bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0, sole_m=0.02)


def pose(person: Body, *, flexed: float = 0.0, pitch: float = 0.0) -> Array:
    """Hips and knees flexed alike, 0 to a right angle, the whole body pitched; soles on z = 0."""
    names = person.skeleton.names[1:]
    turns = np.zeros((len(names), 3))
    for row, name in enumerate(names):
        turns[row, 1] = {"hip": -flexed, "knee": flexed}.get(name.split("_")[-1], 0.0)
    joints = rotations.multiply(rotations.conjugate(person.skeleton.rest[1:]), rotations.exp(turns))
    root = rotations.exp(np.array([0.0, pitch, 0.0]))
    qpos = np.concatenate((np.zeros(3), root, joints.ravel()))
    model = mujoco.MjModel.from_xml_string(person.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    reach = np.abs(data.geom_xmat.reshape(-1, 3, 3)[:, 2] * model.geom_size).sum(axis=1)
    boxes = [model.geom(f"{side}_foot").id for side in ("left", "right")]
    qpos[2] = -(data.geom_xpos[boxes, 2] - reach[boxes]).min()
    return qpos


def lift(qpos: Array, *, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    return qpos + np.concatenate(([x, y, z], np.zeros(len(qpos) - 3)))


def held(seconds: float, qpos: Array) -> Array:
    return np.tile(qpos, (round(seconds / FRAME_S), 1))


def between(seconds: float, first: Array, last: Array) -> Array:
    share = np.linspace(0, 1, round(seconds / FRAME_S))[:, None]
    mixed = (1 - share) * first + share * last
    quats = mixed[:, 3:].reshape(len(mixed), -1, 4)
    mixed[:, 3:] = (quats / np.linalg.norm(quats, axis=-1, keepdims=True)).reshape(len(mixed), -1)
    return mixed


def suggested(person: Body, scene: Scene, *pieces: Array) -> tuple[Suggestion, ...]:
    qpos = np.concatenate(pieces)
    return suggest(person, scene, FRAME_S * np.arange(len(qpos), dtype=float), qpos)


def size_m(item: SceneItem) -> tuple[float, float, float]:
    size = item.parameters["size_m"]
    assert isinstance(size, tuple)
    return size


def sitting_down(person: Body) -> tuple[Array, ...]:
    up, down = pose(person), lift(pose(person, flexed=np.pi / 2), x=-0.4)
    return held(1.0, up), between(0.5, up, down), held(1.2, down), between(0.5, down, up), held(1.0, up)


def test_a_pelvis_at_rest_needs_a_seat(person: Body) -> None:
    (seat,) = suggested(person, Scene(), *sitting_down(person))
    assert seat.item.name == "seat"
    assert seat.item.kind == "chair"
    assert seat.item.parameters["back"] is False
    (span,) = seat.spans
    assert span[0] == pytest.approx(45, abs=6)
    assert span[1] == pytest.approx(81, abs=6)
    scene = Scene(items=(seat.item,))
    pelvis = lift(pose(person, flexed=np.pi / 2), x=-0.4)[:3]
    top = float(scenes.support_height(scene, pelvis[:2]))
    assert 0.3 < top < 0.45
    assert "rests 1 time" in seat.why
    # it bears the buttocks, and the calves are in front of it
    model = mujoco.MjModel.from_xml_string(scenes.build(person.mjcf, scene, 0.01))
    data = mujoco.MjData(model)
    data.qpos[:] = lift(pose(person, flexed=np.pi / 2), x=-0.4, z=-0.005)
    mujoco.mj_forward(model, data)
    touching = {model.geom(g).name for pair in data.contact.geom for g in pair}
    assert {"item/seat/seat", "left_buttock", "right_buttock"} <= touching
    assert not touching & {"left_calf", "left_shin"}


def test_nothing_is_suggested_where_a_seat_is_known(person: Body) -> None:
    (seat,) = suggested(person, Scene(), *sitting_down(person))
    assert suggested(person, Scene(items=(seat.item,)), *sitting_down(person)) == ()


def test_standing_walking_and_lying_on_the_floor_need_nothing(person: Body) -> None:
    up = pose(person)
    walk = np.concatenate([between(0.3, lift(up, x=0.3 * i), lift(up, x=0.3 * (i + 1))) for i in range(5)])
    lying = pose(person, pitch=-np.pi / 2)
    lying[2] = 0.12
    squat = pose(person, flexed=1.2)
    assert suggested(person, Scene(), held(1.0, up), walk) == ()
    assert suggested(person, Scene(), held(2.0, lying)) == ()
    assert suggested(person, Scene(), held(0.5, up), between(0.3, up, squat), between(0.3, squat, up)) == ()


def test_lying_at_a_height_needs_a_bed(person: Body) -> None:
    lying = pose(person, pitch=-np.pi / 2)
    lying[2] = 0.62
    (bed,) = suggested(person, Scene(), held(2.0, lying))
    assert bed.item.name == "bed"
    assert size_m(bed.item)[2] == pytest.approx(0.5, abs=0.05)
    assert size_m(bed.item)[0] == 2.0


def test_feet_in_a_row_over_the_floor_need_a_beam(person: Body) -> None:
    narrow = pose(person)
    steps = [held(0.4, lift(narrow, x=0.6 * i, z=0.06)) for i in range(4)]
    moves = [between(0.2, steps[i][0], steps[i + 1][0]) for i in range(3)]
    pieces = [steps[0], *(piece for pair in zip(moves, steps[1:], strict=True) for piece in pair)]
    (beam,) = suggested(person, Scene(), *pieces)
    height = beam.item.parameters["height_m"] if beam.item.kind == "beam" else size_m(beam.item)[2]
    assert height == pytest.approx(0.06, abs=0.005)
    places = np.array([[0.6 * i, 0.0] for i in range(4)])
    np.testing.assert_allclose(scenes.support_height(Scene(items=(beam.item,)), places), 0.06, atol=0.005)
    assert len(beam.spans) == 8
    assert "60 to 60 mm" in beam.why


def test_a_step_is_where_the_feet_are_up(person: Body) -> None:
    up = pose(person)
    high = lift(up, x=0.5, z=0.2)
    (step,) = suggested(person, Scene(), held(1.0, up), between(0.4, up, high), held(1.0, high))
    scene = Scene(items=(step.item,))
    heights = scenes.support_height(scene, np.array([[0.55, 0.0], [0.0, 0.0]]))
    np.testing.assert_allclose(heights, [0.2, 0.0], atol=0.005)


def test_names_are_not_taken(person: Body) -> None:
    other = scenes.item(
        {"name": "seat", "kind": "box", "position_m": [9.0, 0.0, 0.0], "size_m": [1.0, 1.0, 1.0]}, "test:"
    )
    (seat,) = suggested(person, Scene(items=(other,)), *sitting_down(person))
    assert seat.item.name == "seat_2"


@pytest.mark.slow
def test_the_bench_of_the_sit_to_stand_clip(
    shared_data: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Five rises from a bench of 0.40 to 0.45 m: six rests, at one place."""
    from simrecon import cli

    clip = shared_data / "evidence" / "opencap_STS_wham.npz"
    assert cli.main(["scene", "suggest", str(clip), "-o", str(tmp_path / "s.toml")]) == 0
    assert "rests 6 times" in capsys.readouterr().out
    (seat,) = scenes.read(tmp_path / "s.toml").items
    height_m = seat.parameters["seat_height_m"]
    assert isinstance(height_m, float)
    assert 0.38 < height_m < 0.48


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["cam01", "cam03"])
def test_the_beam_of_a_walk(camera: str, shared_data: Path, tmp_path: Path) -> None:
    """By one camera; the person's height is that of the data's publisher (`contact.toml`).

    The beam's top is 0.065 m high, at y = -0.016, by its edges in both videos.
    """
    from simrecon import cli

    clip = shared_data / "evidence" / f"pose2sim_beam_{camera}.npz"
    target = tmp_path / "s.toml"
    assert cli.main(["scene", "suggest", str(clip), "--height-m", "1.72", "-o", str(target)]) == 0
    (beam,) = scenes.read(target).items
    assert beam.kind == "beam"
    assert beam.parameters["height_m"] == pytest.approx(0.065, abs=0.02)
    assert beam.position_m[1] == pytest.approx(-0.016, abs=0.05)
