"""Jobs that programs make obey the rules of job files, before any work."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import job as jobs
from simrecon import plan as plans
from simrecon import running
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading
from simrecon.types import Ground, Scene, SceneItem

NAN = float("nan")
QUICK = plans.read("quick")


def job(**changes: Any) -> Job:
    return Job(**{"input": "clip.npz", "output": "out", **changes})


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (job(threads=-1), "threads must be a whole number from 0 to 1024, found -1"),
        (job(seed=2**70), "seed must be"),
        (job(seed=1.5), "seed must be"),
        (job(seed=None), "seed must be"),
        (job(input=None), "input must be"),
        (job(plan="quick"), "plan must be a Plan, which simrecon.read_plan reads, found 'quick'"),
        (job(scene="room.toml"), "scene must be a Scene, which simrecon.read_scene reads"),
        (job(reading=None), "reading must be a Reading, found None"),
        (job(engine="samplin"), "there is no engine 'samplin'"),
        (job(planner="non"), "there is no planner 'non'"),
        (job(reading=Reading(ignore="joints")), "ignore must be a list"),  # type: ignore[arg-type]
        (job(reading=Reading(up="w")), "up must be one of x, y, z"),
        (job(reading=Reading(size_px=(0, 0))), "size_px must be"),
        (job(reading=Reading(fov_deg=500)), "fov_deg must be a number from 1 to 170, found 500"),
        (job(person=Person(height_m=99.0)), "height_m must be"),
        (job(person=Person(height_m=NAN)), "height_m must be"),
        (job(person=Person(betas=(0.0, NAN))), "betas must be"),
        (job(scene=Scene(Ground(height_m=NAN))), "height_m must be"),
        (job(scene=Scene(items=(SceneItem("a", "boks", (0, 0, 0), {}),))), "kind 'boks' is unknown"),
        (job(plan=replace(QUICK, window=replace(QUICK.window, overlap_s=9.0))), "overlap_s must be below"),
        ("job.toml", "job must be a simrecon.Job, found 'job.toml'"),
    ],
)
def test_what_a_job_file_could_not_hold_is_refused_in_one_line(given: Any, words: str) -> None:
    with pytest.raises(InputError) as caught:
        running.run(given)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "did you mean 'joints'" not in str(caught.value)


def test_threads_that_stand_in_for_the_jobs_are_checked() -> None:
    with pytest.raises(InputError, match="threads must be a whole number"):
        running.run(job(), threads=-1)


def test_values_of_paths_and_numpy_become_those_of_a_job_file(tmp_path: Path) -> None:
    size = np.array([0.4, 1.2, 0.45])
    item = SceneItem("bench", "box", (np.float64(0.2), 0.1, 0.0), {"size_m": size})  # type: ignore[dict-item]
    numbers = {"steps": np.int64(3), "width_m": 0.9, "run_m": 0.28, "rise_m": 0.17}
    stairs = SceneItem("stairs", "stairs", (2.0, 0.0, 0.0), numbers)  # type: ignore[arg-type]
    given = job(
        input=tmp_path / "clip.npz",
        seed=np.int64(3),
        person=Person(height_m=np.float32(1.75), betas=np.array([0.1, -0.2])),  # type: ignore[arg-type]
        scene=Scene(items=(item, stairs), folder=str(tmp_path)),
        plan=QUICK,
    )
    same = jobs.checked(given)
    assert (same.input, same.seed, type(same.seed)) == (str(tmp_path / "clip.npz"), 3, int)
    assert same.person == Person(height_m=1.75, betas=(0.1, -0.2))
    assert same.scene.items[0].parameters == {"size_m": (0.4, 1.2, 0.45)}
    assert same.scene.items[1].parameters == numbers
    assert type(same.scene.items[1].parameters["steps"]) is int
    assert (same.plan, same.plan.name, same.scene.folder) == (QUICK, "quick", str(tmp_path))
    assert jobs.checked(same) == same


def test_the_folder_of_a_scene_in_a_job_file_is_text(tmp_path: Path) -> None:
    text = 'schema = "simrecon.job/1"\ninput = "clip.npz"\noutput = "out"\n[scene]\nfolder = 3\n'
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"\[scene\] folder must be a path in quotes, found 3"):
        jobs.read(tmp_path / "job.toml")
