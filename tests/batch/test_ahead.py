"""Reading of all inputs before a batch begins."""

from __future__ import annotations

import contextlib
import queue
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from simrecon.batch import ahead, cluster, forecast
from simrecon.errors import InputError


class Crew:
    """Workers of which some die: `deaths` by name of the clip, how often."""

    def __init__(self, deaths: dict[str, int]) -> None:
        self.inbox: queue.Queue[tuple[str, Any]] = queue.Queue()
        self.deaths = dict(deaths)

    def survey(self, clip: Any) -> int:
        dead = self.deaths.get(clip.name, 0) > 0
        self.deaths[clip.name] = self.deaths.get(clip.name, 0) - 1
        item = SimpleNamespace(name=clip.name, dead=dead)
        self.inbox.put(("done", id(item)))
        ITEMS[id(item)] = item
        return id(item)


ITEMS: dict[int, Any] = {}


@pytest.mark.parametrize(("deaths", "failed"), [(0, False), (1, False), (2, True)])
def test_an_input_is_read_once_more_if_its_worker_died(
    monkeypatch: pytest.MonkeyPatch, deaths: int, failed: bool
) -> None:
    monkeypatch.setattr(cluster, "died", lambda item: ITEMS[item].dead)
    monkeypatch.setattr(cluster, "value", lambda item: {"name": ITEMS[item].name})
    clips: list[Any] = [SimpleNamespace(name=name) for name in ("one", "two")]
    crew: Any = Crew({"two": deaths})
    found = ahead.survey(crew, clips)
    assert list(found) == ["one", "two"]
    assert ("message" in found["two"]) is failed


def test_a_clip_that_cannot_be_measured_does_not_end_the_forecast(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    rows = {
        name: {"name": name, "key": name, "plan_key": "p", "video_s": 1.0, "windows": 2}
        for name in ("bad", "good", "other")
    }
    rows["broken"] = {"name": "broken", "message": "found nothing"}

    def measured(_: Any, clip: Any, __: int) -> forecast.Cost:
        if clip.name == "bad":
            raise InputError("bad.mp4: found nobody")
        return forecast.Cost(1.0, 2.0, 3.0, 4.0, 5.0)

    monkeypatch.setattr(ahead, "crew", lambda *_: contextlib.nullcontext(SimpleNamespace()))
    monkeypatch.setattr(ahead, "survey", lambda *_: rows)
    monkeypatch.setattr(ahead, "_measured", measured)
    clips: list[Any] = [SimpleNamespace(name=name, plan="quick") for name in rows]
    found = ahead.plan_ahead(clips, ahead.Settings(tmp_path / "out"))
    assert found["failed"] == {"broken": "found nothing", "bad": "bad.mp4: found nobody"}
    assert found["video_s"] == 2.0
    assert found["seconds"] == {"quick": 6.0}
