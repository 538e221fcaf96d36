"""Events, lock and state of a batch on disk."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from simrecon.batch import forecast, journal, status
from simrecon.batch.journal import Journal, Places
from simrecon.errors import InputError
from simrecon.io.full import DiskFullError


def test_events_survive_a_line_that_was_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "batch.jsonl"
    for first in (1, 2):
        book = Journal(path)
        book.append("window", clip="a", window=first)
        book.close()
        with path.open("ab") as stream:
            stream.write(b'{"event": "win')
    assert [event["window"] for event in journal.read_events(path)] == [1, 2]


def test_a_full_disk_is_said(tmp_path: Path) -> None:
    book = Journal(Path("/dev/full"))
    with pytest.raises(OSError, match="No space left") as raised:
        book.append("window")
    book.close()
    error = journal.cannot_write(tmp_path, raised.value)
    assert isinstance(error, DiskFullError)
    assert "make space, then give the same command again" in str(error)


def test_a_folder_has_one_batch_at_a_time(tmp_path: Path) -> None:
    places = Places(tmp_path)
    assert journal.holder(places) is None
    with journal.locked(places, "me"):
        assert journal.check_alive(places, "me")
        assert (journal.holder(places) or {})["run"] == "me"
        with pytest.raises(InputError, match="another batch at work"), journal.locked(places, "you"):
            pass
        assert journal.check_alive(places, "me")
    assert journal.holder(places) is None
    with journal.locked(places, "you"):
        assert not journal.check_alive(places, "me")


def write(places: Places, *events: dict[str, Any]) -> None:
    lines = [json.dumps({"time": float(i), **event}) + "\n" for i, event in enumerate(events)]
    places.events.write_text("".join(lines), encoding="utf-8")


def clip(name: str, **more: Any) -> dict[str, Any]:
    return {"event": "clip", "clip": name, "state": "waiting", "video_s": 10.0, "windows": 5, **more}


NIGHT = (
    {"event": "begin"},
    clip("a"),
    clip("b"),
    clip("c", state="kept"),
    clip("d"),
    {"event": "started", "clip": "a", "window": 0, "windows": 5},
    {"event": "window", "clip": "a", "window": 1, "windows": 5, "loss": 3.25},
    {"event": "failed", "clip": "d", "message": "no good"},
)


def test_the_state_follows_from_the_events(tmp_path: Path) -> None:
    places = Places(tmp_path)
    write(places, *NIGHT)
    with journal.locked(places, "me"):
        state = status.read(places, now=8.0)
        assert {row.name: row.state for row in state.rows.values()} == {
            "a": "running", "b": "waiting", "c": "done", "d": "failed",
        }  # fmt: skip
        # 2 s of video in 8 s; 8 s of `a` and 10 s of `b` are left
        assert state.left_s == pytest.approx(72.0)
        text = status.text(state, "OUT", now=8.0)
    assert "running  a  window 1 of 5, loss 3.2" in text
    assert "failed   d  no good" in text
    assert "4 clips: 1 done, 1 running, 1 waiting, 1 failed" in text


def test_a_clip_before_its_first_window_runs_too(tmp_path: Path) -> None:
    places = Places(tmp_path)
    stage = {"event": "stage", "clip": "b", "stage": "landmarks", "part": 0.35}
    write(places, *NIGHT, stage)
    with journal.locked(places, "me"):
        state = status.read(places)
    assert "running  b  landmarks, 35%" in status.text(state, "x")
    assert "running  a  window 1 of 5, loss 3.2" in status.text(state, "x")
    write(places, *NIGHT, stage, {"event": "started", "clip": "b", "window": 0, "windows": 5})
    with journal.locked(places, "me"):
        assert "running  b  window 0 of 5" in status.text(status.read(places), "x")


def test_a_killed_batch_runs_nothing(tmp_path: Path) -> None:
    places = Places(tmp_path)
    write(places, *NIGHT)
    state = status.read(places)
    assert [row.name for row in state.of("running")] == []
    assert [row.name for row in state.of("waiting")] == ["a", "b"]
    assert "was killed; the same command goes on" in status.text(state, "OUT")


def test_only_the_last_run_counts(tmp_path: Path) -> None:
    places = Places(tmp_path)
    write(places, *NIGHT, {"event": "begin"}, clip("a"), {"event": "end", "reason": "stopped at 07:00"})
    state = status.read(places)
    assert list(state.rows) == ["a"]
    assert "stopped at 07:00" in status.text(state, "OUT")


def test_no_batch_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found no batch there"):
        status.read(Places(tmp_path))


def test_the_forecast_shares_clips_out() -> None:
    assert forecast.makespan_s([4, 3, 3, 2], jobs=2, cores=2) == pytest.approx(6)
    assert forecast.makespan_s([], jobs=2, cores=2) == 0
    assert forecast.makespan_s([4, 3, 3], jobs=1, cores=1) == pytest.approx(10)
    assert 5 <= forecast.makespan_s([10], jobs=2, cores=2) < 10
    row = {"kinematics_s": 1.0, "first_s": 4.0, "window_s": 2.0, "bytes": 100.0, "fixed_bytes": 50.0}
    found = forecast.cost([row, row])
    assert found.seconds(10.0, windows=6) == pytest.approx(10 + 4 + 10)
    assert found.size_bytes(10.0) == pytest.approx(1050)


def test_any_name_and_any_letter_is_an_event_of_one_line(tmp_path: Path) -> None:
    book = Journal(tmp_path / "batch.jsonl")
    names = ["a\u2028b\x85c", os.fsdecode(b"caf\xe9"), "\x1b]0;x\x07"]
    for name in names:
        book.append("clip", clip="a", input=name)
    book.close()
    assert [event["input"] for event in journal.read_events(tmp_path / "batch.jsonl")] == names


@pytest.mark.parametrize(
    "line",
    [
        "[]", "3", "null", '{"event": 1, "time": 1}', '{"event": "begin"}', "[" * 9999, "NaN",
        '{"event": "clip", "time": 1, "clip": ["a"]}', '{"event": "window", "time": 1, "loss": "x"}',
        '{"event": "window", "time": 1, "loss": 1e400}', '{"event": "end", "time": 1' + "0" * 400 + "}",
    ],
)  # fmt: skip
def test_a_line_of_another_form_is_passed_over(tmp_path: Path, line: str) -> None:
    places = Places(tmp_path)
    write(places, *NIGHT)
    with places.events.open("a", encoding="utf-8") as stream:
        stream.write(line + "\n")
    assert len(journal.read_events(places.events)) == len(NIGHT)
    assert len(status.text(status.read(places), "out").splitlines()) > 2
