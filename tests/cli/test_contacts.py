"""`simrecon contacts`, and `--contacts`: from a result to a file, into jobs, and back into a report."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, results
from simrecon import job as jobs
from simrecon.batch import clips
from simrecon.cli import summary
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.job import Job, checking
from simrecon.pipeline import Reconstruction
from simrecon.results import contacts
from simrecon.types import ContactWish
from tests.support.runs import job_of

ASKED = (ContactWish("left_hand", "never"), ContactWish("back", "auto", ((0.0, 0.2),)))


def asking(run: Reconstruction) -> Reconstruction:
    """A run whose user wished for contacts."""
    return replace(run, fit=replace(run.fit, wished=wishes.targets(ASKED, run.fit.times_s)))


def test_what_touched_in_a_result_becomes_a_file_to_edit(
    run: Reconstruction, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, path = tmp_path / "out", tmp_path / "contacts.toml"
    results.write(job_of(out, contacts=ASKED), run)
    assert set(wishes.read(out / "contacts.toml")) == set(ASKED)
    assert cli.main(["contacts", "show", str(out), "-o", str(path)]) == 0
    assert "left_heel      touches" in capsys.readouterr().out
    assert set(wishes.read(path)) == set(ASKED)
    assert cli.main(["contacts", "show", str(out)]) == 0
    assert capsys.readouterr().out == path.read_text(encoding="utf-8")
    found = contacts.spans(run.fit.body, run.fit.scene, run.motion)
    assert found["back"] == found["left_hand"] == ()
    first, last = found["left_heel"][0][0], found["left_heel"][-1][1]
    assert first >= run.motion.times_s[0] - 0.1
    assert last <= run.motion.times_s[-1] + 0.1


def test_the_report_says_which_wishes_hold(run: Reconstruction, tmp_path: Path) -> None:
    result = results.write(job_of(tmp_path / "out", contacts=ASKED), asking(run))
    rows = {row["part"]: row for row in result.report["contacts"]["wishes"]}
    assert rows["left_hand"]["kind"] == "free"
    assert rows["left_hand"]["simulated_share"] == rows["left_hand"]["fit_share"] == 1.0
    assert rows["back"]["kind"] == "stay"
    assert rows["back"]["fit_share"] == rows["back"]["simulated_share"] == 0.0
    assert rows["back"]["apart_m"] > 0.3
    low, high = rows["back"]["cannot_s"][0]
    assert (low, high) == pytest.approx((0.0, 0.2), abs=0.05)
    text = summary.of(result)
    assert "contacts left_hand touches nothing in 100 %" in text
    assert "it cannot touch from 0.00 to 0.20 s: the input has it" in text


def test_without_wishes_a_result_holds_no_file_of_them(run: Reconstruction, tmp_path: Path) -> None:
    result = results.write(job_of(tmp_path / "out"), run)
    assert not (tmp_path / "out" / "contacts.toml").exists()
    assert result.report["contacts"]["wishes"] == []
    assert "contacts" not in summary.of(result)


def test_a_job_keeps_its_wishes(tmp_path: Path) -> None:
    job = Job("clip.npz", "out", contacts=ASKED)
    path = tmp_path / "job.toml"
    path.write_text(jobs.dumps(job), encoding="utf-8")
    assert set(jobs.read(path).contacts) == set(ASKED)
    assert set(checking.checked(job).contacts) == set(ASKED)
    assert jobs.identity(job) != jobs.identity(replace(job, contacts=()))
    (tmp_path / "own.toml").write_text(wishes.dumps(ASKED), encoding="utf-8")
    path.write_text('schema = "simrecon.job/1"\ninput = "a.npz"\noutput = "o"\ncontacts = "own.toml"\n')
    assert set(jobs.read(path).contacts) == set(ASKED)
    with pytest.raises(InputError, match="two wishes of one part"):
        checking.checked(replace(job, contacts=(ASKED[0], ASKED[0])))


def test_clips_of_a_batch_have_wishes_of_their_own(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        (tmp_path / name).touch()
    (tmp_path / "hand.toml").write_text(wishes.dumps(ASKED), encoding="utf-8")
    table = '[[clip]]\ninput = "a.npz"\ncontacts = "hand.toml"\n[[clip]]\ninput = "b.npz"\n'
    (tmp_path / "night.toml").write_text(table, encoding="utf-8")
    first, second = clips.collect([str(tmp_path / "night.toml")])
    assert set(first.job(tmp_path / "out").contacts) == set(ASKED)
    assert second.job(tmp_path / "out").contacts == ()


def test_what_cannot_be_asked_for_is_refused_ahead(
    tmp_path: Path, run: Reconstruction, capsys: pytest.CaptureFixture[str]
) -> None:
    out, path = tmp_path / "out", tmp_path / "far.toml"
    results.write(job_of(out), run)
    path.write_text(wishes.dumps((ContactWish("back", "auto", ((90.0, 91.0),)),)), encoding="utf-8")
    words = ["--height-m", "1.6", "--contacts", str(path), "-o", str(tmp_path / "new")]
    assert cli.main(["retarget", str(out), *words]) == 2
    assert "found contacts for a result that is retargeted" in capsys.readouterr().err
    clip = tmp_path / "clip.npz"
    times = np.arange(5) / 30
    names = ["left_hip", "right_hip", "left_ankle", "right_ankle"]
    joints = np.random.default_rng(0).normal(size=(5, 4, 3))
    np.savez(
        clip,
        schema="simrecon.evidence/1",
        times_s=times,
        joint_names=names,
        joints_m=joints,
        joints_frame="world",
    )
    assert cli.main(["run", str(clip), "--contacts", str(path), "-o", str(tmp_path / "new")]) == 2
    assert "[back] touch: found [90, 91], which holds no frame" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
    assert json.loads((out / "report.json").read_text())["contacts"]["source"]
