"""Jobs in files: what is written is what is read, wherever the files lie."""

from __future__ import annotations

import pickle
import re
import shutil
import textwrap
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from simrecon import job as jobs
from simrecon import plan as plans
from simrecon import resources, results, running
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading, request
from simrecon.job.files import with_paths
from simrecon.pipeline import Reconstruction
from simrecon.types import Ground, Scene, SceneItem
from tests.conftest import CHECKOUT
from tests.support import video_files
from tests.support.runs import job_of


@pytest.fixture
def job(tmp_path: Path) -> Job:
    """A job that says everything."""
    for name in ("clip.npz", "points.json", "camera.toml", "body.npz", "start.npz"):
        (tmp_path / name).write_bytes(name.encode())
    item = SceneItem("bench", "box", (0.2, 0.1, 0.0), {"size_m": (0.4, 1.2, 0.45)}, yaw_rad=0.1)
    return Job(
        str(tmp_path / "clip.npz"),
        str(tmp_path / "out"),
        reading=Reading(
            up="y",
            fps=29.97,
            size_px=(1920, 1080),
            keypoints=str(tmp_path / "points.json"),
            camera=str(tmp_path / "camera.toml"),
            person_at_px=(640.0, 360.5),
            ignore=("joints",),
            unknown_camera=True,
        ),
        person=Person(height_m=1.7, betas=(0.1, -2.5e-3), body_model=str(tmp_path / "body.npz")),
        scene=Scene(Ground(height_m=0.1, calibrate=True), (item,), str(tmp_path)),
        plan=plans.read("quick"),
        seed=7,
        threads=2,
        start=str(tmp_path / "start.npz"),
    )


def test_what_is_written_is_what_is_read(job: Job, tmp_path: Path) -> None:
    known = replace(job, sha256=request.hashes(job))
    (tmp_path / "job.toml").write_text(jobs.dumps(known), encoding="utf-8")
    again = jobs.read(tmp_path / "job.toml")
    assert again == known
    assert again.plan.name == "quick"
    assert again.scene.folder == str(tmp_path)


def test_relative_paths_begin_at_the_file(job: Job, tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    text = 'schema = "simrecon.job/1"\ninput = "../clip.npz"\noutput = "out"\nplan = "quick"\n'
    (tmp_path / "below" / "own.toml").write_text(
        text + '[reading]\ncamera = "../camera.toml"\n', encoding="utf-8"
    )
    own = jobs.read(tmp_path / "below" / "own.toml")
    assert own.input == job.input
    assert own.output == str(tmp_path / "below" / "out")
    assert own.reading.camera == job.reading.camera
    assert own.plan == plans.read("quick")
    assert own.scene.ground == Ground()


def test_a_plan_of_ones_own_lies_beside_the_job(tmp_path: Path) -> None:
    hasty = (resources.folder("windows") / "quick.toml").read_text(encoding="utf-8")
    assert "population = " in hasty
    (tmp_path / "hasty.toml").write_text(
        hasty.replace("population = ", "population = 1", 1), encoding="utf-8"
    )
    text = 'schema = "simrecon.job/1"\ninput = "clip.npz"\noutput = "out"\nplan = "hasty.toml"\n'
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    assert jobs.read(tmp_path / "own.toml").plan == plans.read(tmp_path / "hasty.toml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("simrecon.job/1", "simrecon.job/9"), "schema is 'simrecon.job/9'; valid: 'simrecon.job/1'"),
        (("seed = 7", "sed = 7"), "unknown key 'sed', did you mean 'seed'?"),
        (("seed = 7", "seed = -1"), "seed must be a whole number from 0"),
        (("[reading]", "[readin]"), "unknown key 'readin', did you mean 'reading'?"),
        (("fps = 29.97", "fps = 1e9"), "[reading]: fps must be a number from 2 to 2000"),
        (('up = "y"', 'up = "w"'), "[reading]: up must be one of x, y, z"),
        (("height_m = 1.7", "heigth_m = 1.7"), "did you mean 'height_m'?"),
        (('kind = "box"', 'kind = "boks"'), "boks"),
        (("population = ", "popularity = "), "did you mean 'population'?"),
    ],
)
def test_mistakes_are_one_line(job: Job, tmp_path: Path, change: tuple[str, str], words: str) -> None:
    text = jobs.dumps(job)
    assert change[0] in text
    path = tmp_path / "job.toml"
    path.write_text(text.replace(*change, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        jobs.read(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_job_is_frozen_in_depth_and_has_a_hash(job: Job, tmp_path: Path) -> None:
    parameters: dict[str, Any] = {"size_m": [0.4, 1.2, 0.45]}
    item, known = SceneItem("bench", "box", (0.0, 0.0, 0.0), parameters), request.hashes(job)
    one = replace(job, scene=Scene(items=(item,)), sha256=known)
    before = hash(one)
    parameters["size_m"][0], known[job.input] = 9.0, "0"
    assert one.scene.items[0].parameters == {"size_m": (0.4, 1.2, 0.45)}
    (tmp_path / "job.toml").write_text(jobs.dumps(one), encoding="utf-8")
    other = jobs.read(tmp_path / "job.toml")
    copied = pickle.loads(pickle.dumps(one))
    assert before == hash(one) == hash(other) == hash(copied)
    assert {one, other, copied} == {one}
    assert hash(replace(one, sha256={})) != before
    for table in (one.sha256, one.scene.items[0].parameters):
        with pytest.raises(TypeError):
            table["a"] = 1  # type: ignore[index]


def test_files_that_changed_are_found(job: Job, tmp_path: Path) -> None:
    known = replace(job, sha256=request.hashes(job))
    assert request.changed(known) == ()
    assert request.changed(job) == ()  # it knows no hashes
    (tmp_path / "points.json").write_text("others", encoding="utf-8")
    (tmp_path / "body.npz").unlink()
    assert request.changed(known) == (str(tmp_path / "points.json"), str(tmp_path / "body.npz"))


def test_a_hash_counts_for_the_path_that_it_was_made_of(job: Job, tmp_path: Path) -> None:
    known = replace(job, sha256=request.hashes(job))
    (tmp_path / "other.npz").write_bytes(b"another file")
    other = str(tmp_path / "other.npz")
    for changed in (
        replace(known, input=other),
        replace(known, start=other),
        replace(known, reading=replace(job.reading, keypoints=other)),
    ):
        assert request.changed(changed) == ()
    assert request.changed(request.moved(known, "input", other)) == (other,)  # said to be the same file
    (tmp_path / "clip.npz").write_bytes(b"another clip")
    assert request.changed(known) == (job.input,)
    assert request.changed(request.taken_anew(known, ("input",))) == ()


def test_the_hash_of_the_motion_to_begin_from_moves_with_it_into_the_result(
    run: Reconstruction, tmp_path: Path
) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    results.write(job_of(first), run)
    job = job_of(again, start=str(first / "motion.npz"))
    results.write(replace(job, sha256=request.hashes(job)), run)
    kept = results.open_result(again).job
    assert kept.start == str(again / "start.npz")
    assert kept.sha256[kept.start] == request.hashes(job)[str(first / "motion.npz")]
    assert request.changed(kept) == ()


def test_the_identity_holds_all_that_a_motion_depends_on(job: Job, tmp_path: Path) -> None:
    before = jobs.identity(job)
    ground = replace(job.scene, ground=Ground(height_m=0.2))
    others = [
        replace(job, seed=8),
        replace(job, engine="other"),
        replace(job, planner="other"),
        replace(job, plan=plans.read("default")),
        replace(job, person=Person()),
        replace(job, reading=replace(job.reading, ignore=())),
        replace(job, scene=ground),
        replace(job, start=None),
    ]
    identities = {jobs.identity(other) for other in others}
    assert len(identities | {before}) == 1 + len(others)
    (tmp_path / "clip.npz").write_bytes(b"another clip")
    assert jobs.identity(job) != before


def test_the_identity_holds_nothing_else(job: Job, tmp_path: Path) -> None:
    (tmp_path / "moved").mkdir()
    moved = with_paths(job, lambda path: str(tmp_path / "moved" / Path(path).name))
    for name in ("clip.npz", "points.json", "camera.toml", "body.npz", "start.npz"):
        (tmp_path / "moved" / name).write_bytes((tmp_path / name).read_bytes())
    named = replace(job.plan, name="of my own")
    same = replace(moved, threads=1, video="film.mp4", output="elsewhere", plan=named)
    assert jobs.identity(same) == jobs.identity(job)


def test_the_video_beside_an_input_counts_as_far_as_it_decides(job: Job, tmp_path: Path) -> None:
    grey, other = (video_files.scene(people) for people in ([], [(80.0, 60.0, 60.0, video_files.RED)]))
    videos = [
        video_files.write(tmp_path / f"{i}.mp4", images, fps)
        for i, (images, fps) in enumerate((([grey] * 2, 30.0), ([other] * 2, 30.0), ([grey] * 2, 25.0)))
    ]
    shown = [replace(job, video=str(video)) for video in videos]
    first, drawn, slower = (jobs.identity(each) for each in shown)
    assert first == drawn
    assert first != slower
    known = replace(shown[0], sha256=request.hashes(shown[0]))
    assert request.changed(known) == ()
    shutil.copy(videos[1], videos[0])
    assert request.changed(known) == (str(videos[0]),)


def test_hashes_of_a_job_without_files_are_empty() -> None:
    assert request.hashes(Job("none.npz", "out", plan=plans.read("quick"))) == {}


def test_the_example_of_the_documentation_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (CHECKOUT / "docs" / "formats.md").read_text(encoding="utf-8")
    (block,) = re.findall(r'(?m)^    schema = "simrecon\.job/1"\n(?:    .*\n|\n)*', page)
    (tmp_path / "job.toml").write_text(textwrap.dedent(block), encoding="utf-8")
    example = resources.folder("example")
    for name in ("clip.npz", "clip.mp4"):
        shutil.copy(example / name.replace("clip", "beam"), tmp_path / name)
    lens = "image_size_px = [1080, 1920]\nfocal_px = 1600\ncentre_px = [540, 960]\n"
    (tmp_path / "lens.toml").write_text(lens, encoding="utf-8")
    begun: list[Any] = []

    def reconstruct(*given: Any) -> None:
        begun.extend(given)
        raise InputError("enough")

    monkeypatch.setattr(running, "reconstruct", reconstruct)
    with pytest.raises(InputError, match="enough"):
        running.run(jobs.read(tmp_path / "job.toml"))
    seen, scene, plan, _ = begun
    assert (seen.height_m, seen.camera.lens.matrix_px[0, 0]) == (1.75, 1600)
    assert (scene.items, plan) == ((), plans.read("default"))
    assert plan.name == "default"


def test_what_a_plan_in_a_job_leaves_out_has_its_default(tmp_path: Path) -> None:
    text = 'schema = "simrecon.job/1"\ninput = "clip.npz"\noutput = "out"\n'
    file = tmp_path / "job.toml"
    file.write_text(text + "[plan.optimiser]\ngenerations = 7\n", encoding="utf-8")
    usual = plans.read("default")
    own = jobs.read(file).plan
    assert own == replace(usual, optimiser=replace(usual.optimiser, generations=7))
    assert own.name == ""
    file.write_text(text + "[plan.optimiser]\ngeneration = 7\n", encoding="utf-8")
    with pytest.raises(InputError, match="'generation'"):
        jobs.read(file)
