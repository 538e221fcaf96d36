"""What is opened, edited, run, compared, kept and saved; without a browser."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import cli
from simrecon import job as jobs
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.job import Job
from simrecon.results import Result, open_result
from simrecon.studio import comparing, opening, runs, saving
from simrecon.studio.asking import Wanted
from simrecon.studio.document import Document
from simrecon.studio.session import Session
from simrecon.studio.tab import Tab
from simrecon.types import ContactWish

Open = Callable[[Path, Result | Job], Tab]


def done(tab: Tab, wanted: Wanted) -> Tab:
    """The tab after a run."""
    run = tab.start(wanted)
    assert run.wait(120)
    assert run.progress.state == runs.DONE, run.progress.message
    return tab


def test_a_result_shows_its_motion_its_fit_and_its_contacts(tab: Tab, squat: Result) -> None:
    clip = tab.clip
    assert clip is not None
    assert clip.frames == len(squat.motion.times_s)
    assert clip.fit_qpos is not None
    assert np.isnan(clip.force_N()[0])
    assert np.nanmax(clip.force_N()) > 100
    assert set(clip.touched) >= {"left_heel", "back"}
    assert tab.document.scene == squat.scene
    assert not tab.unsaved


def test_a_bench_in_the_person_is_seen_at_once_and_gone_when_it_is_moved(tab: Tab) -> None:
    name = tab.document.add("bench", (0.0, 0.0, 0.0))
    (inside, *_) = tab.inside
    assert inside.name == name
    assert inside.depth_m > 0.05
    assert inside.frames == 9
    assert "frames: 0.00-0.30 s" in inside.words
    tab.document.set(name, {"position_m": [5.0, 0.0, 0.0]})
    assert all(one.name != name for one in tab.inside)
    tab.document.undo()
    assert tab.inside[0].name == name


def test_the_saved_job_gives_the_bits_of_the_run_from_the_shell(
    tab: Tab, tmp_path: Path, plan_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tab.document.add("bench", (1.0, 0.0, 0.0))
    wanted = Wanted(str(plan_file))
    done(tab, wanted)
    assert tab.after is not None
    assert tab.after.result.scene.items[0].name == "bench"
    saving.job(tab, tmp_path / "job.toml", wanted)
    assert not tab.document.unsaved
    capsys.readouterr()
    assert cli.main(["run", "--job", str(tmp_path / "job.toml"), "-o", str(tmp_path / "again")]) == 0
    first, again = tab.after.result.folder / "motion.npz", tmp_path / "again" / "motion.npz"
    assert first.read_bytes() == again.read_bytes()


def test_a_run_is_compared_kept_and_gone_on_from(tab: Tab, tmp_path: Path, plan_file: Path) -> None:
    told: list[str] = []
    tab.listeners.append(told.append)
    done(tab, Wanted(str(plan_file)))
    assert "run" in told
    assert {row.change for row in tab.table()} <= {"better", "worse", "same", "other", ""}
    made = tab.after
    assert made is not None
    assert tab.unsaved
    kept = tab.keep(tmp_path / "kept")
    assert not made.result.folder.exists()
    assert (tab.after, tab.base) == (None, kept)
    job = jobs.read(tmp_path / "kept" / "job.toml")
    assert job.output == str(tmp_path / "kept")
    assert job.start == str(tmp_path / "kept" / "start.npz")
    assert tab.job(Wanted()).start == str(tmp_path / "kept" / "motion.npz")
    assert np.array_equal(open_result(tmp_path / "kept").motion.qpos, made.clip.motion.qpos)  # type: ignore[union-attr]


def test_a_discarded_run_leaves_nothing(tab: Tab, plan_file: Path) -> None:
    done(tab, Wanted(str(plan_file)))
    assert tab.after is not None
    folder = tab.after.result.folder
    tab.discard()
    assert not folder.exists()
    assert (tab.preview, tab.table()) == (None, ())
    with pytest.raises(InputError, match="no result to keep"):
        tab.keep(folder)


def test_another_range_begins_with_the_fit_and_a_floor_found_stays_to_be_found(
    squat: Result, tab: Tab
) -> None:
    part = tab.job(Wanted(from_s=0.1, to_s=0.3))
    assert (part.reading.from_s, part.reading.to_s, part.start) == (0.1, 0.3, None)
    assert tab.job(Wanted(onwards=False)).start is None
    assert tab.job(Wanted(seed=7)).seed == 7
    squat.report["assumed"]["floor"] = {"origin": "estimated", "height_m": squat.scene.ground.height_m}
    squat.__dict__["job"] = replace(squat.job, scene=scenes.parse("[ground]\nheight_m = 0.3"))
    assert tab.job(Wanted()).scene.ground.height_m == 0.3
    tab.document.set("ground", {"height_m": 0.05})
    assert tab.job(Wanted()).scene.ground.height_m == 0.05


def test_a_run_that_is_stopped_keeps_its_windows_and_goes_on_there(tab: Tab, plan_file: Path) -> None:
    """And what it has solved is seen meanwhile."""
    first = threading.Event()
    tab.listeners.append(lambda _: first.set() if tab.run and tab.run.progress.known else None)
    run = tab.start(Wanted(str(plan_file)))
    with pytest.raises(InputError, match="goes on already"):
        tab.start(Wanted(str(plan_file)))
    assert first.wait(60)
    run.stop()
    assert run.wait(60)
    assert run.progress.state == runs.STOPPED
    solved = len(run.progress.known)
    assert solved >= 1
    preview = tab.preview
    assert preview is not None
    assert 0.05 < preview.times_s[-1] < 0.3
    assert "are kept" in run.progress.words
    again = tab.start(Wanted(str(plan_file)))
    seen: list[int] = []
    tab.listeners.append(lambda _: seen.append(len(again.progress.known)))
    assert again.wait(60)
    assert again.progress.state == runs.DONE
    assert again.progress.windows == len(again.progress.known) > solved


def test_a_run_that_fails_says_why(tab: Tab) -> None:
    def fail(*_: Any, **__: Any) -> Result:
        raise ValueError("no")

    run = tab.start(Wanted(), run=fail)
    assert run.wait(10)
    assert (run.progress.state, run.progress.message) == (runs.FAILED, "ValueError: no")
    with pytest.raises(InputError, match="plan"):
        tab.start(Wanted("no such plan"))


def test_edits_of_a_studio_that_was_killed_are_there_again(squat: Result, tab: Tab, open_tab: Open) -> None:
    tab.document.add("chair", (2.0, 0.0, 0.0))
    tab.document.set("ground", {"friction": 0.5})
    text = tab.document.edits.scene
    with (tab.journal.folder / "edits.jsonl").open("ab") as stream:
        stream.write(b'{"scene": "[ground]\\nfriction = 0.1", "wis')  # the kill came here
    other = open_tab(squat.folder, squat)
    assert not other.document.unsaved  # it is open elsewhere
    other.close()
    tab.journal.close()  # as the system does when a process ends
    again = open_tab(squat.folder, squat)
    assert again.restored == 2
    assert again.document.edits.scene == text
    assert again.unsaved
    again.document.undo()
    assert again.document.scene.ground.friction.sliding == 0.9


def test_edits_that_came_to_nothing_are_not_taken_up(squat: Result, tab: Tab, open_tab: Open) -> None:
    tab.document.add("chair", (2.0, 0.0, 0.0))
    tab.document.undo()
    tab.close()
    again = open_tab(squat.folder, squat)
    assert (again.restored, again.unsaved, again.document.undoes) == (0, False, "")


def test_a_run_that_was_left_is_found_again(squat: Result, tab: Tab, plan_file: Path, open_tab: Open) -> None:
    done(tab, Wanted(str(plan_file)))
    tab.close()
    again = open_tab(squat.folder, squat)
    (left,) = again.left()
    again.take_up(left)
    assert again.after is not None
    assert again.left() == ()
    assert again.job(Wanted()).output == ""


def test_files_are_written_where_the_user_says_and_nowhere_else(tab: Tab, tmp_path: Path) -> None:
    before = {path for path in tmp_path.rglob("*") if "cache" not in path.parts}
    name = tab.document.add("chair", (2.0, 0.0, 0.0))
    tab.document.wish((ContactWish("left_heel", touch=((0.0, 0.1),)),), "painted")
    saving.scene(tab, tmp_path / "room.toml")
    assert tab.document.unsaved
    saving.contacts(tab, tmp_path / "contacts.toml")
    assert not tab.document.unsaved
    assert tab.journal.kept() == ()
    assert scenes.read(tmp_path / "room.toml").items[0].name == name
    assert "found = " in (tmp_path / "contacts.toml").read_text()
    after = {path for path in tmp_path.rglob("*") if "cache" not in path.parts}
    assert after - before == {tmp_path / "room.toml", tmp_path / "contacts.toml"}
    with pytest.raises(InputError, match="exists already"):
        saving.scene(tab, tmp_path / "room.toml")
    saving.scene(tab, tmp_path / "room.toml", replaces=True)
    with pytest.raises(InputError, match=r"\.toml"):
        saving.scene(tab, tmp_path / "room.txt")


def test_a_scene_file_keeps_its_comments(squat: Result, tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text("# mine\n[ground]\nfriction = 0.7 # wood\n")
    session = Session()
    session.open(squat.folder, scene=path, load=False)
    assert session.current is not None
    session.current.document.add("box", (1.0, 0.0, 0.0))
    saving.scene(session.current, path)
    assert path.read_text().startswith("# mine\n[ground]\nfriction = 0.7 # wood\n")
    session.end()


def test_evidence_is_fitted_and_run(clip_file: Path, plan_file: Path, open_tab: Open) -> None:
    tab = open_tab(clip_file, opening.base_of(clip_file))
    assert tab.clip is None
    assert tab.preview is None
    tab.load()
    assert tab.failure == ""
    assert tab.clip is not None
    assert tab.clip.motion is None
    assert tab.seen is not None
    done(tab, Wanted(str(plan_file)))
    assert tab.after is not None
    rows = tab.table()  # of the run alone, for there is nothing to compare it with
    assert "force on the seat, N" in {row.name for row in rows}
    assert {(row.before, row.change) for row in rows} == {(None, "")}
    assert comparing.verdict(rows) == ""


def test_evidence_that_is_none_says_so(tmp_path: Path, open_tab: Open) -> None:
    path = tmp_path / "broken.npz"
    path.write_bytes(b"nothing")
    tab = open_tab(path, opening.base_of(path))
    tab.load()
    assert "broken.npz" in tab.failure
    with pytest.raises(InputError):
        opening.needed(tab.base, None, tab.document.scene)


def test_a_batch_opens_as_its_list_and_several_results_as_tabs(squat: Result, tmp_path: Path) -> None:
    session = Session()
    session.open(tmp_path, load=False)
    assert session.listed == (squat.folder,)
    assert session.current is None
    session.open(squat.folder, load=False)
    session.open(squat.folder, load=False)
    assert len(session.tabs) == 1
    assert session.current is session.tabs[0]
    assert session.player.span == pytest.approx((0.0, 0.3))
    session.close(session.tabs[0])
    assert session.current is None
    for path in (tmp_path / "none", tmp_path / "cache"):
        with pytest.raises(InputError, match="valid: a result"):
            session.open(path)


def test_suggestions_come_from_the_motion_where_the_evidence_is_gone(tab: Tab, clip_file: Path) -> None:
    assert opening.needed(tab.base, tab.clip, tab.document.scene).warning == ""
    clip_file.unlink()
    assert opening.needed(tab.base, tab.clip, tab.document.scene).suggestions == ()
    retargeted = Job("x", "", retarget=True, plan=plans.read("quick"))
    with pytest.raises(InputError, match="retargeted"):
        opening.evidence_of(retargeted)


def test_a_table_says_what_got_better() -> None:
    row = comparing.Row("loss", 10.0, 8.0, True)
    assert row.change == "better"
    assert replace(row, after=12.0).change == "worse"
    assert replace(row, after=10.01).change == "same"
    assert replace(row, less_is_better=False).change == "worse"
    assert replace(row, less_is_better=None).change == "other"
    assert replace(row, before=None).change == ""
    assert comparing.verdict((row, replace(row, after=12.0))) == "1 better, 1 worse"
    assert "| loss | 10 | 8 | **better** |" in comparing.markdown((row,))


def test_the_journal_is_plain_json(tab: Tab) -> None:
    tab.document.add("box", (0.0, 3.0, 0.0))
    (line,) = (tab.journal.folder / "edits.jsonl").read_bytes().splitlines()
    assert Document(json.loads(line)["scene"]).scene == tab.document.scene
