"""A small whole file of every format that can be read, with what must be said of it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import evidence
from simrecon.evidence import Options, formats
from simrecon.evidence.camera import fov
from simrecon.evidence.keypoints import layouts
from simrecon.types import Evidence
from tests.evidence import test_datasets as datasets
from tests.evidence import test_deeplabcut as deeplabcut
from tests.evidence import test_keypoints as keypoints
from tests.evidence import test_mediapipe as mediapipe
from tests.evidence import test_smpl as smpl
from tests.support import foreign_files as foreign
from tests.support import people, video_files
from tests.support.c3d_file import c3d
from tools import CHECKOUT

CASES = CHECKOUT / "tests" / "data" / "cases"
LENS = fov.pinhole(1660.0, (1080, 1920))
PLAIN = Options(fps=30.0)
SEEN = replace(PLAIN, camera=LENS)


@dataclass(frozen=True)
class Sample:
    """A file or folder of one format, and options with which it is read; or what reads it."""

    format: str
    path: Path
    options: Options
    reader: Callable[[Path], Any] | None = None


def _evidence(folder: Path) -> Path:
    places = people.named(people.walking(12), layouts.layout("blazepose_33"))
    names = layouts.layout("blazepose_33")
    made = evidence.from_arrays(
        np.arange(12) / 30, keypoint_names=names, keypoints_px=people.landmarks(names, 12),
        joint_names=names, joints_m=places, camera=LENS,
    )  # fmt: skip
    evidence.write(folder / "clip.npz", made)
    return folder / "clip.npz"


def _vitpose(folder: Path) -> Path:
    points = people.landmarks(layouts.layout("coco_17"), 12)
    rows = [{"1": np.c_[points[t][:, ::-1], np.ones(17)].tolist()} for t in range(12)]
    names = {str(i): name for i, name in enumerate(layouts.layout("coco_17"))}
    return foreign.save_json(folder / "vitpose.json", {"keypoints": rows, "skeleton": names})


def _mediapipe(folder: Path) -> Path:
    return foreign.save_json(folder / "pose.json", [mediapipe.frame(t, "tasks") for t in range(12)])


def _freemocap(folder: Path) -> Path:
    places = 1000 * people.named(people.walking(12, speed_mps=1.0), layouts.layout("blazepose_33"))
    np.save(folder / "mediapipe_body_3d_xyz.npy", places)
    return folder / "mediapipe_body_3d_xyz.npy"


def _text(name: str, text: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_text(text, encoding="utf-8")
        return folder / name

    return make


def _c3d(folder: Path) -> Path:
    labels, places = foreign.markers()
    (folder / "trial.c3d").write_bytes(c3d(labels, 1000 * places))
    return folder / "trial.c3d"


def _video(folder: Path) -> Path:
    images = [video_files.scene([(40 + 2 * t, 60, 80, video_files.RED)]) for t in range(12)]
    return video_files.write(folder / "clip.mp4", images, 25.0)


def _tram(folder: Path) -> Path:
    turns, places = np.tile(np.eye(3), (foreign.T, 1, 1)), np.zeros((foreign.T, 3))
    smpl.tram_camera(folder, turns, places, world=True)
    return smpl.tram(folder)


def _mot(folder: Path) -> Path:
    rows = "\n".join(f"{t / 100}\t0\t0" for t in range(12))
    return _text("ik.mot", f"Coordinates\nnRows=12\nnColumns=3\nendheader\ntime\ta\tb\n{rows}\n")(folder)


MAKERS: tuple[tuple[str, Callable[[Path], Path], Options], ...] = (
    ("evidence", _evidence, Options()),
    ("wham", smpl.wham, SEEN),
    ("gvhmr", smpl.gvhmr, PLAIN),
    ("gem", smpl.gem, PLAIN),
    ("tram", _tram, PLAIN),
    ("phalp", keypoints.phalp, PLAIN),
    ("prompthmr", smpl.prompthmr, PLAIN),
    ("sam3d", keypoints.sam3d, PLAIN),
    ("gem", datasets.soma, PLAIN),
    ("3dpw", datasets.threedpw, Options()),
    ("phc", datasets.phc, Options()),
    ("humanml3d", datasets.humanml3d, Options()),
    ("humanml3d", lambda folder: datasets.humanml3d(folder, "joints"), Options()),
    ("amass", smpl.amass, Options()),
    ("amass", smpl.amass_x, Options()),
    ("smpl", smpl.plain, Options()),
    ("openpose", keypoints.openpose, SEEN),
    ("mmpose", keypoints.mmpose, SEEN),
    ("vitpose", _vitpose, SEEN),
    ("alphapose", keypoints.alphapose, SEEN),
    ("coco", keypoints.coco_results, SEEN),
    ("coco", keypoints.coco_dataset, replace(SEEN, camera=fov.pinhole(800.0, (640, 480)))),
    ("mediapipe", _mediapipe, SEEN),
    ("deeplabcut", lambda folder: deeplabcut.table(folder / "dlc.csv")[0], SEEN),
    ("freemocap", _freemocap, PLAIN),
    ("array", lambda folder: keypoints.array(folder, 17), SEEN),
    ("bvh", _text("clip.bvh", foreign.bvh()[0]), Options()),
    ("trc", lambda folder: _text("trial.trc", foreign.trc(*_millimetres()))(folder), Options()),
    ("mot", _mot, Options()),
    ("c3d", _c3d, Options()),
    ("video", _video, replace(PLAIN, camera=fov.pinhole(150.0, (160, 120)))),
)  # fmt: skip
"""Format, what writes a file of it into a folder, and what must be said of it."""


def _millimetres() -> tuple[list[str], Any]:
    labels, places = foreign.markers()
    return labels, 1000 * places


def made(folder: Path) -> list[Sample]:
    """Files made for every format, each in a folder of its own."""
    samples = []
    for i, (name, make, options) in enumerate(MAKERS):
        place = folder / f"{i:02d}_{name}"
        place.mkdir(parents=True)
        samples.append(Sample(name, make(place), options))
    return samples


def cases(folder: Path) -> list[Sample]:
    """Copies of the small cases of `tests/data/cases` that are read."""
    samples = []
    for path in sorted(CASES.iterdir()):
        if path.suffix in (".toml", ".csv", ".mp4"):
            continue
        target = folder / path.name
        (shutil.copytree if path.is_dir() else shutil.copyfile)(path, target)
        name = formats.format_of(target)
        options = Options() if name in ("bvh", "trc", "c3d") else SEEN
        samples.append(Sample(name, target, options))
    return samples


def read(sample: Sample) -> Evidence:
    """The evidence of a sample, with the checks that a run makes."""
    from simrecon.body import names

    found = evidence.read(sample.path, sample.options)
    evidence.check_names(found, names.valid_names(), sample.path)
    return found
