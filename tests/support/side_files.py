"""A small whole file of what is neither evidence nor `own_files`, with what reads it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from simrecon import resources
from simrecon.bench import execution, suite
from simrecon.contact import wishes
from simrecon.engines import checkpoint
from simrecon.evaluation import fitted
from simrecon.evidence import opensim
from simrecon.evidence.camera import files as cameras
from simrecon.evidence.options import Options
from simrecon.evidence.video import kept
from simrecon.evidence.video.blazepose import COUNT
from simrecon.evidence.video.kept import Detection
from simrecon.io.foreign import mesh
from simrecon.metrics import truth
from simrecon.scene.edit import Edited
from simrecon.studio import journal
from simrecon.studio.document import Edits
from simrecon.types import ContactWish, Window
from tests.support import foreign_files as foreign
from tests.support import runs
from tests.support.corpus import Sample
from tests.support.window_results import solved

CONTACTS = """schema = "simrecon.contacts/1"
[left_heel]
mode = "always"
found = [[0.1, 0.4]]
touch = [[0.0, 0.2], [0.5, 0.7]]
free = [[0.2, 0.3]]
"""
CALIBRATION = """[cam_1]
name = "cam_1"
size = [1000.0, 800.0]
matrix = [[900.0, 0.0, 499.5], [0.0, 900.0, 399.5], [0.0, 0.0, 1.0]]
distortions = [0.1, 0.0, 0.0, 0.0]
rotation = [1.2, 0.1, -0.3]
translation = [0.1, 0.2, 4.0]
fisheye = false
"""
CALISCOPE = CALIBRATION.replace("[cam_1]", "[cameras.1]").replace("fisheye = false", "ignore = false")
MESHES = ("stl", "obj", "ply", "off", "glb", "gltf")
WINDOW = Window(0, 0, 2, 4)
_ROWS = "\n".join(f"{t / 100}\t{t}\t0.5\t2" for t in range(12))
FORCES = f"forces\nnRows=12\nnColumns=4\ninDegrees=no\nendheader\ntime\tF_vx\tF_vy\tF_vz\n{_ROWS}\n"


def made(folder: Path) -> list[Sample]:
    """Files of all kinds, each in a folder of its own."""
    samples = [_text(folder, *row) for row in TEXTS]
    samples += [Sample(f"{kind} mesh", _mesh(folder / kind, kind), Options(), _parsed) for kind in MESHES]
    for name, (make, read) in MAKERS.items():
        place = folder / name
        place.mkdir(parents=True)
        samples.append(Sample(name, make(place), Options(), read))
    return samples


def _text(folder: Path, name: str, text: str, read: Callable[[Path], Any]) -> Sample:
    place = folder / name.replace(" ", "_")
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(text, encoding="utf-8")
    return Sample(name, place, Options(), read)


def _mesh(folder: Path, kind: str) -> Path:
    folder.mkdir(parents=True)
    box: Any = trimesh.creation.box((0.2, 0.8, 0.4))
    if kind != "gltf":
        return _written(folder / f"box.{kind}", box.export(file_type=kind))
    for name, content in box.export(file_type="gltf").items():
        _written(folder / name, content)
    return folder


def _written(path: Path, content: Any) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def _parsed(path: Path) -> None:
    """A mesh, as its own process reads it; that turns whatever is raised into a line."""
    file = next(path.glob("*.gltf")) if path.is_dir() else path
    try:
        mesh.parse(str(file), file.suffix[1:], str(file.parent))
    except Exception as error:
        if isinstance(error, (SystemError, SyntaxError)):
            raise


def _fit(folder: Path) -> Path:
    fitted.write(folder / "fit.npz", runs.reconstructed().fit, 1.0)
    return folder / "fit.npz"


def _window(folder: Path) -> Path:
    rng = np.random.default_rng(1)
    store = checkpoint.Folder(folder)
    store.restore("digest", [WINDOW])
    store.save(solved(WINDOW, rng.normal(size=(4, 5)), rng.normal(size=(5, 7))))
    return next(folder.rglob("*.npz"))


def _restored(path: Path) -> Any:
    return checkpoint._read(path, "digest", WINDOW)


def _landmarks(folder: Path) -> Path:
    zeros = np.zeros
    kept.save(
        folder / "kept.npz",
        Detection(
            np.arange(12) / 30, np.arange(12), zeros((12, COUNT, 2)), zeros((12, COUNT)),
            zeros((12, COUNT, 3)), zeros(12, bool), zeros(12), zeros((3, 6)), np.arange(3), 0, 0, 0,
            np.tile(np.eye(3), (12, 1, 1)), np.ones(12), (640, 480),
        ),
    )  # fmt: skip
    return folder / "kept.npz"


def _edits(folder: Path) -> Path:
    opened = journal.Journal("clip.npz", folder)
    opened.note(Edits("", (ContactWish("left_heel", "always"),), "begin"))
    opened.close()
    return next(folder.rglob("*.jsonl"))


def _taken_up(path: Path) -> Any:
    """As `Journal.kept`, which takes a lock first."""
    return [edits for edits in map(journal._read, path.read_bytes().splitlines()) if edits is not None]


def _truth(folder: Path) -> Path:
    times = np.arange(12) / 30
    points = np.cumsum(np.full((12, 3, 3), 0.01), axis=0)
    np.savez(
        folder / "truth.npz",
        schema=truth.TRUTH_SCHEMA, times_s=times, joint_names=["pelvis", "head", "neck"], joints_m=points,
    )  # fmt: skip
    return folder / "truth.npz"


TEXTS: tuple[tuple[str, str, Callable[[Path], Any]], ...] = (
    ("contacts.toml", CONTACTS, wishes.read),
    ("pose2sim.toml", CALIBRATION, cameras.read),
    ("caliscope.toml", CALISCOPE, cameras.read),
    ("suite.toml", (resources.folder("bench/suites") / "contact.toml").read_text("utf-8"), suite.read),
    ("forces.mot", FORCES, opensim.read_mot),
    ("markers.trc", foreign.trc(foreign.markers()[0], 1000 * foreign.markers()[1]), opensim.read_trc),
    ("record.json", json.dumps({"key": "x", "files": {"motion.npz": [3, "abc"]}}), execution._recorded),
    (
        "edited.toml",
        '# a room\n[[item]]\nname = "a"\nkind = "box"\nposition_m = [0, 0, 0]\nsize_m = [1, 1, 1]\n',
        lambda path: Edited.read(path).set("a", "yaw_rad", 0.5),
    ),
)
MAKERS: dict[str, tuple[Callable[[Path], Path], Callable[[Path], Any]]] = {
    "fit": (_fit, fitted.read),
    "window": (_window, _restored),
    "landmarks": (_landmarks, kept.load),
    "edits": (_edits, _taken_up),
    "truth": (_truth, truth.read_truth),
}
