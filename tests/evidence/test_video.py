from __future__ import annotations

import hashlib
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Never, ParamSpec

import cv2
import numpy as np
import pytest

from simrecon import cli, evidence, job, resources, running
from simrecon.errors import InputError, SimreconError
from simrecon.evidence import Options, Span
from simrecon.evidence.content import open_content
from simrecon.evidence.video import detection, frames, metadata, networks, weights
from simrecon.evidence.video.blazepose import NAMES
from simrecon.evidence.video.detection import Look
from simrecon.evidence.video.tracker import Choice
from simrecon.job import Job, Reading, inputs
from simrecon.types import Camera, Evidence, Lens, Part
from tests.support import textured
from tests.support import video_files as files
from tests.support.reading import observed
from tests.support.video_files import GREEN, RED

P = ParamSpec("P")
BEAM = resources.folder("example") / "beam.npz"


def lens(size: tuple[int, int] = (160, 120)) -> Camera:
    return Camera(Lens(np.array([[150.0, 0, 80], [0, 150, 60], [0, 0, 1]]), np.zeros(5), size))


class Loaded(files.Rectangles):
    """Counts how often it is loaded."""

    loaded = 0


@pytest.fixture
def network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Loaded:
    """Instead of BlazePose, with weights that are only names."""
    made = Loaded()

    def load(*_paths: Path) -> Loaded:
        made.loaded += 1
        return made

    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(weights, "find", lambda name: (Path(name), f"hash of {name}"))
    monkeypatch.setattr(detection, "Networks", load)
    return made


def fake(test: Callable[P, None]) -> Callable[P, None]:
    """For tests that need the fixture `network` only for what it replaces."""
    return pytest.mark.usefixtures("network")(test)


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    images = [files.scene([(40 + 2 * t, 60, 80, RED), (130, 60, 50, GREEN)]) for t in range(20)]
    return files.write(tmp_path / "clip.mp4", images, 25.0)


@fake
def test_evidence_of_a_video(clip: Path) -> None:
    steps: list[tuple[float, float]] = []
    asked = Options(camera=lens(), lens="a test", progress=lambda done, total: steps.append((done, total)))
    found = evidence.read(clip, asked)
    np.testing.assert_allclose(found.times_s, np.arange(20) / 25)
    assert found.keypoint_names == found.joint_names == NAMES
    assert found.joints_frame == "camera_root_relative"
    middle = found.keypoints_px[:, [11, 12]].mean(axis=1)
    np.testing.assert_allclose(middle[:, 0], 39.5 + 2 * np.arange(20), atol=1)
    np.testing.assert_allclose(found.scores, 0.9, rtol=1e-6)
    assert steps[0] == (1, 20)
    assert steps[-1] == (20, 20)
    assert "video: clip.mp4, 160 x 120 px, 20 frames, 25 Hz; lens: a test; BlazePose heavy, " in found.reading
    assert (
        "person 1 of 2, seen best; --person or --person-at chooses: 1 (at 40,60 in frame 0, 8"
        in found.reading
    )
    assert "2 px high, in 20 of 20), 2 (at 130,60 in frame 0, 52 px high, in 20 of 20)" in found.reading


def test_a_second_run_skips_detection(clip: Path, network: Loaded, tmp_path: Path) -> None:
    asked = Options(camera=lens(), model="full")
    first = evidence.read(clip, asked)
    calls = dict(network.calls)
    second = evidence.read(clip, Options(camera=lens(), model="full", fps=50.0))
    assert network.loaded == 1
    assert network.calls == calls
    assert "BlazePose full, from the cache" in second.reading
    np.testing.assert_allclose(second.keypoints_px, first.keypoints_px, atol=1e-4)
    np.testing.assert_allclose(second.times_s, np.arange(20) / 50)
    (kept,) = (tmp_path / "cache" / "detections").iterdir()
    kept.write_bytes(kept.read_bytes()[:1000])  # a damaged cache is made again
    evidence.read(clip, asked)
    assert network.loaded == 2


def test_cache_key_knows_content_networks_and_options() -> None:
    content, model, hashes = "a" * 64, "heavy", ("d", "h")
    given = detection.key(content, model, hashes, Look())
    keys = {
        given,
        detection.key("b" * 64, model, hashes, Look()),
        detection.key(content, "full", hashes, Look()),
        detection.key(content, model, ("d", "other"), Look()),
        detection.key(content, model, hashes, Look(Choice(number=1))),
        detection.key(content, model, hashes, Look(Choice(at_px=(1.0, 2.0)))),
        detection.key(content, model, hashes, Look(span=Span(from_s=1.0))),
        detection.key(content, model, hashes, Look(span=Span(from_s=1.0), fps=50.0)),
    }
    assert len(keys) == 8
    assert detection.key(content, model, hashes, Look(fps=50.0)) == given  # all frames, whatever their times


@fake
def test_a_lens_that_nobody_knows_is_a_usual_one_until_the_motion_says_more(
    clip: Path, tmp_path: Path
) -> None:
    found = evidence.read(clip, Options())
    assert found.camera is not None
    assert found.camera.lens.focal_sigma == 0.245
    assert "lens: not known: estimated with the motion, unless you give --camera FILE" in found.reading
    evidence.write(tmp_path / "kept.npz", found)
    kept = evidence.read(tmp_path / "kept.npz").camera
    assert kept is not None
    assert kept.lens.focal_sigma == 0.245


@fake
def test_a_camera_that_pans_has_a_path_in_a_world_without_a_floor(tmp_path: Path) -> None:
    turns, picture, images = textured.swaying(12, 0.15), textured.wall(), []
    for t, rotation in enumerate(turns):
        pale = 128 + 0.3 * (textured.turned(picture, rotation).astype(float) - 128)
        images.append(pale.astype(np.uint8))
        cv2.rectangle(images[-1], (100 + 4 * t, 60), (150 + 4 * t, 240), RED, -1)
    panning = files.write(tmp_path / "panning.mp4", images, 25.0)
    found = evidence.read(panning, Options(camera=Camera(textured.LENS), lens="a test"))
    assert found.camera is not None
    assert found.camera.path is not None
    assert found.camera.path.shape == (12, 4, 4)
    assert not found.ground_known
    ahead = found.camera.path[:, 2, :3]
    np.testing.assert_allclose(ahead @ ahead[0], turns[:, 2, 2], atol=2e-3)
    assert "; the camera turns by up to " in found.reading
    evidence.write(tmp_path / "kept.npz", found)
    kept = evidence.read(tmp_path / "kept.npz").camera
    assert kept is not None
    assert kept.path is not None
    np.testing.assert_allclose(kept.path, found.camera.path)
    unknown = inputs.observe(Job(str(panning), "", Reading(unknown_camera=True)))
    assert unknown.camera is not None
    assert unknown.camera.path is not None


@fake
def test_person(clip: Path) -> None:
    for asked in (Options(camera=lens(), person="2"), Options(camera=lens(), person_at=(130.0, 60.0))):
        found = evidence.read(clip, asked)
        np.testing.assert_allclose(found.keypoints_px[:, [11, 12], 0].mean(axis=1), 129.5, atol=1)
        assert "person 2 of" in found.reading
        assert "as chosen" in found.reading


@fake
def test_look_draws_who_is_there(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "sheet.png"
    assert cli.main(["look", str(clip), "-o", str(target), "--person", "2"]) == 0
    said = capsys.readouterr().out
    assert "people   1 (at 40,60 in frame 0" in said
    assert "followed 2" in said
    assert "seen     in 20 of 20 frames, lost 0 times" in said
    sheet = cv2.imread(str(target))
    assert sheet is not None
    assert sheet.shape[0] > 300
    for words, message in (
        ([str(clip), "-o", "a.jpg"], "a.jpg: is no .png"),
        ([str(BEAM), "-o", str(target)], "content: found npz; valid: a video"),
        ([str(clip), "-o", str(target), "--person", "7"], "--person 7: found 2 people"),
    ):
        assert cli.main(["look", *words]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"person": "3"}, r"--person 3: found 2 people: 1 \(at 40,60"),
        ({"person": "Bob"}, "--person: found 'Bob'; valid: 1"),
        (
            {"person_at": (5.0, 5.0)},
            "--person-at: found no person at 5,5 in 20 frames; valid: a place on one of 1",
        ),
        ({"person_at": (5.0, 5.0), "person": "1"}, "--person: found --person-at beside it"),
        ({"camera": lens((320, 240))}, "found a camera of 320 x 240 for a video of 160 x 120 px"),
    ],
)
@fake
def test_refusals(clip: Path, asked: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        evidence.read(clip, Options(**({"camera": lens()} | asked)))
    assert "\n" not in str(caught.value)


@fake
def test_nobody(tmp_path: Path) -> None:
    path = files.write(tmp_path / "empty.mp4", [files.scene([])] * 4)
    with pytest.raises(InputError, match="people: found no person in 4 frames"):
        evidence.read(path, Options(camera=lens()))


@fake
def test_a_video_gives_the_landmarks_of_another_estimate(clip: Path, tmp_path: Path) -> None:
    estimate = evidence.read(clip, Options(camera=lens()))
    bare = replace(estimate, keypoint_names=(), keypoints_px=np.empty((20, 0, 2)), scores=np.empty((20, 0)))
    evidence.write(tmp_path / "estimate.npz", bare)
    found = evidence.read(tmp_path / "estimate.npz", keypoints=clip)  # through that file's lens
    np.testing.assert_allclose(found.keypoints_px, estimate.keypoints_px, atol=1e-4)
    assert found.camera is not None
    assert found.camera.lens.matrix_px[0, 0] == 150
    assert "lens: that of estimate.npz" in found.reading


@fake
def test_unseen_and_hidden_frames_are_told(tmp_path: Path) -> None:
    gone = (5, 6, 7, *range(20, 40))
    images = [files.scene([(60, 60, 80, RED)] if t not in gone else []) for t in range(50)]
    found = evidence.read(files.write(tmp_path / "gap.mp4", images), Options(camera=lens()))
    unseen = np.flatnonzero(np.isnan(found.keypoints_px).any(axis=(1, 2)))
    assert unseen.tolist() == list(range(20, 40))
    assert (found.scores[list(gone)] == 0).all()
    assert np.isnan(found.joints_m[list(gone)]).all()
    assert "unseen in 20 of 50 frames, lost 2 times" in found.reading
    assert "hidden in 3 frames, and taken to go on as before" in found.reading


@fake
def test_rotation_flag(tmp_path: Path) -> None:
    images = [files.scene([(40 + t, 30, 40, RED)]) for t in range(6)]
    images = [cv2.rotate(cv2.resize(i, (120, 160)), cv2.ROTATE_90_COUNTERCLOCKWISE) for i in images]
    path = files.write(tmp_path / "turned.mp4", images)
    upright = cv2.rotate(images[0], cv2.ROTATE_90_CLOCKWISE)
    files.turn(path)
    info = frames.probe(path)
    assert info.size_px == (120, 160)
    assert info.form.rotation_deg in (90, 270)
    image = next(frames.frames(path)).image
    assert np.abs(image.astype(int) - upright).mean() < 6
    found = evidence.read(path, Options(camera=lens((120, 160))))
    assert "120 x 160 px (turned by" in found.reading


@fake
def test_variable_rate_keeps_the_time_stamps(tmp_path: Path) -> None:
    images = [files.scene([(40 + t, 60, 80, RED)]) for t in range(10)]
    path = files.write(tmp_path / "vfr.mp4", images, 30.0)
    tick = files.timescale(path)
    deltas = [tick // 60 if t % 2 else tick // 20 for t in range(10)]
    files.vary(path, deltas)
    found = evidence.read(path, Options(camera=lens()))
    wanted = np.cumsum([0, *deltas[:-1]]) / tick
    np.testing.assert_allclose(found.times_s, wanted, atol=1e-4)
    assert "variable rate, " in found.reading


def test_networks_look_at_the_part_of_a_video_alone(clip: Path, network: Loaded) -> None:
    whole, calls = evidence.read(clip, Options(camera=lens())), dict(network.calls)
    found = evidence.read(clip, Options(camera=lens(), span=Span(0.2, 0.5, 2)))
    assert network.calls["pose"] - calls["pose"] <= 4 * (2 + 1)
    np.testing.assert_allclose(found.times_s, [0.2, 0.28, 0.36, 0.44])
    np.testing.assert_allclose(found.keypoints_px, whole.keypoints_px[5:12:2], atol=0.5)
    assert found.part == Part(5, 2, 20)
    assert "4 frames, 12.5 Hz; " in found.reading
    assert " in frame 5, " in found.reading
    assert found.reading.endswith("; 0.2 to 0.44 s, frames 5 to 11 of 20, one of 2")
    again = evidence.read(clip, Options(camera=lens(), span=Span(0.2, 0.5, 2)))
    assert "from the cache" in again.reading
    slow = evidence.read(clip, Options(camera=lens(), span=Span(0.2, 0.5), fps=50.0))  # by the times given
    np.testing.assert_allclose(slow.times_s, np.arange(10, 20) / 50)
    with pytest.raises(InputError, match=r"--from 3: found no frame there; valid: .* between 0 and 0.76 s"):
        evidence.read(clip, Options(camera=lens(), span=Span(from_s=3.0)))


@fake
def test_a_part_that_is_kept_of_a_video_is_not_thinned_again(clip: Path, tmp_path: Path) -> None:
    job = Job(str(clip), "", reading=Reading(fov_deg=50.0, from_s=0.2, every=2))
    found = inputs.observe(job)
    evidence.write(tmp_path / "kept.npz", found)
    again = inputs.observe(replace(job, detected=str(tmp_path / "kept.npz")))
    np.testing.assert_array_equal(again.times_s, found.times_s)
    assert again.part == found.part == Part(5, 2, 20)


@fake
def test_odd_size(tmp_path: Path) -> None:
    images = [files.scene([(60, 40, 60, RED)], (101, 83)) for _ in range(3)]
    path = files.write(tmp_path / "odd.avi", images, codec="MJPG")
    assert frames.probe(path).size_px == (101, 83)
    found = evidence.read(path, Options(camera=lens((101, 83))))
    np.testing.assert_allclose(found.keypoints_px[:, [11, 12], 0].mean(), 59.5, atol=1)


def test_damaged_and_missing_videos(tmp_path: Path) -> None:
    path = tmp_path / "bad.mp4"
    path.write_bytes(b"\0\0\0\x18ftypmp42" + bytes(200))
    with pytest.raises(InputError, match=r"cannot be opened as a video|no frame that can be decoded"):
        evidence.read(path, Options(camera=lens()))
    with pytest.raises(InputError, match="there is no such video"):
        frames.probe(tmp_path / "none.mp4")


@pytest.mark.parametrize(("kind", "name"), [(b"av01", "AV1"), (b"vvc1", "VVC")])
def test_a_codec_that_opencv_lacks_is_named(
    clip: Path, tmp_path: Path, kind: bytes, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    files.recode(clip, kind, b"cfg ")
    for words in ([str(clip)], [str(BEAM), "--video", str(clip)]):
        assert cli.main(["run", *words, "-o", str(tmp_path / "out"), "--fov", "50"]) == 2
        said = capsys.readouterr().err.strip()
        assert f"clip.mp4: found {name}, which OpenCV cannot decode here; valid: another coding" in said
        assert "\n" not in said


def test_fov_does_not_hide_what_is_wrong_with_a_video(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = files.write(tmp_path / "one.mp4", [files.scene([])])
    clip.write_bytes(clip.read_bytes()[:300])
    for path, message in (
        (clip, "clip.mp4: found a file that cannot be opened as a video"),
        (one, "one.mp4: frames: found a single frame; valid: a video of two frames or more"),
    ):
        assert cli.main(["run", str(path), "-o", str(tmp_path / "out"), "--fov", "50"]) == 2
        assert message in capsys.readouterr().err


@fake
def test_a_video_of_landmarks_gives_size_and_rate(clip: Path, tmp_path: Path) -> None:
    estimate = evidence.read(clip, Options(camera=lens()))
    bare = replace(estimate, keypoint_names=(), keypoints_px=np.empty((20, 0, 2)), scores=np.empty((20, 0)))
    evidence.write(tmp_path / "estimate.npz", replace(bare, camera=None))
    found = observed(tmp_path / "estimate.npz", "--keypoints", str(clip), "--fov", "50")
    assert found.camera is not None
    assert found.camera.lens.image_size_px == (160, 120)
    with pytest.raises(InputError, match=r"--fov: found no image size; valid: --size WIDTHxHEIGHT"):
        observed(tmp_path / "estimate.npz", "--fov", "50")


def test_missing_weights_are_one_line_and_status_2(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    assert cli.main(["run", str(clip), "-o", str(tmp_path / "out"), "--fov", "50"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert said[0].endswith("are not there; fetch them: simrecon models fetch")
    assert not (tmp_path / "out").exists()


@fake
@pytest.mark.parametrize(("error", "status"), [(SimreconError("far enough"), 1), (KeyboardInterrupt(), 130)])
def test_a_run_that_ends_early_leaves_nothing(
    error: BaseException,
    status: int,
    clip: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    passed: list[Evidence] = []

    def stand_in(seen: Evidence, *_: object) -> Never:
        passed.append(seen)
        raise error

    monkeypatch.setattr(running, "reconstruct", stand_in)
    out = tmp_path / "new" / "out"
    assert cli.main(["run", str(clip), "-o", str(out), "--fov", "56"]) == status
    (seen,) = passed
    assert len(seen.sha256) == 64  # of the evidence, as a file
    assert seen.reading.startswith("video: clip.mp4, ")
    assert seen.camera is not None
    assert seen.camera.lens.matrix_px[0, 0] == pytest.approx(80 / np.tan(np.radians(28)))
    assert "read as video: clip.mp4" in capsys.readouterr().err
    assert not out.parent.exists()


@fake
def test_the_evidence_of_a_video_is_kept_beside_its_result(
    clip: Path, tmp_path: Path, run: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    passed: list[Evidence] = []

    def stand_in(seen: Evidence, *_: object) -> Any:
        passed.append(seen)
        return run

    monkeypatch.setattr(running, "reconstruct", stand_in)
    out, kept = tmp_path / "new" / "out", tmp_path / "new" / "out.evidence.npz"
    words = ["run", str(clip), "-o", str(out), "--fov", "56"]
    assert cli.main(words) == 0
    assert f"{kept}: the landmarks of the video" in capsys.readouterr().out
    (seen,) = passed
    assert seen.sha256 == hashlib.sha256(kept.read_bytes()).hexdigest()
    assert job.read(out / "job.toml").detected == str(kept)
    again = inputs.observe(Job(str(clip), str(out), detected=str(kept)))
    np.testing.assert_array_equal(again.keypoints_px, seen.keypoints_px)
    # one that somebody changed stays, and so does the result's word on it
    evidence.write(kept, replace(seen, mass_kg=70.0))
    mine = kept.read_bytes()
    assert cli.main(words) == 0
    assert kept.read_bytes() == mine
    assert job.read(out / "job.toml").detected == str(kept.with_name("out.evidence-2.npz"))
    assert cli.main([*words, "--replace"]) == 0
    assert kept.read_bytes() != mine


@fake
def test_what_was_said_of_a_video_can_be_taken_back_without_looking_at_it_again(
    clip: Path, tmp_path: Path, run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    passed: list[Evidence] = []

    def stand_in(seen: Evidence, *_: object) -> Any:
        passed.append(seen)
        return run

    monkeypatch.setattr(running, "reconstruct", stand_in)
    out, again = str(tmp_path / "out"), str(tmp_path / "again")
    said = ["--ignore", "joints", "--height-m", "1.8", "--trust", "world"]
    assert cli.main(["run", str(clip), "-o", out, "--fov", "56", *said]) == 0
    assert cli.main(["rerun", out, "-o", again, "--forget", "ignore,height-m,trust"]) == 0
    before, after = passed
    assert (before.joint_names, before.height_m, before.trust) == ((), 1.8, "world")
    assert after.joint_names
    assert (after.height_m, after.trust) == (None, "")
    assert job.read(tmp_path / "again" / "job.toml").detected == str(tmp_path / "out.evidence.npz")


@fake
def test_what_is_wrong_with_a_job_is_found_before_the_video_is_looked_at(
    clip: Path, network: Loaded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = tmp_path / "mesh.toml"
    mesh.write_text('[[item]]\nname = "a"\nkind = "mesh"\nposition_m = [0, 0, 0]\nfile = "none.obj"\n')
    other = tmp_path / "job.toml"
    other.write_text(f'schema = "simrecon.job/1"\ninput = "{clip}"\noutput = "out"\nplanner = "nine"\n')
    base = ["run", str(clip), "-o", str(tmp_path / "out"), "--fov", "56"]
    for words, message in (
        ([*base, "--scene", str(tmp_path / "none.toml")], "none.toml"),
        ([*base, "--scene", str(mesh)], "none.obj"),
        ([*base, "--plan", "quik"], "did you mean 'quick'"),
        ([*base, "--keypoints", str(tmp_path / "none.json")], "none.json"),
        ([*base, "--camera", str(tmp_path / "none.yml")], "none.yml"),
        ([*base, "--video", str(tmp_path / "none.mp4")], "none.mp4"),
        ([*base, "--betas=9,9"], "--betas"),
        ([*base, "--trust", "mocab"], "did you mean 'mocap'"),
        ([*base[:3], str(clip / "out"), *base[4:]], "cannot be written"),
        (["run", "--job", str(other)], "'nine'"),
    ):
        if "--camera" in words:
            words = [word for word in words if word not in ("--fov", "56")]
        assert cli.main(words) == 2
        assert message in capsys.readouterr().err
    assert network.loaded == 0


def test_camera_options(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    camera = tmp_path / "camera.toml"
    camera.write_text("image_size_px = [160, 120]\nfocal_px = 150\n")
    base = ["run", str(clip), "-o", str(tmp_path / "out")]
    for more, message in (
        (["--camera", str(camera), "--fov", "50"], "--camera: found --fov beside it"),
        (["--camera-name", "cam"], "--camera-name: found no camera file"),
        (["--camera", str(camera), "--camera-name", "b"], "found 'b'; valid: camera"),
        (["--fov", "50", "--person-at", "3"], "such as 640,360, found '3'"),
    ):
        assert cli.main([*base, *more]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(("inside_trak", "iso"), [(False, False), (True, False), (False, True)])
@pytest.mark.parametrize(
    ("kind", "raw"), [(67, struct.pack(">i", 26)), (1, b"26"), (23, struct.pack(">f", 26))]
)
def test_focal_length_of_a_phone(tmp_path: Path, inside_trak: bool, iso: bool, kind: int, raw: bytes) -> None:
    path = tmp_path / "phone.mov"
    data = struct.pack(">II", kind, 0) + raw
    files.with_metadata(path, metadata.FOCAL_KEY, data, inside_trak=inside_trak, iso=iso)
    assert metadata.focal_35mm(path) == 26
    diagonal = np.hypot(1920, 1080)
    assert metadata.focal_px(26, (1920, 1080)) == pytest.approx(26 / np.hypot(36, 24) * diagonal)


@pytest.mark.parametrize("cut", [3, 20, 40, 80, 120])
def test_no_focal_length(tmp_path: Path, clip: Path, cut: int) -> None:
    assert metadata.focal_35mm(clip) is None
    path = tmp_path / "phone.mov"
    files.with_metadata(
        path, metadata.FOCAL_KEY, struct.pack(">IIi", 67, 0, 5000), inside_trak=False, iso=False
    )
    assert metadata.focal_35mm(path) is None  # beyond any lens
    path.write_bytes(path.read_bytes()[:cut])
    assert metadata.focal_35mm(path) is None


@fake
def test_focal_length_makes_the_lens(tmp_path: Path, clip: Path) -> None:
    movie = tmp_path / "meta.mov"
    data = struct.pack(">IIi", 67, 0, 26)
    files.with_metadata(movie, metadata.FOCAL_KEY, data, inside_trak=True, iso=False)
    both = tmp_path / "both.mp4"  # the metadata's movie box behind the clip's
    both.write_bytes(clip.read_bytes() + movie.read_bytes()[16:])
    found = evidence.read(both)
    assert "lens: 26 mm equivalent as the video says, 120 px" in found.reading
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.lens.matrix_px[0, 0], 26 / np.hypot(36, 24) * 200)


def test_hash_of_a_video_is_that_of_its_bytes(clip: Path) -> None:
    assert open_content(clip).sha256 == hashlib.sha256(clip.read_bytes()).hexdigest()
    assert evidence.is_video(clip)


def test_networks_say_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ai_edge_litert.interpreter", None)
    with pytest.raises(InputError, match=r"pip install '\.\[video\]'"):
        networks.Networks(tmp_path / "a", tmp_path / "b")


@pytest.mark.parametrize("camera", ["01", "03"])
def test_real_weights_on_a_real_video(camera: str, shared_data: Path) -> None:
    pytest.importorskip("ai_edge_litert", reason="the extra video is not installed")
    if (
        weights.state(weights.entry("heavy")) != "there"
        or weights.state(weights.entry("detector")) != "there"
    ):
        pytest.skip("the weights are not in the cache: simrecon models fetch")
    paths = weights.find("detector")[0], weights.find("heavy")[0]
    video = shared_data / "video" / f"pose2sim_beam_cam{camera}.mp4"
    reference = evidence.read(shared_data / "evidence" / f"pose2sim_beam_cam{camera}.npz")
    found = detection.follow(video, networks.Networks(*paths), Look())
    distance = np.linalg.norm(found.points_px - reference.keypoints_px, axis=-1)  # (T, 33)
    sure = reference.scores >= 0.5
    assert np.median(distance[sure]) <= 6
    by_frame = [np.median(row[ok]) for row, ok in zip(distance, sure, strict=True)]
    assert max(by_frame) < 30, "another person in some frame"
    assert not found.swapped.any()
