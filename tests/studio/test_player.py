"""Time: play, scrub, speed, loop; and work of which only the newest counts."""

from __future__ import annotations

import threading

import pytest

from simrecon.studio.latest import Latest
from simrecon.studio.player import Player


def test_time_goes_on_and_begins_again() -> None:
    player = Player()
    player.open(1.0, 3.0)
    player.advance(0.5)
    assert player.time_s == 1.0
    player.play(True)
    player.advance(0.5)
    assert player.time_s == 1.5
    player.speed = 2.0
    player.advance(1.0)
    assert player.time_s == pytest.approx(1.5)


def test_a_range_is_played_alone() -> None:
    player = Player()
    player.open(0.0, 10.0)
    player.set_loop(4.0, 2.0)
    assert (player.loop, player.time_s) == ((2.0, 4.0), 2.0)
    player.play(True)
    player.advance(2.5)
    assert player.time_s == pytest.approx(2.5)
    player.set_loop(3.0, 3.0)
    assert player.span == (0.0, 10.0)
    player.seek(99.0)
    assert player.time_s == 10.0
    player.play(True)
    assert player.time_s == 0.0


def test_only_the_newest_request_is_served_and_none_is_lost() -> None:
    """Requests from other threads while the work goes on come to one more call."""
    calls, begun, go_on = [], threading.Event(), threading.Event()

    def work() -> None:
        calls.append(threading.current_thread())
        begun.set()
        go_on.wait(5.0)

    latest = Latest(work)
    first = threading.Thread(target=latest.ask)
    first.start()
    assert begun.wait(5.0)
    for _ in range(10):
        latest.ask()
    go_on.set()
    first.join(5.0)
    assert calls == [first, first]


def test_work_that_fails_can_be_asked_for_again() -> None:
    outcomes = iter([ValueError("no"), None])

    def work() -> None:
        outcome = next(outcomes)
        if outcome is not None:
            raise outcome

    latest = Latest(work)
    with pytest.raises(ValueError, match="no"):
        latest.ask()
    latest.ask()
    assert list(outcomes) == []
