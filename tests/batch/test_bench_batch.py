"""The arithmetic of tools/bench/batch.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from simrecon import evidence
from tools.bench import batch


def stage(time: float, clip: str) -> dict[str, Any]:
    return {"time": time, "event": "stage", "clip": clip, "stage": "kinematic fit", "part": 0.0}


def started(time: float, clip: str, worker: str) -> dict[str, Any]:
    return {"time": time, "event": "started", "clip": clip, "worker": worker, "window": 0, "windows": 4}


def done(time: float, clip: str, here_s: float) -> dict[str, Any]:
    return {"time": time, "event": "done", "clip": clip, "figures": {"here_s": here_s}}


def test_what_is_in_no_clip_is_scheduling() -> None:
    events = (
        {"time": 101.0, "event": "begin"},
        stage(103.0, "a"), started(104.0, "a", "one"), stage(103.5, "b"), started(105.0, "b", "two"),
        done(113.0, "a", 9.5), stage(113.5, "c"), started(114.0, "c", "one"),
        done(116.5, "b", 13.0), done(120.0, "c", 6.0),
    )  # fmt: skip
    start_s, clip_s = batch.scheduling(events, 100.0)
    assert start_s == 3.0
    # one: 17 s, of which 15.5 in its clips; two: 13 s, all of it
    assert clip_s == pytest.approx(1.5 / 3)


def test_the_table_takes_the_median_and_counts_files() -> None:
    row = {"in_turn_s": 20.0, "batch_s": 10.0, "ratio": 2.0, "start_s": 3.0, "clip_s": 0.25, "differ": 0}
    text = batch.section([row, row | {"ratio": 9.0, "differ": 2}, row | {"ratio": 1.0}], "8 clips", 0.1)
    assert "| 2.00 × | ≥ 1.15 × |" in text
    assert "| files that differ | 2 | 0 |" in text


def test_clips_are_pieces_of_the_example(tmp_path: Path) -> None:
    paths = batch.cut(tmp_path / "clips", 3, 0.5)
    clips = [evidence.read(path) for path in paths]
    assert [len(clip.times_s) for clip in clips] == [31, 31, 31]
    assert clips[0].times_s[0] < clips[1].times_s[0] < clips[2].times_s[0]
