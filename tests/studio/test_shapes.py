"""Meshes of persons and items, and the camera that is found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics
from simrecon import scene as scenes
from simrecon.body import clothed, shape
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.pipeline import Reconstruction
from simrecon.results import Result
from simrecon.scene import kinds
from simrecon.studio import camera, clip, document, shapes
from simrecon.studio.document import Document
from simrecon.studio.figure import arrows
from simrecon.studio.shapes import Rigged
from simrecon.studio.sight import framed
from simrecon.studio.tab import Tab
from simrecon.types import Array, Body
from tests.support.runs import squat as upright


def posed(rigged: Rigged, places_m: Array, turns: Array) -> Array:
    """Vertices as a browser draws them: linear blending with the weights."""
    now, then = rotations.matrix(turns), rotations.matrix(rigged.turns)
    local = np.einsum("sji,vsj->vsi", then, rigged.mesh.vertices_m[:, None] - rigged.places_m)
    world = np.einsum("sij,vsj->vsi", now, local) + places_m
    return np.einsum("vs,vsi->vi", rigged.weights, world)


def test_primitives_are_where_the_simulator_has_them(squat: Result) -> None:
    seen = clip.of_result(squat)
    poses = clip.poses(seen.body, seen.qpos[:1])
    points = posed(shapes.primitives(seen.body), poses.places_m[0], poses.turns[0])
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.02)
    assert np.ptp(points[:, 2]) == pytest.approx(seen.body.height_m, abs=0.1)


@pytest.mark.parametrize("known", [True, False])
def test_the_skin_fits_its_body(known: bool) -> None:
    """Of a body of the shape space, and the most probable one of another body: as the report draws it."""
    betas = np.zeros(shape.space().size)
    betas[0] = 1.0
    body: Body = bodies.build(betas=betas, height_m=1.8, mass_kg=80.0)
    body = body if known else replace(body, betas=np.zeros(0), shape_space="")
    rigged = shapes.skin(body)
    assert rigged.weights.sum(axis=1) == pytest.approx(1.0)
    assert (rigged.weights > 0).sum(axis=1).max() <= shapes.INFLUENCES
    poses = clip.poses(body, upright(body, np.zeros(1)))
    points = posed(rigged, poses.places_m[0], poses.turns[0])
    assert np.ptp(points[:, 2]) == pytest.approx(1.8, abs=0.03 if known else 0.05)
    np.testing.assert_array_equal(rigged.mesh.vertices_m, clothed.skin(body).vertices_m)


@pytest.mark.parametrize("kind", [kind for kind in document.kinds_to_add() if kind != "mesh"])
def test_every_item_has_a_mesh_in_its_own_frame(kind: str) -> None:
    opened = Document("")
    item = opened.item(opened.add(kind, (3.0, 2.0, 0.5)))
    mesh = shapes.item_mesh(item, ".")
    low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    assert 0.0 <= low[2] + 1e-6 <= 0.011  # foam as it is drawn: its tiles
    assert np.abs(low[:2] + high[:2]).max() < 0.6  # a chair's back and a frame stand out
    assert mesh.faces.max() < len(mesh.vertices_m)
    assert kinds.table()[item.kind].name == item.kind
    assert scenes.support_height(opened.scene, np.array([3.0, 2.0])) <= 0.5 + high[2] + 1e-6


def test_arrows_are_the_forces_of_the_frame(squat: Result) -> None:
    seen = clip.of_result(squat)
    assert arrows(seen, 0)[:, :, 2].max() < -10.0
    shown = arrows(seen, 5)
    assert len(shown) >= 1
    assert shown[:, 1, 2].max() > 0.1


def test_a_camera_that_nothing_says_is_found_again(run: Reconstruction, tab: Tab) -> None:
    seen = tab.clip
    assert seen is not None
    assert run.evidence.camera is not None
    blind = replace(run.evidence, camera=replace(run.evidence.camera, path=None))
    found, known = (camera.of(tab.job_of_base, seen, evidence) for evidence in (blind, run.evidence))
    assert found is not None
    assert known is not None
    assert (found.found, known.found) == (True, False)
    assert found.pose(0)[0] == pytest.approx(known.pose(0)[0], abs=0.5)  # a hasty fit is beside the truth
    points = kinematics.configurations(seen.body, seen.asked_qpos)[1]
    off = [
        np.linalg.norm(cameras.project(one.camera, points) - run.evidence.keypoints_px, axis=-1).mean()
        for one in (found, known)
    ]
    assert off[0] <= off[1]
    assert found.video is None
    assert camera.images(found, seen.times_s) == []
    assert known.fov_rad == pytest.approx(2 * np.arctan(240 / 600))
    assert camera.of(tab.job_of_base, seen, replace(run.evidence, camera=None)) is None


def test_a_video_behind_the_view_is_not_distorted() -> None:
    image = np.zeros((40, 30, 3), np.uint8)
    for aspect in (2.0, 0.75, 0.3):
        page = framed(image, aspect)
        assert page.shape[1] / page.shape[0] == pytest.approx(aspect, rel=0.03)
        assert (page == 0).all(axis=-1).sum() == 40 * 30
