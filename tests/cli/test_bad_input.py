"""Whatever the user gets wrong: one line that says what, exit status 2, and nothing left behind."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from simrecon import cli, resources

EXAMPLE = resources.folder("example")
Content = dict[str, Any]
Change = Callable[[Content], object]


def content(frames: int = 20) -> Content:
    """The first frames of the example, as the arrays of its file."""
    with np.load(EXAMPLE / "beam.npz", allow_pickle=False) as archive:
        arrays = {key: archive[key] for key in archive.files}
    for key in ("times_s", "keypoints_px", "keypoint_scores", "joints_m"):
        arrays[key] = arrays[key][:frames]
    return arrays


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """Good evidence."""
    np.savez(tmp_path / "clip.npz", **content())
    return tmp_path / "clip.npz"


def refused(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, given: list[str]
) -> str:
    """The one line that a command ends with; `folder` is where it runs."""
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    assert cli.main(given) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.endswith("\n")
    (line,) = shown.err.splitlines()
    assert line.startswith("simrecon: error: ")
    assert sorted(folder.rglob("*")) == before
    return line


def rename(key: str, old: str, new: str) -> Change:
    def change(arrays: Content) -> None:
        arrays[key] = np.array([new if name == old else name for name in arrays[key]])

    return change


def fill(*keys: str) -> Change:
    def change(arrays: Content) -> None:
        for key in keys:
            arrays[key][...] = np.nan

    return change


def ignored_only(arrays: Content) -> None:
    """2D landmarks that are known, but are no fixed points of the body."""
    for key in ("joint_names", "joints_m", "joints_frame"):
        del arrays[key]
    arrays["keypoint_names"] = np.array(["torso", "background"])
    arrays["keypoints_px"] = arrays["keypoints_px"][:, :2]
    arrays["keypoint_scores"] = arrays["keypoint_scores"][:, :2]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda a: a.update(schema="simrecon.evidence/9"), ("schema", "evidence/9", "evidence/1")),
        (lambda a: a.pop("schema"), ("schema", "no such key")),
        (lambda a: a.update(keypoints_px=a["keypoints_px"][:, :5]), ("keypoints_px", "(20, 5, 2)", "J = 33")),
        (lambda a: a.update(joints_m=a["joints_m"][:7]), ("joints_m", "(7, 33, 3)", "T = 20")),
        (lambda a: a.update(camera_K=np.eye(4)), ("camera_K", "(4, 4)", "(3, 3)")),
        (fill("keypoints_px", "joints_m"), ("keypoints_px", "NaN everywhere")),
        (fill("joints_m"), ("joints_m", "NaN everywhere")),
        (fill("times_s"), ("times_s", "NaN")),
        (lambda a: a.update(times_s=a["times_s"][::-1]), ("times_s", "increasing")),
        (lambda a: a.update(content(1)), ("times_s", "single frame", "two frames")),
        (rename("joint_names", "left_knee", "left_kneee"), ("joint_names", "left_kneee", "left_knee,")),
        (rename("keypoint_names", "nose", "snout"), ("keypoint_names", "snout", "nose,")),
        (lambda a: a.pop("camera_K"), ("camera_K", "no such key")),
        (
            lambda a: [a.pop(key) for key in ("camera_K", "camera_dist", "world_to_camera")],
            ("camera_K", "without a camera"),
        ),
        (lambda a: a.update(mas_kg=70.0), ("mas_kg", "mass_kg")),
        (lambda a: a.update(betas=np.array([{}])), ("betas", "Python objects")),
        (ignored_only, ("no point of the body",)),
    ],
)
def test_bad_evidence(
    change: Change,
    words: tuple[str, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arrays = content()
    change(arrays)
    np.savez(tmp_path / "clip.npz", **arrays)
    given = ["run", "clip.npz", "-o", "out", "--plan", "quick"]
    line = refused(tmp_path, capsys, monkeypatch, given)
    for word in words:
        assert word in line


@pytest.mark.parametrize("kept", [0, 3, 100, 30_000, -40])
def test_a_corrupt_file(
    kept: int, clip: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clip.write_bytes(clip.read_bytes()[:kept])
    line = refused(clip.parent, capsys, monkeypatch, ["run", "clip.npz", "-o", "out"])
    assert line.startswith("simrecon: error: clip.npz: ")


def edited(folder: Path, name: str, source: Path, old: str, new: str) -> None:
    text, count = re.subn(old, new, source.read_text(encoding="utf-8"), count=1)
    assert count == 1
    (folder / name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([], ("COMMAND", "-h")),
        (["rum"], ("'rum'", "run", "demo", "eval")),
        (["run"], ("INPUT", "-o")),
        (["run", "clip.npz"], ("-o",)),
        (["run", "nowhere.npz", "-o", "out"], ("nowhere.npz", "existing")),
        (["run", "nowhere.npz", "-o", "mine"], ("nowhere.npz", "existing")),
        (["run", ".", "-o", "out"], (".:", "a folder of no known format", "`simrecon batch`")),
        (["run", "result", "-o", "out"], ("result:", "the result of a run", "`simrecon rerun`")),
        (["run", "clip.npz", "-o", "out", "--sed", "1"], ("--sed",)),
        (["run", "clip.npz", "-o", "out", "--engine", "centroidal"], ("centroidal", "sampling")),
        (["run", "clip.npz", "-o", "out", "--seed", "-1"], ("--seed", "'-1'", "0 to")),
        (["run", "clip.npz", "-o", "out", "--threads", "two"], ("--threads", "'two'")),
        (["run", "clip.npz", "-o", "out", "--height-m", "175"], ("--height-m", "'175'", "0.4 to 2.8")),
        (["run", "clip.npz", "-o", "out", "--mass-kg", "nan"], ("--mass-kg", "'nan'")),
        (["run", "clip.npz", "-o", "out", "--plan", "defualt"], ("'defualt'", "did you mean 'default'")),
        (["run", "clip.npz", "-o", "out", "--plan", "plan.toml"], ("plan.toml", "'sigma_rda'", "sigma_rad")),
        (["run", "clip.npz", "-o", "out", "--plan", "clip.npz"], ("clip.npz", "plan")),
        (["run", "clip.npz", "-o", "out", "--scene", "scene.toml"], ("scene.toml", "'bean'", "beam")),
        (["run", "clip.npz", "-o", "out", "--scene", "none.toml"], ("none.toml",)),
        (["run", "clip.npz", "-o", "out", "--video", "none.mp4"], ("none.mp4", "no such")),
        (["run", "clip.npz", "-o", "out", "--video", "clip.npz"], ("clip.npz", "video")),
        (["run", "clip.npz", "-o", "out", "--video", "wide.mp4"], ("64 x 36", "1080 x 1920", "aspect")),
        (["run", "clip.npz", "-o", "clip.npz/out"], ("clip.npz/out", "cannot be written")),
        (["run", "clip.npz", "-o", "clip.npz"], ("clip.npz", "found a file")),
        (["run", "clip.npz", "-o", "mine"], ("mine", "thesis.txt")),
        (["demo", "-o", "clip.npz/out"], ("clip.npz/out", "cannot be written")),
        (["demo", "--plan", "plan.toml"], ("'sigma_rda'",)),
        (["eval", "nowhere", "clip.npz"], ("nowhere", "folder")),
        (["eval", "mine"], ("TRUTH",)),
        (["eval", "mine", "clip.npz"], ("mine", "motion.npz")),
    ],
)  # fmt: skip
def test_bad_usage(
    given: list[str],
    words: tuple[str, ...],
    clip: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = clip.parent
    edited(folder, "plan.toml", resources.folder("windows") / "quick.toml", "sigma_rad =", "sigma_rda =")
    edited(folder, "scene.toml", EXAMPLE / "beam.toml", 'kind = "beam"', 'kind = "bean"')
    (folder / "mine").mkdir()
    (folder / "result").mkdir()
    (folder / "result" / "report.json").write_text("{}", encoding="utf-8")
    (folder / "mine" / "thesis.txt").write_text("years of work", encoding="utf-8")
    film = cv2.VideoWriter(str(folder / "wide.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), 60, (64, 36))
    for _ in range(20):
        film.write(np.zeros((36, 64, 3), np.uint8))
    film.release()
    line = refused(folder, capsys, monkeypatch, given)
    for word in words:
        assert word in line


def test_a_video_but_no_camera(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arrays = content()
    dropped = ("camera_K", "camera_dist", "world_to_camera")
    kept = {k: v for k, v in arrays.items() if k not in dropped and not k.startswith("keypoint")}
    np.savez(tmp_path / "clip.npz", **kept)
    given = ["run", "clip.npz", "-o", "out", "--video", str(EXAMPLE / "beam.mp4")]
    assert "camera_K" in refused(tmp_path, capsys, monkeypatch, given)
