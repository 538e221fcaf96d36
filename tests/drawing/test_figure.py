"""The person drawn in their skin: where it is, what it hides, and what is marked."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from simrecon.body import clothed, shape
from simrecon.body import skin as skins
from simrecon.drawing import canvas, figure, geoms
from simrecon.drawing.painter import TOUCHES, Painter
from simrecon.drawing.views import View
from simrecon.results import writing
from simrecon.sim.poses import posed


@pytest.fixture(scope="module")
def painter(run: Any) -> Painter:
    return Painter(writing.animation(run))


def test_the_skin_follows_the_bodies_by_linear_blend_skinning(run: Any) -> None:
    model, skin = run.problem.model, clothed.skin(run.fit.body)
    worn = figure.Worn.of(model, skin)
    data = next(posed(model, run.motion.qpos[5:6]))
    turn = data.xmat[worn.bodies].reshape(-1, 3, 3) @ np.swapaxes(skin.axes, 1, 2)  # (S, 3, 3)
    shift = data.xpos[worn.bodies] - np.einsum("sij,sj->si", turn, skin.origins_m)
    expected = np.einsum("vs,sij,vj->vi", skin.weights, turn, skin.vertices_m) + skin.weights @ shift
    np.testing.assert_allclose(worn.place(data), expected, atol=1e-6)


def test_of_a_shape_it_is_the_skin_that_body_poses() -> None:
    space, betas = shape.space(), np.linspace(-1, 1, shape.space().size)
    origins, axes = space.frames(betas)
    np.testing.assert_allclose(skins.posed(space, betas, origins, axes), space.vertices_m(betas), atol=1e-9)


def test_normals_of_a_skin_look_outwards_and_change_little_from_face_to_face(painter: Painter) -> None:
    painter._pose(0)
    drawn = painter.person
    vertices = drawn.place(painter.data)
    normals, corners = drawn.normals(vertices), vertices[drawn.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((normals * flat).sum(axis=1) > 0).mean() > 0.98
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)


def test_faces_belong_to_the_primitive_that_they_cover(run: Any, painter: Painter) -> None:
    model, drawn = run.problem.model, painter.person
    foot = model.geom("left_foot").id
    painter._pose(0)
    own = drawn.place(painter.data)[np.flatnonzero(drawn.vertex_geom == foot)]
    assert len(own) > 50
    assert np.linalg.norm(own - painter.data.geom_xpos[foot], axis=1).max() < 0.25
    assert {"left_hand", "skull", "right_thigh"} <= {model.geom(i).name for i in np.unique(drawn.face_geom)}


def test_what_the_scene_pushes_is_marked_on_the_skin(run: Any) -> None:
    frame = len(run.motion.times_s) - 1
    size = (320, 240)
    view = View(np.zeros(2), np.array(size) / (640, 480), size)
    for style in clothed.STYLES:
        image = Painter(writing.animation(run, style)).draw(
            frame, view, np.full((240, 320, 3), 200, np.uint8)
        )
        hue = image.astype(int) @ np.array([-1, -1, 2])  # red against blue and green
        assert (hue[150:] > 0.5 * np.array(TOUCHES) @ [-1, -1, 2]).sum() > 10, style


@pytest.mark.slow
def test_a_frame_of_a_skin_takes_at_most_40_ms(painter: Painter) -> None:
    size = (960, 540)
    scale = np.array(size) / painter.camera.lens.image_size_px
    view, image = View(np.zeros(2), scale, size), np.zeros((540, 960, 3), np.uint8)
    start = time.process_time()
    for _ in range(20):
        painter.draw(3, view, image.copy())
    assert (time.process_time() - start) / 20 < 0.04


def test_areas_are_negative_from_behind() -> None:
    square = np.array([[[0.0, 0], [0, 2], [3, 2], [3, 0]]])  # counter-clockwise as seen, y down
    assert canvas.areas(square) == pytest.approx([6.0])
    assert canvas.areas(square[:, ::-1]) == pytest.approx([-6.0])


def test_colours_blend_from_side_to_side(run: Any) -> None:
    tones = figure._tones(clothed.skin(run.fit.body))
    vertices = clothed.skin(run.fit.body).vertices_m
    assert tones[vertices[:, 1].argmax()] == pytest.approx(geoms.LEFT, abs=2)
    assert tones[vertices[:, 1].argmin()] == pytest.approx(geoms.RIGHT, abs=2)
