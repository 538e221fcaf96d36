"""Meshes from files: what stands for them, and what is refused."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.scene import edit, mesh_shapes, meshes
from simrecon.types import Scene

BODY = """
<mujoco><worldbody><body name="pelvis" pos="0 0 3"><freejoint/>
<geom name="ball" type="sphere" size="0.05" mass="5"/></body></worldbody></mujoco>
"""
NEEDS_COACD = pytest.mark.skipif(
    importlib.util.find_spec("coacd") is None, reason="convex parts need the extra mesh"
)


def scene_of(folder: Path, mesh: trimesh.Trimesh, suffix: str = ".stl", **values: object) -> Scene:
    mesh.export(folder / f"shape{suffix}")
    lines = "\n".join(f"{key} = {value!r}" for key, value in values.items())
    text = f'[[item]]\nname = "m"\nkind = "mesh"\nposition_m = [0, 0, 0]\nfile = "shape{suffix}"\n{lines}\n'
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return scenes.read(path)


def tops(scene: Scene, xy: list[tuple[float, float]]) -> list[float]:
    """Heights at which rays from above hit the simulated scene."""
    model = mujoco.MjModel.from_xml_string(scenes.build(BODY, scene, 0.01))
    data = mujoco.MjData(model)
    data.qpos[0] = 50.0
    mujoco.mj_forward(model, data)
    hit = np.zeros(1, np.int32)
    down = np.array([0.0, 0.0, -1.0])
    return [10 - mujoco.mj_ray(model, data, np.array([x, y, 10.0]), down, None, 1, -1, hit) for x, y in xy]


def hollow() -> trimesh.Trimesh:
    """A square table: a top on two walls, 1 m × 1 m × 0.5 m, closed."""
    from_above = [(-0.5, 0), (-0.5, 0.5), (0.5, 0.5), (0.5, 0), (0.4, 0), (0.4, 0.4), (-0.4, 0.4), (-0.4, 0)]
    x, z = np.array(from_above).T
    front = np.stack((x, np.full(8, -0.5), z), axis=1)
    corners = np.concatenate((front, front + np.array([0, 1, 0])))
    caps = [(0, 7, 6), (0, 6, 1), (1, 6, 5), (1, 5, 2), (2, 5, 4), (2, 4, 3)]
    sides = [(i, (i + 1) % 8) for i in range(8)]
    faces = [*caps, *[(c + 8, b + 8, a + 8) for a, b, c in caps]]
    faces += [f for a, b in sides for f in ((a, b, b + 8), (a, b + 8, a + 8))]
    mesh = trimesh.Trimesh(corners, faces)
    mesh.fix_normals()
    assert mesh.is_watertight
    return mesh


def test_a_hull_stands_on_the_floor(tmp_path: Path) -> None:
    cone = trimesh.creation.cone(0.5, 1.0)
    cone.apply_translation([3, 4, 5])
    scene = scene_of(tmp_path, cone, scale=2.0)
    assert tops(scene, [(0.01, 0), (0.5, 0), (1.5, 0)]) == pytest.approx([2.0, 1.0, 0.0], abs=0.04)
    heights = scenes.support_height(scene, np.array([[0, 0], [0.5, 0], [1.5, 0]]))
    np.testing.assert_allclose(heights, [2.0, 1.0, 0.0], atol=0.03)
    apart, normal = scenes.distances(scene, np.array([[0.0, 0.0, 2.3], [0.0, 0.0, 0.1]]))
    assert apart[1, 0] == pytest.approx(0.3 / np.sqrt(5), abs=0.02)
    assert apart[1, 1] == pytest.approx(-0.1, abs=0.01)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0, atol=1e-9)


def test_y_up_files(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.2, 0.8, 0.4))
    scene = scene_of(tmp_path, box, ".obj", up="y")
    assert tops(scene, [(0, 0), (0, 0.19), (0, 0.21)]) == pytest.approx([0.8, 0.8, 0.0], abs=1e-6)


def test_a_height_field_follows_the_surface(tmp_path: Path) -> None:
    grid = np.linspace(-1, 1, 21)
    x, y = np.meshgrid(grid, grid)
    points = np.stack((x, y, 0.2 + 0.1 * np.sin(3 * x) * np.cos(2 * y)), axis=-1).reshape(-1, 3)
    index = np.arange(441).reshape(21, 21)
    a, b, c, d = (q.ravel() for q in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    mesh = trimesh.Trimesh(points, np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1))))
    assert not mesh.is_watertight
    scene = scene_of(tmp_path, mesh, ".ply", method="height", cells=60)
    xy = [(0.0, 0.0), (0.5, 0.3), (-0.5, -0.3), (0.9, 0.9)]
    low = points[:, 2].min()
    expected = [0.2 + 0.1 * np.sin(3 * x) * np.cos(2 * y) - low for x, y in xy]
    assert tops(scene, xy) == pytest.approx(expected, abs=0.01)
    np.testing.assert_allclose(scenes.support_height(scene, np.array(xy)), expected, atol=0.01)
    on = np.array([[x, y, z] for (x, y), z in zip(xy, expected, strict=True)])
    np.testing.assert_allclose(scenes.distances(scene, on)[0][1], 0.0, atol=0.01)
    np.testing.assert_allclose(scenes.distances(scene, on + np.array([0, 0, 0.05]))[0][1], 0.05, atol=0.015)


@NEEDS_COACD
def test_parts_leave_the_hollow_open(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, hollow(), method="parts")
    assert tops(scene, [(0, 0), (0.45, 0)]) == pytest.approx([0.5, 0.5], abs=0.02)
    apart = scenes.distances(scene, np.array([[0.0, 0.0, 0.2], [0.45, 0.0, 0.2]]))[0][1]
    assert apart[0] > 0.15
    assert apart[1] < 0
    assert "convex parts" in meshes.note(scene.items[0], scene.folder)


def test_without_the_extra_parts_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"needs coacd: .*'hull' or 'height'"):
        scene_of(tmp_path, hollow(), method="parts")


@pytest.fixture(scope="module")
def fine() -> trimesh.Trimesh:
    """A sphere of more than 100,000 triangles."""
    return trimesh.creation.uv_sphere(0.5, count=[240, 240])


@pytest.mark.parametrize("method", ["hull", "height"])
def test_a_hundred_thousand_triangles(tmp_path: Path, fine: trimesh.Trimesh, method: str) -> None:
    assert len(fine.faces) > 100_000
    scene = scene_of(tmp_path, fine, ".ply", method=method)
    assert tops(scene, [(0, 0)]) == pytest.approx([1.0], abs=0.02)
    note = meshes.note(scene.items[0], scene.folder)
    assert note.startswith(f"{len(fine.faces)} triangles, ")
    assert ("64 vertices" in note) == (method == "hull")


def test_simplification_keeps_the_shape(fine: trimesh.Trimesh) -> None:
    vertices, faces = mesh_shapes.simplified(np.asarray(fine.vertices), np.asarray(fine.faces))
    assert len(faces) <= mesh_shapes.MAX_TRIANGLES
    np.testing.assert_allclose(np.linalg.norm(vertices[np.unique(faces)], axis=1), 0.5, atol=0.01)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"file": "../outside.stl"}, ("'../outside.stl' is outside the scene's folder",)),
        ({"file": "/etc/passwd"}, ("outside the scene's folder",)),
        ({"file": "none.stl"}, ("'none.stl'", "no such file")),
        ({"file": "scene.toml"}, ("unknown format", ".stl, .obj")),
        ({"file": "text.stl"}, ("text.stl", "no finite triangles")),
        ({"file": "flat.ply"}, ("flat", "no volume")),
        ({"file": "box.stl", "method": "hul"}, ("found 'hul'", "did you mean 'hull'", "hull, parts, height")),
        ({"file": "box.stl", "scale": -1}, ("scale", "above 0", "-1")),
        ({"file": "box.stl", "cells": 2.5}, ("cells", "whole number", "2.5")),
        ({"method": "hull"}, ("lacks the key 'file'",)),
    ],
)
def test_bad_meshes_are_one_clear_line(
    tmp_path: Path, values: dict[str, object], words: tuple[str, ...]
) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "outside.stl")
    trimesh.creation.box((1, 1, 1)).export(inside / "box.stl")
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]]).export(
        inside / "flat.ply"
    )
    (inside / "text.stl").write_text("no mesh", encoding="utf-8")
    lines = "\n".join(f"{key} = {value!r}" for key, value in values.items())
    text = f'[[item]]\nname = "m"\nkind = "mesh"\nposition_m = [0, 0, 0]\n{lines}\n'
    (inside / "scene.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        scenes.read(inside / "scene.toml")
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_a_scene_that_is_written_elsewhere_names_the_folder_of_its_meshes(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside" / "room.toml"
    inside.mkdir()
    outside.parent.mkdir()
    scene = scene_of(inside, trimesh.creation.box((1, 1, 1)))
    scenes.write(scene, outside)
    for moved in (scenes.read(outside), scenes.parse(scenes.dumps(scene), outside)):
        assert (moved, moved.folder) == (scene, str(inside))
        assert tops(moved, [(0, 0)]) == pytest.approx([1.0])
    scenes.write(scene, inside / "again.toml")
    assert "folder" not in (inside / "again.toml").read_text(encoding="utf-8")
    outside.write_text("folder = 3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"room.toml: folder must be a path in quotes, found 3"):
        scenes.read(outside)


def test_a_folder_whose_name_is_no_text_is_kept_in_a_scene(tmp_path: Path) -> None:
    place, elsewhere = tmp_path / os.fsdecode(b"caf\xe9"), tmp_path / "result"
    for folder in (place, elsewhere):
        folder.mkdir()
    scene = scene_of(place, trimesh.creation.box((1.0, 1.0, 1.0)))
    scenes.write(scene, elsewhere / "scene.toml")
    again = scenes.read(elsewhere / "scene.toml")
    assert Path(again.folder) == place.resolve()
    edited = edit.Edited.read(elsewhere / "scene.toml")
    edited.set("m", "yaw_rad", 0.5)
    assert Path(edited.save().folder) == place.resolve()


@NEEDS_COACD
def test_parts_need_a_watertight_mesh(tmp_path: Path) -> None:
    mesh = hollow()
    mesh.update_faces(np.arange(len(mesh.faces)) > 2)
    with pytest.raises(InputError, match=r"not watertight.*'hull' and 'height'"):
        scene_of(tmp_path, mesh, method="parts")
