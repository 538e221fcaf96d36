"""The bar: what it shows, and what a page may ask for."""

from __future__ import annotations

import json

import pytest

from simrecon.studio.bar import SLOW, Bar, clip_message
from simrecon.studio.gate import Gate
from simrecon.studio.session import Session
from simrecon.studio.tab import Tab


@pytest.fixture
def session(tab: Tab) -> Session:
    session = Session()
    session.tabs.append(tab)
    session.show(tab)
    return session


@pytest.fixture
def bar(session: Session) -> Bar:
    gate = Gate("secret")
    gate.enter("first")
    return Bar(session, gate)


def test_a_page_is_told_everything_as_json(bar: Bar) -> None:
    heard: list[str] = []
    bar.enter("first", heard.append)
    clip, time, state = (json.loads(text) for text in heard)
    assert (clip["type"], time["type"], state["type"]) == ("clip", "time", "state")
    assert len(clip["force"]) == len(clip["times"]) == 9
    assert clip["force"][0] is None
    assert [part["name"] for part in clip["parts"]][:2] == ["left_heel", "right_heel"]
    assert state["edits"] is True
    heard.clear()
    bar.enter("second", heard.append)
    assert json.loads(heard[2])["edits"] is False
    bar.leave(heard.append)
    assert clip_message(Session()) == {"type": "clip", "times": [], "parts": [], "inside": []}


def test_the_strip_is_painted_on_whole_frames_and_undone(bar: Bar, tab: Tab) -> None:
    paint = {"do": "paint", "part": "left_heel", "brush": "touch", "a": 0.12, "b": 0.07}
    assert bar.ask("first", json.dumps(paint)) == ""
    assert [wish.touch for wish in tab.document.edits.wishes] == [((0.05, 0.117),)]
    assert bar.ask("first", '{"do": "undo"}') == ""
    assert not tab.document.edits.wishes
    bar.ask("first", '{"do": "redo"}')
    assert len(tab.document.edits.wishes) == 1


def test_a_part_has_a_mode(bar: Bar, session: Session, tab: Tab) -> None:
    for mode in ("always", "never", "grounded"):
        assert bar.ask("first", json.dumps({"do": "mode", "part": "left_heel", "mode": mode})) == ""
        assert [wish.mode for wish in tab.document.edits.wishes] == [mode]
        assert clip_message(session)["parts"][0]["mode"] == mode
    assert bar.ask("first", '{"do": "mode", "part": "left_heel", "mode": "auto"}') == ""
    assert tab.document.edits.wishes == ()
    assert tab.document.undoes == "left_heel: auto"
    assert "valid: auto, always" in bar.ask("first", '{"do": "mode", "part": "left_heel", "mode": "up"}')


def test_the_cursor_follows(bar: Bar, session: Session) -> None:
    moved: list[float] = []
    bar.on_time = lambda: moved.append(session.player.time_s)
    for text in (
        '{"do": "seek", "t": 0.2}',
        '{"do": "loop", "a": 0.1, "b": 0.15}',
        '{"do": "speed", "v": 9}',
    ):
        assert bar.ask("first", text) == ""
    assert moved[0] == 0.2
    assert session.player.loop == (0.1, 0.15)
    assert session.player.speed == 4.0
    assert bar.ask("first", '{"do": "play", "on": true}') == ""
    assert session.player.playing


NO_MESSAGES = (
    *("{", "[]", "null", "[" * 4000, '"' + "x" * 9000 + '"'),
    *('{"do": "fly"}', '{"do": "seek"}', '{"do": "seek", "t": NaN}', '{"do": "seek", "t": "x"}'),
    '{"do": "seek", "t": 1%s}' % ("0" * 400),
    '{"do": "paint", "part": "nose", "brush": "touch", "a": 0, "b": 1}',
)


@pytest.mark.parametrize("text", NO_MESSAGES)
def test_a_message_that_is_none_is_refused_and_changes_nothing(bar: Bar, tab: Tab, text: str) -> None:
    assert bar.ask("first", text) != ""
    assert not tab.document.unsaved


def test_a_browser_that_only_looks_changes_nothing(bar: Bar, session: Session) -> None:
    for text in ('{"do": "undo"}', '{"do": "seek", "t": 0.2}', '{"do": "play", "on": true}'):
        assert bar.ask("second", text) == "read only: another browser edits"
    assert session.player.time_s == 0.0
    slow: list[bool] = []
    other = Bar(session, Gate("x"), on_slow=lambda: slow.append(True))
    assert other.ask("second", SLOW) == ""
    assert slow == [True]
