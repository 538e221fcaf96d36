"""Snapping, and what a stiffness means."""

from __future__ import annotations

import math

import numpy as np
import pytest

from simrecon import scene as scenes
from simrecon.studio import placing
from simrecon.studio.furnishing import floor_image
from simrecon.studio.gizmo import SIDES, corner_of, moved, sized
from simrecon.types import Ground, Scene, SceneItem


def item(kind: str, **values: object) -> SceneItem:
    table = {"name": kind, "kind": kind, "position_m": [0.0, 0.0, 0.0], **values}
    return scenes.item(table, "test")


def test_places_snap_to_a_centimetre_and_turns_to_five_degrees() -> None:
    assert placing.snapped_place((0.1249, -0.336, 0.0)) == (0.12, -0.34, 0.0)
    assert math.degrees(placing.snapped_turn(math.radians(92.4))) == pytest.approx(90.0, abs=1e-3)
    assert math.degrees(placing.snapped_turn(math.radians(358.0))) == pytest.approx(0.0, abs=1e-3)


def test_an_item_stands_on_a_sloped_floor() -> None:
    scene = Scene(Ground(0.2, slope_rad=math.atan(0.1)), (item("box", size_m=[1.0, 1.0, 1.0]),))
    assert placing.on_floor(scene, 2.0, 0.0) == pytest.approx(0.4, abs=2e-3)


def test_a_stiffness_is_explained_by_how_far_a_person_sinks() -> None:
    assert placing.ground_words(Ground(stiffness_Npm=20000.0, damping_Nspm=400.0)) == (
        "20000 N/m: a 70 kg person sinks 34 mm"
    )
    assert "hard" in placing.ground_words(Ground())
    assert "fitted" in placing.ground_words(Ground(calibrate=True))
    assert placing.item_words(item("trampoline")).endswith("sinks 137 mm in the middle")
    assert "under two soles" in placing.item_words(item("mat"))
    assert placing.item_words(item("chair")) == ""


def test_the_gizmo_moves_and_turns_an_item_snapped_and_on_the_floor() -> None:
    chair, half = item("chair"), math.radians(43.0) / 2
    turn = (math.cos(half), 0.0, 0.0, math.sin(half))
    values = moved(chair, Scene(Ground(0.1)), (0.504, 0.0, 3.0), turn, True, True)
    assert values == {"position_m": [0.5, 0.0, 0.1], "yaw_rad": round(math.radians(45.0), 4)}
    free = moved(chair, Scene(), (0.5041, 0.0, 0.3333), (1.0, 0.0, 0.0, 0.0), False, False)
    assert free == {"position_m": [0.5041, 0.0, 0.3333]}
    assert moved(chair, Scene(), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), True, True) == {}


@pytest.mark.parametrize("kind", ["box", *SIDES])
def test_the_corner_makes_an_item_larger(kind: str) -> None:
    """Turned by 90°, along its own x; where the corner is, nothing changes."""
    more: dict[str, object] = {"size_m": [0.4, 1.2, 0.4]} if kind == "box" else {}
    more = {"length_m": 2.0, "width_m": 0.1, "height_m": 0.1} if kind == "beam" else more
    thing = item(kind, yaw_rad=math.pi / 2, **more)
    corner = corner_of(thing)
    assert corner is not None
    assert sized(thing, corner, False) == {}
    wanted = sized(thing, corner + np.array([0.0, 0.05, 0.0]), False)
    if kind == "box":
        assert wanted == {"size_m": [0.5, 1.2, 0.4]}
        return
    name = SIDES[kind][0]
    assert wanted == {name: pytest.approx(float(str(thing.parameters[name])) + 0.1)}
    least = sized(thing, corner - np.array([0.0, 99.0, 0.0]), True)[name]
    assert scenes.item({**scene_table(thing), name: least}, "test").parameters[name] == least


def scene_table(thing: SceneItem) -> dict[str, object]:
    return {"name": "x", "kind": thing.kind, "position_m": [0, 0, 0], **thing.parameters}


def test_a_ball_has_no_corner() -> None:
    assert corner_of(item("ball", radius_m=0.2)) is None
    assert sized(item("ball", radius_m=0.2), (1.0, 1.0, 1.0), True) == {}


def test_the_floor_has_lines() -> None:
    image = floor_image((200, 200, 200))
    assert image.shape[0] == image.shape[1]
    assert [int(image[row, 90, 0]) for row in (90, 0, 20)] == [200, 152, 188]
