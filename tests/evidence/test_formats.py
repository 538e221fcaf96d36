from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, evidence
from simrecon.errors import InputError
from simrecon.evidence import Options, formats
from simrecon.evidence.content import open_content
from simrecon.evidence.keypoints import layouts
from simrecon.types import Camera, Lens
from tests.support import foreign_files as foreign
from tests.support.reading import observed

T, FPS = foreign.T, foreign.FPS
APART = np.array([150.0, 0.0])
K = np.array([[900.0, 0, 640], [0, 900, 360], [0, 0, 1]])
LENS = Camera(Lens(K, np.zeros(5), (1280, 720)))


def network(folder: Path) -> Path:
    vectors, place = foreign.poses(joints=22)
    params = {
        "body_pose": vectors[:, 1:].reshape(T, 63),
        "betas": np.zeros((T, 10)),
        "global_orient": vectors[:, 0],
        "transl": place,
    }
    tree = {"smpl_params_global": params, "smpl_params_incam": params, "K_fullimg": np.tile(K, (T, 1, 1))}
    return foreign.save_torch(folder / "gvhmr.pt", tree)


def landmarks(folder: Path, frames: range = range(T), people: int = 1) -> Path:
    tree = []
    for t in frames:
        points, scores = foreign.landmarks(17, 100)
        for k in range(people):
            flat = np.concatenate((points[t] + APART * k, scores[t][:, None]), axis=1).ravel()
            tree.append({"image_id": f"{t}.jpg", "keypoints": flat.tolist(), "score": 2.0, "idx": k})
    return foreign.save_json(folder / "vitpose.json", tree)


def bvh(folder: Path) -> Path:
    path = folder / "clip.bvh"
    path.write_text(foreign.bvh()[0])
    return path


def test_the_content_decides_not_the_name(tmp_path: Path) -> None:
    path = network(tmp_path).rename(tmp_path / "clip.bvh")
    assert evidence.read(path, Options(fps=FPS)).reading.startswith("GVHMR: ")
    other = bvh(tmp_path).rename(tmp_path / "clip.json")
    assert evidence.read(other).reading.startswith("BVH: ")


def test_formats_have_different_names_and_exclude_one_another(tmp_path: Path) -> None:
    assert len(set(formats.names())) == len(formats.READERS)
    for path in (network(tmp_path), landmarks(tmp_path), bvh(tmp_path)):
        content = open_content(path)
        assert sum(reader.matches(content) for reader in formats.READERS) == 1


def test_a_format_can_be_forced_but_not_upon_another(tmp_path: Path) -> None:
    path = bvh(tmp_path)
    assert evidence.read(path, Options(format="bvh")).reading.startswith("BVH")
    with pytest.raises(InputError, match="--format: found content that is not WHAM's"):
        evidence.read(path, Options(format="wham"))
    with pytest.raises(InputError, match="--format: found 'fbx'; valid: evidence, wham, gvhmr"):
        evidence.read(path, Options(format="fbx"))


UNKNOWN = {
    "text": (b"hello", "a text of no known format"),
    "nothing": (b"", "an empty file, which is of no known format"),
    "zeros": (bytes(1000), "a file of no known format"),
    "json": (b'{"a": 1}', "JSON with a of no known format"),
    "json list": (b"[1, 2]", "JSON of no known format"),
    "empty list": (b"[]", "JSON of no known format"),
    "damaged json": (b"[1, 2", "damaged JSON"),
    "deep json": (b"[" * 100_000, "damaged JSON"),
    "zip": (b"PK\x03\x04" + bytes(50), "damage"),
    "video": (b"\x00\x00\x00\x18ftypmp42" + bytes(50), "cannot be opened as a video"),
    "lz4": (b"\x04\x22\x4d\x18" + bytes(50), "found lz4 compression; valid: none, zlib"),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_unknown_files_are_one_line(tmp_path: Path, name: str) -> None:
    content, found = UNKNOWN[name]
    path = tmp_path / "what"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        evidence.read(path)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(str(path))
    assert found in str(error.value)


def test_missing_files_and_folders_without_landmarks(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot be read \(No such file"):
        evidence.read(tmp_path / "none.pkl")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="a folder of no known format"):
        evidence.read(tmp_path / "folder")


def test_landmarks_of_another_file_are_joined(tmp_path: Path) -> None:
    found = evidence.read(network(tmp_path), Options(fps=FPS), keypoints=landmarks(tmp_path, range(2, 30)))
    points, scores = foreign.landmarks(17, 100)
    assert len(found.times_s) == T
    assert found.keypoint_names == layouts.layout("coco_17")
    np.testing.assert_allclose(found.keypoints_px[2:], points[2:T], atol=1e-4)
    np.testing.assert_allclose(found.scores[2:], scores[2:T], atol=1e-6)
    assert np.isnan(found.keypoints_px[:2]).all()
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.lens.matrix_px, K)
    assert found.joint_names[0] == "pelvis"
    second = found.reading.splitlines()[1]
    assert second.startswith("AlphaPose: 17 landmarks of 17; ")
    assert second.endswith(", for 10 of 12 frames")


def test_joining_needs_both_halves_of_one_video(tmp_path: Path) -> None:
    points, whole = landmarks(tmp_path), network(tmp_path)
    asked = Options(fps=FPS, camera=LENS)
    with pytest.raises(InputError, match="found no 2D landmarks"):
        evidence.read(whole, asked, keypoints=whole)
    with pytest.raises(InputError, match="found no 3D estimate"):
        evidence.read(points, asked, keypoints=points)
    with pytest.raises(InputError, match="but no lens"):
        evidence.read(bvh(tmp_path), Options(fps=FPS), keypoints=points)
    late = landmarks(tmp_path, range(8, 90))
    with pytest.raises(InputError, match="landmarks for 4 of the 12 frames"):
        evidence.read(whole, asked, keypoints=late)


def test_a_person_is_chosen_in_each_file(tmp_path: Path) -> None:
    whole, points = network(tmp_path), landmarks(tmp_path, people=2)
    with pytest.raises(InputError, match="people: found 2"):
        evidence.read(whole, Options(fps=FPS), keypoints=points)
    found = evidence.read(whole, Options(fps=FPS), keypoints=points, keypoints_person="1")
    np.testing.assert_allclose(found.keypoints_px, foreign.landmarks(17, 100)[0][:T] + APART, atol=1e-4)


def test_evidence_is_checked_whatever_it_was_read_from(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="times_s: found a median interval of 1 s"):
        evidence.read(network(tmp_path), Options(fps=1.0))
    with pytest.raises(InputError, match="joints_m: found a person"):
        evidence.read(bvh(tmp_path), Options(unit="m", up="y"))


# --- the command line


def test_the_reading_says_how_both_files_were_read(tmp_path: Path) -> None:
    seen = observed(network(tmp_path), "--fps", "30", "--keypoints", str(landmarks(tmp_path)))
    first, second = seen.reading.splitlines()
    assert first.startswith("GVHMR: SMPL-X parameters, frame world, up y (this format's convention)")
    assert second.startswith("AlphaPose: 17 landmarks of 17; ")
    assert second.endswith(", for 12 of 12 frames")
    assert len(seen.times_s) == T


def test_a_field_of_view_makes_a_lens(tmp_path: Path) -> None:
    found = observed(landmarks(tmp_path), "--fps", "30", "--fov", "90", "--size", "1280x720")
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.lens.matrix_px, [[640, 0, 639.5], [0, 640, 359.5], [0, 0, 1.0]])
    assert found.camera.lens.image_size_px == (1280, 720)


def test_a_video_gives_rate_and_size(tmp_path: Path) -> None:
    video = Path(__file__).resolve().parents[2] / "simrecon" / "example" / "beam.mp4"
    found = observed(landmarks(tmp_path), "--video", str(video), "--fov", "60")
    np.testing.assert_allclose(np.diff(found.times_s), 1 / 60, rtol=1e-3)
    assert found.camera is not None
    assert found.camera.lens.image_size_px[0] > 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--fov", "90"], "--fov: found no image size"),
        (["--fov", "400"], "--fov: must be a number from 1 to 170, found '400'"),
        (["--size", "1280"], "such as 1920x1080, found '1280'"),
        (["--up", "w"], "argument --up: must be one of x, y, z"),
        (["--format", "fbx"], "argument --format: must be one of evidence, wham"),
        ([], "frame rate: found none in the file"),
    ],
)
def test_bad_options_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    out = tmp_path / "out"
    assert cli.main(["run", str(landmarks(tmp_path)), "-o", str(out), *arguments]) == 2
    printed = capsys.readouterr().err
    assert said in printed
    assert len(printed.splitlines()) == 1
    assert not out.exists()


def test_names_of_every_reader_are_known_to_the_body(tmp_path: Path) -> None:
    from simrecon.body import names

    for path, options in ((network(tmp_path), Options(fps=FPS)), (bvh(tmp_path), Options())):
        evidence.check_names(evidence.read(path, options), names.valid_names(), path)
    flat = evidence.read(landmarks(tmp_path), Options(fps=FPS, camera=LENS))
    evidence.check_names(flat, names.valid_names(), "x")
    assert replace(flat, reading="").reading == ""
    assert json.dumps(flat.reading)
