"""Meshes of strangers: what they name is not opened, and what they do to their parser costs a line."""

from __future__ import annotations

import base64
import json
import os
import time
from pathlib import Path
from typing import Any

import pytest
import trimesh

from simrecon import resources
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.io import foreign
from simrecon.scene import kinds, meshes
from simrecon.sim import models

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 2 4\nf 2 3 4\n"
PLY = (
    "ply\nformat ascii 1.0\ncomment TextureFile pipe.png\nelement vertex 4\nproperty float x\n"
    "property float y\nproperty float z\nproperty float s\nproperty float t\nelement face 2\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 0 0 0\n1 0 0 0 0\n0 1 0 0 0\n0 0 1 0 0\n3 0 1 2\n3 0 1 3\n"
)
LINE = '[[item]]\nname = "m"\nkind = "mesh"\nposition_m = [0, 0, 0]\nfile = "{}"\n'


def gltf(uri: str, nodes: list[dict[str, Any]] | None = None) -> str:
    """A glTF of one triangle, whose numbers are at an address."""
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "buffers": [{"uri": uri, "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": nodes or [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            "scene": 0,
        }
    )


def read(folder: Path, name: str, content: str) -> Any:
    """Vertices and triangles, or what is said."""
    (folder / name).write_text(content, encoding="utf-8")
    try:
        return meshes._raw(str(folder / name), 0, "item (m)")
    except InputError as error:
        return str(error)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.obj", f"mtllib pipe.mtl\n{TETRAHEDRON}", ""),
        ("a.ply", PLY, ""),
        ("a.gltf", gltf("pipe.bin"), "not a regular file"),
        ("a.gltf", gltf("pipe.mtl"), "names 'pipe.mtl', which is no .bin file"),
    ],
)
def test_a_pipe_that_a_mesh_names_is_not_waited_for(
    tmp_path: Path, name: str, content: str, said: str
) -> None:
    for pipe in ("pipe.mtl", "pipe.png", "pipe.bin"):
        os.mkfifo(tmp_path / pipe)
    began = time.perf_counter()
    found = read(tmp_path, name, content)
    assert said in found if said else len(found[0]) == 4
    assert time.perf_counter() - began < 10.0


def test_a_mesh_names_no_file_of_another_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    (inside / "link.bin").symlink_to(tmp_path / "secret.bin")
    for uri in ("../secret.bin", str(tmp_path / "secret.bin"), "link.bin"):
        assert "which is no .bin file in its folder" in read(inside, "a.gltf", gltf(uri))


def test_a_gltf_with_its_buffer_beside_it_is_read(tmp_path: Path) -> None:
    for name, content in trimesh.creation.box((1, 2, 3)).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    vertices, faces = meshes._raw(str(tmp_path / "model.gltf"), 0, "item (m)")
    assert (vertices.shape, faces.shape) == ((8, 3), (12, 3))


def test_nodes_that_double_forty_times_cost_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign, "SECONDS", 2.0)
    nodes: list[dict[str, Any]] = [{"children": [2 * i + 1, 2 * i + 2]} for i in range(60_000)]
    nodes += [{"mesh": 0} for _ in range(60_001)]
    data = "data:application/octet-stream;base64," + base64.b64encode(bytes(36)).decode()
    began = time.perf_counter()
    assert isinstance(read(tmp_path, "a.gltf", gltf(data, nodes)), str)
    assert time.perf_counter() - began < 15.0


@pytest.mark.parametrize("number", ["1e308", "1e7"])
def test_a_mesh_larger_than_a_scene_is_refused(tmp_path: Path, number: str) -> None:
    text = TETRAHEDRON.replace("v 1 0 0", f"v {number} 0 0")
    (tmp_path / "a.obj").write_text(text, encoding="utf-8")
    (tmp_path / "scene.toml").write_text(LINE.format("a.obj"), encoding="utf-8")
    with pytest.raises(InputError, match=r"'a.obj' is 1e\+\d+ m large; valid: up to 1000 m"):
        scenes.read(tmp_path / "scene.toml")


def test_every_scene_is_made_of_elements_that_a_result_may_have(tmp_path: Path) -> None:
    """No kind of item makes a model that could not be read back."""
    body = "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "box.stl")
    plain = {"number": "1.0", "vector": "[1.0, 1.0, 1.0]", "count": "3", "flag": "false", "text": '"box.stl"'}
    for name in resources.toml("models", "scene", "kinds.toml"):
        needed = [one for one in kinds.kind(name, "here").parameters if one.default is None]
        lines = "".join(f"{one.name} = {plain[one.type]}\n" for one in needed)
        for ground in ("", "[ground]\nstiffness_Npm = 30000.0\ndamping_Nspm = 100.0\n"):
            text = f'{ground}[[item]]\nname = "i"\nkind = "{name}"\nposition_m = [3, 0, 0]\n{lines}'
            (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
            made = scenes.build(body, scenes.read(tmp_path / "scene.toml"), 0.01)
            models.check(made, name)
