"""The studio as it is reached from outside: who is let in, and what is never taken; without a browser."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from simrecon.errors import InputError
from simrecon.results import Result
from simrecon.studio import runs
from simrecon.studio.asking import Wanted
from simrecon.studio.session import Session
from tests.support import browser

pytest.importorskip("viser", reason="the studio needs the extra studio")
pytestmark = pytest.mark.filterwarnings("default")  # of libraries, on their own threads


@pytest.fixture
def studio(squat: Result) -> Iterator[Any]:
    from simrecon.studio.app import Studio

    session = Session()
    session.open(squat.folder, load=False)
    studio = Studio(session)
    yield studio
    studio.stop()


def asked(address: str, path: str | None = None, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of what a studio answers."""
    parts = urlsplit(address)
    connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=10)
    try:
        connection.request("GET", f"/?{parts.query}" if path is None else path, headers=headers)
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        connection.close()


def entered(address: str) -> str:
    """The cookie of a browser that has opened the address."""
    return asked(address)[1]["Set-Cookie"].partition(";")[0]


def connected(address: str, cookie: str, **headers: str) -> Any:
    """A connection of the bar."""
    from websockets.sync.client import connect

    port = urlsplit(address).port
    return connect(f"ws://127.0.0.1:{port}/studio/bar", additional_headers={"Cookie": cookie, **headers})


def heard(connection: Any, kind: str) -> dict[str, Any]:
    """The next message of a kind."""
    while True:
        said: dict[str, Any] = json.loads(connection.recv(timeout=10))
        if said["type"] == kind:
            return said


def test_the_page_is_only_for_who_has_the_token(studio: Any) -> None:
    status, headers, body = asked(studio.address)
    assert status == 200
    assert b"studio/bar.js" in body
    assert headers["X-Frame-Options"] == "DENY"
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert asked(studio.address, "/studio/bar.js", Cookie=cookie)[0] == 200
    for path in ("/", "/?token=wrong", "/studio/bar.js", "/studio/bar", "/index.html"):
        status, _, body = asked(studio.address, path)
        assert (status, b"token" in body) == (403, True), path
    long = "a" * 2000
    for path in (
        "/studio/../serving.py", "/studio/__init__.py", "/studio/%2e%2e/tab.py", "/../setup.cfg",
        f"/{long}", f"/studio/{long}.js",
    ):  # fmt: skip
        assert asked(studio.address, path, Cookie=cookie)[0] == 404, path
    for headers in ({"Host": "[::1"}, {"Origin": "http://[x"}):
        assert asked(studio.address, Cookie=cookie, **headers)[0] == 403


def test_another_name_and_another_page_are_refused(studio: Any) -> None:
    assert asked(studio.address, Host="evil.example")[0] == 403
    cookie = entered(studio.address)
    assert asked(studio.address, "/", Cookie=cookie, Origin="http://evil.example")[0] == 403


def test_a_connection_without_the_token_or_of_another_page_is_refused(studio: Any) -> None:
    from websockets.exceptions import InvalidStatus

    cookie = entered(studio.address)
    with connected(studio.address, cookie) as bar:
        assert heard(bar, "state")["edits"] is True
    with pytest.raises(InvalidStatus, match="403"):
        connected(studio.address, "")
    with pytest.raises(InvalidStatus, match="403"):
        connected(studio.address, cookie, Origin="http://evil.example")


def test_a_second_browser_reads_only(studio: Any) -> None:
    first, second = entered(studio.address), entered(studio.address)
    with connected(studio.address, first) as one, connected(studio.address, second) as two:
        assert heard(one, "state")["edits"] is True
        assert heard(two, "state")["edits"] is False
        two.send('{"do": "seek", "t": 0.2}')
        assert "read only" in heard(two, "refused")["words"]
        assert studio.session.player.time_s == 0.0
        one.send('{"do": "seek", "t": 0.2}')
        while heard(two, "time")["t"] != 0.2:
            pass


def test_messages_of_viser_are_taken_from_the_browser_that_edits_alone(studio: Any) -> None:
    """Whoever looks can't press a button, and nobody can publish the studio."""
    inner = studio._server.viser._websock_server
    taken: list[str] = []

    class ShareUrlRequest:
        """As viser names it."""

    class GuiUpdateMessage:
        """As viser names it."""

    inner._incoming_handlers = {
        kind: [lambda _, message: taken.append(type(message).__name__)]
        for kind in (ShareUrlRequest, GuiUpdateMessage)
    }
    import asyncio

    for message in (ShareUrlRequest(), GuiUpdateMessage()):
        asyncio.run(inner._handle_incoming_message(99, message))
    assert taken == []


def test_an_edit_is_heard_at_once(studio: Any) -> None:
    """From the edit to the new penetrations at the page's end of the line, within 0.2 s."""
    tab = studio.session.current
    name = tab.document.add("bench", (0.0, 0.0, 0.0))
    spent = []
    with connected(studio.address, entered(studio.address)) as bar:
        heard(bar, "clip")
        for place in (5.0, 0.0, 6.0):
            began = time.perf_counter()
            tab.document.set(name, {"position_m": [place, 0.0, 0.0]})
            while (name in [one["name"] for one in heard(bar, "clip")["inside"]]) != (place == 0.0):
                pass
            spent.append(time.perf_counter() - began)
    assert min(spent) <= 0.2


def test_a_port_that_is_taken_is_refused(studio: Any) -> None:
    from simrecon.studio.gate import Gate
    from simrecon.studio.serving import Server

    with pytest.raises(InputError, match="valid: a free port"):
        Server("127.0.0.1", studio._server.port, Gate("x"))
    with pytest.raises(InputError, match="--host"):
        Server("192.0.2.1", 0, Gate("x"))


def test_a_run_goes_on_when_the_browser_is_closed(studio: Any, plan_file: Path) -> None:
    """And whoever comes next sees it, and may edit."""
    tab, cookie = studio.session.current, entered(studio.address)
    with connected(studio.address, cookie) as bar:
        heard(bar, "state")
        run = tab.start(Wanted(str(plan_file)))
        while not heard(bar, "state")["run"]:
            pass
    assert run.wait(120)
    assert run.progress.state == runs.DONE
    with connected(studio.address, cookie) as bar:
        assert heard(bar, "clip")["b"]["times"]
        state = heard(bar, "state")
        assert (state["edits"], state["unsaved"]) == (True, True)


def test_a_kill_loses_nothing(squat: Result, tmp_path: Path) -> None:
    """What was painted before the kill is there in the next studio."""
    cache = tmp_path / "cache"
    with browser.served(squat.folder, cache=cache) as first:
        with connected(first.address, entered(first.address)) as bar:
            heard(bar, "state")
            bar.send('{"do": "paint", "part": "left_hand", "brush": "free", "a": 0.0, "b": 0.3}')
            while not heard(bar, "state")["unsaved"]:
                pass
        first.kill()
    with (
        browser.served(squat.folder, cache=cache) as second,
        connected(second.address, entered(second.address)) as bar,
    ):
        parts = {part["name"]: part for part in heard(bar, "clip")["parts"]}
        assert parts["left_hand"]["free"]
        assert heard(bar, "state")["unsaved"]
