"""A result as GLB, read back by a reader written here, by trimesh, and by Khronos' validator where it is."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from simrecon import body as bodies
from simrecon import exports, results
from simrecon import scene as scenes
from simrecon.body import clothed, shape
from simrecon.exports import gltf
from simrecon.exports.axes import TO_Y_UP
from simrecon.geometry import rotations
from simrecon.results import Result
from simrecon.sim.models import compile_text
from simrecon.types import Array, Scene
from tests.support.runs import job_of, person

VALIDATE = """
const validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(require("fs").readFileSync(process.argv[1])))
  .then(report => console.log(JSON.stringify(report.issues)));
"""
TYPES = {5126: np.float32, 5123: np.uint16, 5125: np.uint32, 5121: np.uint8}
SIZES = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Read:
    """A GLB taken apart by the letter of the specification."""

    def __init__(self, content: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size = struct.unpack_from("<I", content, 12)[0]
        self.json: dict[str, Any] = json.loads(content[20 : 20 + size])
        self.data = content[28 + size :]
        self.nodes = self.json["nodes"]

    def array(self, index: int) -> Array:
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        count = accessor["count"] * SIZES[accessor["type"]]
        flat = np.frombuffer(self.data, TYPES[accessor["componentType"]], count, view["byteOffset"])
        return flat.reshape(accessor["count"], -1).astype(float)

    def moved(self, frame: int) -> dict[str, Array]:
        """Transforms (4, 4) node → world by name, at a key of the first animation."""
        changed: dict[tuple[int, str], Array] = {}
        clip = self.json["animations"][0]
        for channel in clip["channels"]:
            sampler = clip["samplers"][channel["sampler"]]
            target = channel["target"]
            changed[target["node"], target["path"]] = self.array(sampler["output"])[frame]
        world: dict[str, Array] = {}

        def place(index: int, parent: Array) -> None:
            node = self.nodes[index]
            pose = np.eye(4)
            turn = np.array(changed.get((index, "rotation"), node.get("rotation", [0, 0, 0, 1])))
            pose[:3, :3] = rotations.matrix(turn[[3, 0, 1, 2]])
            pose[:3, 3] = changed.get((index, "translation"), node.get("translation", [0, 0, 0]))
            world[node["name"]] = parent @ pose
            for child in node.get("children", []):
                place(child, world[node["name"]])

        for root in self.json["scenes"][0]["nodes"]:
            place(root, np.eye(4))
        return world


@pytest.fixture(scope="module")
def finished(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Result:
    folder = tmp_path_factory.mktemp("results") / "squat"
    return results.write(job_of(folder), run)


@pytest.fixture(scope="module")
def read(finished: Result) -> Read:
    (path,) = exports.export(finished, ("glb",))
    return Read(path.read_bytes())


def test_bones_are_where_the_joints_are(finished: Result, read: Read) -> None:
    motion, body = finished.motion, finished.body
    names = [name for name in body.skeleton.names if name in motion.joint_names and name != "head"]
    assert {"pelvis", "left_knee", "right_wrist", "neck"} <= set(names)
    for frame in (0, 4, len(motion.times_s) - 1):
        world = read.moved(frame)
        ours = motion.joints_m[frame, [motion.joint_names.index(name) for name in names]] @ TO_Y_UP.T
        theirs = np.array([world[name][:3, 3] for name in names])
        assert np.linalg.norm(theirs - ours, axis=1).max() < 1e-3


def test_the_clip_has_the_times_of_the_motion(finished: Result, read: Read) -> None:
    (clip,) = read.json["animations"]
    times = read.array(clip["samplers"][0]["input"])[:, 0]
    np.testing.assert_allclose(times, finished.motion.times_s - finished.motion.times_s[0], atol=1e-6)


def test_in_its_own_stance_the_skin_stands_on_the_floor(finished: Result, read: Read) -> None:
    (mesh,) = (m for m in read.json["meshes"] if m["name"] == "person")
    attributes = mesh["primitives"][0]["attributes"]
    vertices = read.array(attributes["POSITION"])
    assert vertices[:, 1].min() == pytest.approx(0.0, abs=1e-6)
    assert np.ptp(vertices[:, 1]) == pytest.approx(finished.body.height_m, abs=0.08)
    np.testing.assert_allclose(read.array(attributes["WEIGHTS_0"]).sum(axis=1), 1.0, atol=1e-6)
    # bound to the pose in which the nodes stand: inverse bind matrices undo it
    bound = read.json["skins"][0]
    inverse = read.array(bound["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    still = Read.__new__(Read)
    still.json, still.data, still.nodes = {**read.json, "animations": [{"channels": []}]}, b"", read.nodes
    world = still.moved(0)
    for joint, matrix in zip(bound["joints"], inverse, strict=True):
        np.testing.assert_allclose(world[read.nodes[joint]["name"]] @ matrix, np.eye(4), atol=1e-5)


def test_posed_as_itself_the_skin_of_a_shape_is_that_of_the_space() -> None:
    space = shape.space()
    betas = np.linspace(-1, 1, space.size)
    built = bodies.build(betas=betas)
    skin = clothed.skin(built)
    np.testing.assert_allclose(skin.vertices_m, space.vertices_m(betas), atol=2e-3)
    stretched = clothed.skin(person())  # measured lengths, no betas: the skin goes with the bones
    np.testing.assert_allclose(stretched.weights.sum(axis=1), 1.0, atol=1e-5)
    assert np.ptp(stretched.vertices_m[:, 2]) == pytest.approx(1.75, abs=0.08)


def test_items_stand_where_the_scene_has_them(finished: Result, tmp_path: Path, run: Any) -> None:
    table = {"name": "bench", "kind": "box", "position_m": [0.5, 0.25, 0.0], "size_m": [0.4, 1.2, 0.45]}
    placed = Scene(items=(scenes.item(table, "test"),))
    opened = results.open_result(finished.folder)
    model = compile_text(scenes.build(run.fit.body.mjcf, placed, 0.01))
    opened.__dict__.update(scene=placed, model=model)
    target = tmp_path / "with"
    (path,) = exports.export(opened, ("glb",), target)
    loaded: Any = trimesh.load_scene(path)
    found = loaded.geometry["bench"]
    corners = trimesh.transform_points(found.vertices, loaded.graph["bench"][0]) @ TO_Y_UP
    np.testing.assert_allclose(corners.min(axis=0), [0.3, -0.35, 0.0], atol=1e-6)
    np.testing.assert_allclose(corners.max(axis=0), [0.7, 0.85, 0.45], atol=1e-6)
    assert set(loaded.geometry) == {"person", "ground", "bench"}
    assert found.volume == pytest.approx(0.4 * 1.2 * 0.45, rel=1e-4)  # faces look outwards
    assert loaded.geometry["person"].volume > 0.04


def test_forces_are_there_as_arrays(finished: Result, read: Read) -> None:
    extras = read.json["scenes"][0]["extras"]["simrecon"]
    force = read.array(extras["contact_force_N"]).reshape(len(finished.motion.times_s), -1, 3)
    assert force.shape[1] == len(extras["contact_body"])
    np.testing.assert_allclose(force.sum(axis=1), finished.motion.grf_N @ TO_Y_UP.T, rtol=1e-4, atol=1e-2)


def test_signs_of_quaternions_do_not_jump(rng: np.random.Generator) -> None:
    quats = rotations.exp(np.linspace([0.0, 0, 0], [0, 0, 9.0], 40))
    mixed = quats * rng.choice([-1.0, 1.0], (40, 1))
    turned = gltf.quaternions(mixed)
    assert ((turned[1:] * turned[:-1]).sum(axis=1) > 0).all()
    np.testing.assert_allclose(rotations.angle_between(turned[:, [3, 0, 1, 2]], quats), 0.0, atol=1e-7)


@pytest.mark.slow
def test_the_validator_of_khronos_finds_nothing(finished: Result) -> None:
    if shutil.which("node") is None:
        pytest.skip("needs node, with the npm package gltf-validator")
    (path,) = exports.export(finished, ("glb",))
    done = subprocess.run(["node", "-e", VALIDATE, str(path)], capture_output=True, text=True, check=False)
    if "Cannot find module" in done.stderr:
        pytest.skip("needs the npm package gltf-validator; NODE_PATH names the folder it is in")
    issues = json.loads(done.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


def test_the_fit_with_the_names_of_a_rig_at_another_rate(finished: Result, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("glb",), tmp_path, rig="mixamo", of="fit", fps=60.0)
    other = Read(path.read_bytes())
    assert "extras" not in other.json["scenes"][0]
    clip = other.json["animations"][0]
    assert len(other.array(clip["samplers"][0]["input"])) == 19
    moved = other.moved(0)
    pelvis = moved["mixamorig:Hips"][:3, 3] @ TO_Y_UP
    assert finished.motion.kinematic_qpos is not None
    np.testing.assert_allclose(pelvis, finished.motion.kinematic_qpos[0, :3], atol=1e-5)
