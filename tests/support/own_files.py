"""A small whole file of everything that is read beside evidence, with what reads it."""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import job as jobs
from simrecon import plan as plans
from simrecon import resources, results
from simrecon import scene as scenes
from simrecon.batch import clips, journal, page, records, status
from simrecon.batch.journal import Journal, Places
from simrecon.body import model_file
from simrecon.evidence.camera import files as cameras
from simrecon.evidence.options import Options
from simrecon.results import recall
from simrecon.viewer import page as viewer_page
from tests.support import runs, smpl_layout
from tests.support.corpus import Sample

NAMES = (
    "scene", "plan", "job", "toml camera", "opencv camera", "toml manifest", "csv manifest",
    "npz body model", "pickle body model", "result", "batch",
)  # fmt: skip
CAMERA = """image_size_px = [640, 480]
focal_px = 600.0
distortion = [0.1, 0.0, 0.0, 0.0, 0.0]
world_to_camera = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0], [-1.0, 0.0, 0.0, 4.0], [0.0, 0.0, 0.0, 1.0]]
"""
STORAGE = """%YAML:1.0
---
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 600., 0., 320., 0., 600., 240., 0., 0., 1. ]
distortion_coefficients: [ 0.1, 0.0, 0.0, 0.0, 0.0 ]
image_width: 640
image_height: 480
"""
MANIFEST = """[defaults]
mass_kg = 70.0

[[clip]]
name = "one"
input = "{folder}/one.npz"
plan = "quick"
size_px = [640, 480]
person_at_px = [10.0, 20.0]

[[clip]]
input = "{folder}/two.npz"
ignore = ["keypoints"]
"""
TABLE = """input,name,plan,mass_kg,size_px,ignore
{folder}/one.npz,one,quick,70,640x480,
{folder}/two.npz,,,,,keypoints
"""


def made(folder: Path) -> list[Sample]:
    """Files of all `NAMES`, each in a folder of its own."""
    written = folder / "result" / "out"
    results.write(runs.job_of(written, plan=runs.hasty()), runs.reconstructed())
    texts = {
        "scene": ("room.toml", (resources.folder("example") / "beam.toml").read_text(encoding="utf-8")),
        "plan": ("plan.toml", (resources.folder("windows") / "quick.toml").read_text(encoding="utf-8")),
        "job": ("job.toml", (written / "job.toml").read_text(encoding="utf-8")),
        "toml camera": ("camera.toml", CAMERA),
        "opencv camera": ("camera.yml", STORAGE),
        "toml manifest": ("list.toml", MANIFEST),
        "csv manifest": ("list.csv", TABLE),
    }
    paths = {"result": written, "batch": _batch(folder / "batch" / "night", written)}
    for name, (file, text) in texts.items():
        paths[name] = _place(folder, name) / file
        paths[name].write_text(text.replace("{folder}", str(folder)), encoding="utf-8")
    for name in ("one.npz", "two.npz"):
        (folder / name).touch()
    arrays = smpl_layout.arrays()
    paths["npz body model"] = _place(folder, "npz body model") / "model.npz"
    np.savez_compressed(paths["npz body model"], **arrays)
    paths["pickle body model"] = _place(folder, "pickle body model") / "model.pkl"
    paths["pickle body model"].write_bytes(pickle.dumps(arrays, 2))
    return [Sample(name, paths[name], Options(), READERS[name]) for name in NAMES]


def _place(folder: Path, name: str) -> Path:
    place = folder / name.replace(" ", "_")
    place.mkdir(parents=True)
    return place


def _batch(root: Path, result: Path) -> Path:
    """A batch of a clip that is done and one that failed."""
    places = Places(root)
    shutil.copytree(result, places.result("one"))
    book = Journal(places.events)
    book.append("begin", clips=2)
    for name in ("one", "two"):
        book.append("clip", clip=name, input=f"/in/{name}.npz", plan="quick", video_s=0.3, windows=2)
    book.append("started", clip="one", window=0, windows=2)
    book.append("window", clip="one", window=1, windows=2, loss=3.5)
    book.append("done", clip="one")
    book.append("failed", clip="two", message="no good")
    book.append("end", reason="")
    book.close()
    figures = {
        "verdict": "all simulated", "quality": "good", "fell": False, "frames": 9, "fallback": 0,
        "video_s": 0.3, "wall_s": 2.0, "loss": 3.5, "metrics": {"mpjpe_2d_px": 1.0, "footskate_pct": None},
    }  # fmt: skip
    records.write(places, "one", "key", figures)
    return root


def _result(folder: Path) -> None:
    found = results.open_result(folder)
    for name in ("motion", "report", "scene", "model", "body", "plan", "job"):
        getattr(found, name)
    viewer_page.data(found, viewer_page.frames(len(found.motion.times_s)), {})
    recall.scene_of(found)


def _night(folder: Path) -> None:
    places = Places(folder)
    state = status.read(places)
    status.text(state, str(folder))
    status.table(state)
    page.render(places, state)
    journal.holder(places)
    records.verify(places)


def _manifest(path: Path) -> None:
    clips.collect([str(path)])


READERS: dict[str, Callable[[Path], Any]] = {
    "scene": scenes.read,
    "plan": plans.read,
    "job": jobs.read,
    "toml camera": cameras.read,
    "opencv camera": cameras.read,
    "toml manifest": _manifest,
    "csv manifest": _manifest,
    "npz body model": model_file.read,
    "pickle body model": model_file.read,
    "result": _result,
    "batch": _night,
}
