"""`--from`, `--to` and `--every` for every kind of input."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence, resources
from simrecon.errors import InputError
from simrecon.evidence import Span, cutting
from simrecon.evidence.keypoints import layouts
from simrecon.geometry import camera as cameras
from simrecon.types import Evidence, Part
from tests.support import c3d_file
from tests.support import foreign_files as foreign
from tests.support.panning import panning
from tests.support.reading import observed

CASES = Path(__file__).parents[1] / "data" / "cases"
WORDS = ("--from", "0.2", "--to", "0.6", "--every", "2")


@pytest.fixture(scope="module")
def beam() -> Evidence:
    """A hundred frames at 60 Hz, of a camera that is carried, from 2 s on."""
    given = evidence.read(resources.folder("example") / "beam.npz")
    assert given.camera is not None
    times = 2.0 + np.arange(100) / 60
    return replace(given, times_s=times, camera=panning(given.camera, 100))


def test_all_of_a_frame_is_cut(beam: Evidence, tmp_path: Path) -> None:
    evidence.write(tmp_path / "clip.npz", beam)
    found = observed(tmp_path / "clip.npz", "--from", "2.5", "--to", "3", "--every", "3")
    rows = np.arange(30, 61, 3)
    np.testing.assert_allclose(found.times_s, 2.0 + rows / 60)
    np.testing.assert_array_equal(found.keypoints_px, beam.keypoints_px[rows])
    np.testing.assert_array_equal(found.scores, beam.scores[rows])
    np.testing.assert_array_equal(found.joints_m, beam.joints_m[rows])
    assert found.camera is not None
    assert beam.camera is not None
    np.testing.assert_array_equal(cameras.extrinsics(found.camera), cameras.extrinsics(beam.camera)[rows])
    assert found.part == Part(30, 3, 100)
    assert found.reading.endswith("; 2.5 to 3 s, frames 30 to 60 of 100, one of 3")
    assert evidence.resample(found)[0].times_s[1] == pytest.approx(2.55)  # the frame rate follows


def test_a_part_that_was_kept_is_no_longer_cut(beam: Evidence, tmp_path: Path) -> None:
    part = evidence.cut(beam, slice(10, 50, 2))
    evidence.write(tmp_path / "part.npz", part)
    again = evidence.read(tmp_path / "part.npz")
    assert again.part == part.part == Part(10, 2, 100)
    assert evidence.cut(again, slice(2, None, 3)).part == Part(14, 6, 100)
    assert evidence.cut(again, slice(None)) is again


@pytest.mark.parametrize("row", [[3, 1], [-1, 1, 9], [0, 0, 9], [50, 3, 100], [0.5, 1, 100]])
def test_frames_that_the_source_cannot_have_are_refused(
    beam: Evidence, tmp_path: Path, row: list[float]
) -> None:
    evidence.write(tmp_path / "part.npz", evidence.cut(beam, slice(0, 90, 3)))
    content = dict(np.load(tmp_path / "part.npz")) | {"source_frames": np.array(row)}
    np.savez(tmp_path / "bad.npz", **content)
    with pytest.raises(InputError, match="source_frames: found"):
        evidence.read(tmp_path / "bad.npz")


def bvh(_: Path) -> tuple[Path, tuple[str, ...]]:
    return CASES / "bvh_height_1m71.bvh", ()


def trc(_: Path) -> tuple[Path, tuple[str, ...]]:
    return CASES / "trc_keypoint_names.trc", ()


def c3d(folder: Path) -> tuple[Path, tuple[str, ...]]:
    labels, places = foreign.markers(frames=40)
    (folder / "clip.c3d").write_bytes(c3d_file.c3d(labels, 1000 * places, rate_hz=50.0))
    return folder / "clip.c3d", ()


def smpl(folder: Path) -> tuple[Path, tuple[str, ...]]:
    vectors, place = foreign.poses(frames=40)
    np.savez(folder / "amass.npz", poses=vectors.reshape(40, -1), trans=place, mocap_framerate=np.array(30.0))
    return folder / "amass.npz", ("--up", "z")


def coco(folder: Path) -> tuple[Path, tuple[str, ...]]:
    given = evidence.read(resources.folder("example") / "beam.npz")
    columns = [given.keypoint_names.index(name) for name in layouts.layout("coco_17")]
    people = []
    for frame, points in enumerate(np.nan_to_num(given.keypoints_px[:, columns])):
        rows = np.column_stack((points, np.ones(17))).ravel().tolist()
        people.append({"image_id": frame, "category_id": 1, "score": 1.0, "keypoints": rows})
    (folder / "coco.json").write_text(json.dumps(people))
    return folder / "coco.json", ("--fps", "30", "--fov", "36", "--size", "1080x1920")


@pytest.mark.parametrize("make", [bvh, trc, c3d, smpl, coco])
def test_files_of_other_programs(
    make: Callable[[Path], tuple[Path, tuple[str, ...]]], tmp_path: Path
) -> None:
    path, options = make(tmp_path)
    whole, found = observed(path, *options), observed(path, *options, *WORDS)
    rows = np.flatnonzero((whole.times_s > 0.2 - 1e-9) & (whole.times_s < 0.6 + 1e-9))[::2]
    assert len(rows) > 2
    np.testing.assert_array_equal(found.times_s, whole.times_s[rows])
    np.testing.assert_array_equal(found.joints_m, whole.joints_m[rows])
    np.testing.assert_array_equal(found.keypoints_px, whole.keypoints_px[rows])
    assert found.part == Part(int(rows[0]), 2, len(whole.times_s))


def test_landmarks_of_a_second_file_follow(beam: Evidence, tmp_path: Path) -> None:
    bare = replace(beam, keypoint_names=(), keypoints_px=np.empty((100, 0, 2)), scores=np.empty((100, 0)))
    evidence.write(tmp_path / "solid.npz", bare)
    evidence.write(tmp_path / "flat.npz", replace(beam, joint_names=(), joints_m=np.empty((100, 0, 3))))
    words = ("--keypoints", str(tmp_path / "flat.npz"), "--from", "2.5", "--to", "3", "--every", "3")
    found = observed(tmp_path / "solid.npz", *words)
    np.testing.assert_array_equal(found.keypoints_px, beam.keypoints_px[30:61:3])
    np.testing.assert_array_equal(found.joints_m, beam.joints_m[30:61:3])
    assert found.reading.splitlines()[0].endswith("2.5 to 3 s, frames 30 to 60 of 100, one of 3")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--from", "9"), "--from 9: found no frame there; valid: 2 frames or more, between 2 and 3.65 s"),
        (("--to", "2.0"), "--to 2: found 1 frame there; valid: 2 frames or more, between 2 and 3.65 s"),
        (("--every", "200"), "--every 200: found 1 frame there"),
        (("--from", "3", "--to", "2.5"), "--to: found 2.5 beside --from 3; valid: a later time"),
    ],
)
def test_spans_without_frames_are_refused(
    beam: Evidence, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    evidence.write(tmp_path / "clip.npz", beam)
    with pytest.raises(InputError, match=message):
        observed(tmp_path / "clip.npz", *words)


def test_the_ends_belong_to_a_span() -> None:
    times = np.arange(61) / 30
    assert cutting.frames(times, Span(1 / 3, 2 / 3), "") == slice(10, 21, 1)
    assert Span(1.0, 2.0, 3).flags == "--from 1 --to 2 --every 3"
    assert Span(from_s=1.0).begun(1.0 - 1e-9)
    assert not Span(to_s=2.0).ended(2.0 + 1e-9)
