"""One clip in a worker: results, checkpoints, failures; no scheduler needed."""

from __future__ import annotations

import dataclasses
import shutil
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, pipeline, resources, results
from simrecon import plan as plans
from simrecon.batch import ahead, failures, journal, records, survey, work
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Places
from simrecon.batch.work import Assignment
from simrecon.engines import checkpoint
from simrecon.errors import InputError
from simrecon.evidence.video import weights
from simrecon.io.provenance import code_digest
from simrecon.job import Job
from simrecon.results import placing, report
from simrecon.types import Scene


@pytest.fixture
def job(inputs: Path, plan: str, tmp_path: Path) -> Assignment:
    """One clip of a batch that is at work in `tmp_path`."""
    clip = Clip("one", str(inputs / "one.npz"), plan)
    (tmp_path / ".batch").mkdir()
    journal.write_json(Places(tmp_path).lock, {"run": "me"})
    return Assignment(clip, str(tmp_path), "me", survey.survey(clip)["key"], code_digest())


@pytest.fixture(scope="session")
def undisturbed(inputs: Path, plan: str, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The bytes of `motion.npz` of the same clip without any batch."""
    folder = tmp_path_factory.mktemp("undisturbed") / "one"
    settings = plans.read(plan)
    made = pipeline.reconstruct(
        evidence.read(inputs / "one.npz"), Scene(), settings, pipeline.Setup(settings.planner, threads=1)
    )
    results.write(Job(str(inputs / "one.npz"), str(folder), plan=settings), made)
    return (folder / "motion.npz").read_bytes()


def split(told: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Events of stages, and the others."""
    stages = [event for event in told if event["event"] == "stage"]
    return stages, [event for event in told if event["event"] != "stage"]


def test_a_clip_becomes_a_result_with_the_bits_of_a_plain_run(job: Assignment, undisturbed: bytes) -> None:
    places, told = Places(Path(job.root)), list[dict[str, Any]]()
    said = work.solve(job, threads=1, tell=told.append)
    stages, told = split(told)
    assert [event["stage"] for event in stages] == ["kinematic fit"]
    assert said["figures"]["verdict"] == "all simulated"
    assert (places.result("one") / "motion.npz").read_bytes() == undisturbed
    windows = told[0]["windows"]
    assert windows >= 3
    assert [event["event"] for event in told] == ["started"] + ["window"] * windows
    assert [event["window"] for event in told] == list(range(windows + 1))
    assert (journal.read_json(places.record("one")) or {})["key"] == job.key
    assert places.thumbnail("one").read_bytes().startswith(b"\xff\xd8")
    assert not places.checkpoints("one").exists()
    assert f"window {windows} of {windows}" in places.log("one").read_text(encoding="utf-8")


def test_stopped_after_each_window_it_has_the_same_bits(job: Assignment, undisturbed: bytes) -> None:
    starts = []
    for _ in range(50):
        told: list[dict[str, Any]] = []
        said = work.solve(job, threads=2, tell=told.append, stop=lambda: True)
        starts.append(split(told)[1][0]["window"])
        if "figures" in said:
            break
        assert said["kind"] == "stopped"
    assert starts == list(range(len(starts)))
    assert len(starts) >= 3
    assert (Path(job.root) / "one" / "motion.npz").read_bytes() == undisturbed


def test_it_ends_when_another_batch_has_taken_the_folder(job: Assignment) -> None:
    journal.write_json(Places(Path(job.root)).lock, {"run": "another"})
    assert work.solve(job, threads=1)["kind"] == "stopped"


def test_what_a_killed_worker_left_half_done_is_removed(job: Assignment) -> None:
    root = Path(job.root)
    debris = [root / ".one.77.partial", root / ".one.78-1.partial", root / ".batch/checkpoints/one/old"]
    foreign = [
        ".one.b.77.partial",
        ".one_b.77.partial",
        ".one.79.partial",
        ".one.80.earlier",
        ".one.original",
    ]
    others = [root / name for name in foreign]
    for path in (*debris, *others):
        path.mkdir(parents=True)
        (path / "file").touch()
    for path in debris:
        (path / placing.MARK).touch()
    assert "figures" in work.solve(job, threads=1)
    assert not any(path.exists() for path in debris)
    assert all((path / "file").is_file() for path in others)


def test_a_worker_killed_between_two_renames_loses_no_result(job: Assignment) -> None:
    assert "figures" in work.solve(job, threads=1)
    root, places = Path(job.root), Places(Path(job.root))
    before = (root / "one" / "motion.npz").read_bytes()
    (root / "one").rename(root / ".one.77.earlier")
    work._tidy(places, job)
    assert (root / "one" / "motion.npz").read_bytes() == before
    shutil.copytree(root / "one", root / ".one.78.earlier")
    work._tidy(places, job)
    assert not (root / ".one.78.earlier").exists()


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:1000])


def flip(path: Path) -> None:
    raw = bytearray(path.read_bytes())
    raw[len(raw) // 2] ^= 1
    path.write_bytes(raw)


@pytest.mark.parametrize("name", ["motion.npz", "model.xml", "report.json"])
def test_a_damaged_result_is_not_done(job: Assignment, undisturbed: bytes, name: str) -> None:
    assert "figures" in work.solve(job, threads=1)
    places, facts = Places(Path(job.root)), {"name": "one", "key": job.key}
    file = places.result("one") / name
    assert ahead.is_done(places, facts, hashes=True)
    flip(file)
    assert ahead.is_done(places, facts)
    assert not ahead.is_done(places, facts, hashes=True)
    cut(file)
    assert not ahead.is_done(places, facts)
    assert "figures" in work.solve(job, threads=1)
    assert ahead.is_done(places, facts, hashes=True)
    assert (places.result("one") / "motion.npz").read_bytes() == undisturbed
    assert (places.inner / "earlier" / "one" / name).stat().st_size <= 1000  # what was there is kept


@pytest.mark.parametrize(
    "said", ["", "[]", '{"key": 1}', "[" * 9999, '{"figures": {"verdict": 5}, "key": "x", "files": {}}']
)
def test_a_record_of_another_form_is_none(tmp_path: Path, said: str) -> None:
    places = Places(tmp_path)
    places.record("one").parent.mkdir(parents=True)
    places.record("one").write_text(said, encoding="utf-8")
    assert records.read(places, "one") is None
    assert records.damage(places, "one") == "its record is damaged"


def test_what_was_moved_aside_stays(tmp_path: Path) -> None:
    places = Places(tmp_path)
    for text in "ab":
        places.result("one").mkdir()
        (places.result("one") / "file").write_text(text, encoding="utf-8")
        failures.set_aside(places, "one")
    kept = sorted((places.inner / "earlier").glob("*/file"))
    assert [path.read_text(encoding="utf-8") for path in kept] == ["a", "b"]


def test_another_version_refuses(job: Assignment) -> None:
    said = work.solve(replace(job, code="other"), threads=1)
    assert "another version of simrecon" in said["message"]


def test_a_clip_that_cannot_be_read_is_one_line(inputs: Path, plan: str) -> None:
    said = survey.survey(Clip("broken", str(inputs / "broken.npz"), plan))
    assert (said["name"], said["kind"]) == ("broken", "input")
    assert "broken.npz" in said["message"]
    assert "\n" not in said["message"]


def test_a_full_disk_is_told_from_other_errors() -> None:
    wrapped = InputError("cannot be written")
    wrapped.__cause__ = OSError(28, "No space left on device")
    assert failures.failure("a", wrapped)["kind"] == "disk"
    assert failures.failure("a", OSError(13, "Permission denied"))["kind"] == "error"
    assert failures.failure("a", InputError("bad"))["kind"] == "input"
    assert failures.failure("a", ValueError("x\ny"))["message"] == "ValueError: x y"


def test_a_full_disk_leaves_nothing_but_what_goes_on(
    job: Assignment, undisturbed: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A result whose report finds no space is made again from its windows."""
    root, told = Path(job.root), list[dict[str, Any]]()

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(report, "make", fail)
        said = work.solve(job, threads=1)
    assert said["kind"] == "disk"
    assert " is kept in " not in said["message"]
    assert [path.name for path in root.iterdir()] == [".batch"]
    assert "figures" in work.solve(job, threads=1, tell=told.append)
    started = split(told)[1][0]
    assert started["window"] == started["windows"]
    assert (root / "one" / "motion.npz").read_bytes() == undisturbed


def test_the_key_follows_all_that_the_result_depends_on(inputs: Path, plan: str, tmp_path: Path) -> None:
    clip = Clip("one", str(inputs / "one.npz"), plan)
    scene = tmp_path / "scene.toml"
    scene.write_text("[ground]\nheight_m = 0.1\n", encoding="utf-8")
    other = tmp_path / "plan.toml"
    text = Path(plan).read_text(encoding="utf-8")
    other.write_text(text.replace("generations = 12", "generations = 13"), encoding="utf-8")
    copy = tmp_path / "copy.toml"
    copy.write_text(text, encoding="utf-8")
    key = survey.survey(clip)["key"]
    changes: tuple[dict[str, Any], ...] = (
        {"input": str(inputs / "two.npz")}, {"plan": str(other)}, {"scene": str(scene)},
        {"options": {"seed": 1}}, {"options": {"mass_kg": 70.0}},
    )  # fmt: skip
    keys = [survey.survey(replace(clip, **change))["key"] for change in changes]
    assert len({key, *keys}) == 1 + len(changes)
    assert survey.survey(replace(clip, name="renamed", plan=str(copy)))["key"] == key


def test_a_piece_tells_what_a_clip_costs(inputs: Path, plan: str, tmp_path: Path) -> None:
    said = survey.measure(Clip("one", str(inputs / "one.npz"), plan), str(tmp_path / "out"))
    assert all(value > 0 for value in said.values())
    assert set(said) == {"kinematics_s", "first_s", "window_s", "bytes", "fixed_bytes"}


def test_a_damaged_checkpoint_is_solved_again(job: Assignment, undisturbed: bytes) -> None:
    root = Path(job.root)
    for _ in range(2):
        work.solve(job, threads=1, stop=lambda: True)
    first, second = sorted(root.glob(".batch/checkpoints/one/*/*/window_*.npz"))
    first.write_bytes(first.read_bytes()[:-200])
    told: list[dict[str, Any]] = []
    work.solve(job, threads=1, tell=told.append, stop=lambda: True)
    assert split(told)[1][0]["window"] == 0  # also the whole second one is not trusted
    while "figures" not in work.solve(job, threads=1):
        pass
    assert (root / "one" / "motion.npz").read_bytes() == undisturbed
    assert not second.exists()


def test_a_checkpoint_of_another_problem_is_not_used(job: Assignment, tmp_path: Path) -> None:
    store = checkpoint.Folder(tmp_path / "kept")
    read = evidence.read(job.clip.input)
    settings = plans.read(job.clip.plan)
    made = pipeline.reconstruct(read, Scene(), settings, pipeline.Setup(threads=1, checkpoint=store))
    assert store.restore("0" * 64, [window.window for window in made.windows]) == []


def test_a_checkpoint_that_does_not_go_on_from_the_one_before_is_not_used(
    job: Assignment, tmp_path: Path
) -> None:
    store = checkpoint.Folder(tmp_path / "kept")
    read, settings = evidence.read(job.clip.input), plans.read(job.clip.plan)
    first, second = pipeline.reconstruct(
        read, Scene(), settings, pipeline.Setup(threads=1, checkpoint=store)
    ).windows[:2]
    (digest,) = {path.name for path in (tmp_path / "kept").iterdir()}
    windows = [first.window, second.window]
    whole = store.digest
    assert whole.startswith(digest)
    assert len(store.restore(whole, windows)) == 2
    store.save(dataclasses.replace(first, states=first.states + 1e-9))
    assert len(store.restore(whole, windows)) == 1


def test_a_checkpoint_holds_everything_of_a_window(job: Assignment, tmp_path: Path) -> None:
    store = checkpoint.Folder(tmp_path / "kept")
    read, settings = evidence.read(job.clip.input), plans.read(job.clip.plan)
    made = pipeline.reconstruct(read, Scene(), settings, pipeline.Setup(threads=1, checkpoint=store))
    again = pipeline.reconstruct(read, Scene(), settings, pipeline.Setup(threads=1, checkpoint=store))
    for before, after in zip(made.windows, again.windows, strict=True):
        for item in dataclasses.fields(before):
            a, b = getattr(before, item.name), getattr(after, item.name)
            if item.name == "handover":
                np.testing.assert_array_equal(a.state, b.state)
                np.testing.assert_array_equal(a.knots_rad, b.knots_rad)
            else:
                assert type(a) is type(b), item.name
                np.testing.assert_array_equal(a, b)
    assert again.seconds["simulation"] >= sum(window.seconds for window in made.windows)


def test_stages_are_told_now_and_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    told: list[dict[str, Any]] = []
    clip = Assignment(Clip("a", "a.mp4"), str(tmp_path), "me", "key", "code")
    watcher = work._Watcher(Places(tmp_path), clip, told.append, lambda: False)
    for done in range(100):
        now[0] += 1.0
        watcher.stage("landmarks of a.mp4", done, 100)
    watcher.stage("kinematic fit", 0.0, 3.0)
    watcher.stage("simulation", 0.0, 3.0)
    assert [(event["stage"], event["part"]) for event in told[:3]] == [
        ("landmarks", 0.0), ("landmarks", 0.1), ("landmarks", 0.2),
    ]  # fmt: skip
    assert len(told) == 11
    assert told[-1]["stage"] == "kinematic fit"


def test_the_networks_are_part_of_a_video_s_key(
    inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path))
    video = Clip("v", str(resources.folder("example") / "beam.mp4"), "quick", options={"fov_deg": 40.0})
    said = survey.survey(video)
    assert said["kind"] == "input"
    assert "fetch them: simrecon models fetch" in said["message"]
    monkeypatch.setattr(weights, "find", lambda name: (Path(name), f"hash of {name}"))
    keys = [
        survey.survey(replace(video, options={**video.options, **model}))["key"]
        for model in ({}, {"model": "heavy"}, {"model": "full"})
    ]
    assert keys[0] != keys[1] != keys[2]
    assert survey._networks(Job(str(inputs / "one.npz"), "out")) == []
