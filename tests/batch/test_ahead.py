"""Reading of all inputs before a batch begins."""

from __future__ import annotations

import queue
from types import SimpleNamespace
from typing import Any

import pytest

from simrecon.batch import ahead, cluster


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
