"""Who may look, and who may edit."""

from __future__ import annotations

from typing import Any

import pytest

from simrecon.studio.gate import AWAY_S, Gate, new_token

HOST = {"Host": "127.0.0.1:8020"}


class Clock:
    """Seconds that a test moves on."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def gate(clock: Clock) -> Gate:
    return Gate("secret", clock=clock)


def entered(gate: Gate) -> str:
    """A browser that opens the address."""
    answer = gate.ask("/?token=secret", HOST, 8020)
    assert answer.allowed
    assert "HttpOnly" in answer.cookie
    assert "SameSite=Strict" in answer.cookie
    return answer.session


@pytest.mark.parametrize(
    "path", ["/", "/?token=", "/?token=secre", "/?token=secret2", "/studio/bar?token=no"]
)
def test_without_the_token_nobody_comes_in(gate: Gate, path: str) -> None:
    answer = gate.ask(path, HOST, 8020)
    assert not answer.allowed
    assert "token" in answer.reason


def test_a_browser_that_came_in_needs_the_token_no_more(gate: Gate) -> None:
    session = entered(gate)
    cookie = {**HOST, "Cookie": f"other=1; simrecon-studio-8020={session}"}
    assert gate.ask("/studio/bar", cookie, 8020).session == session
    forged = {**HOST, "Cookie": "simrecon-studio-8020=forged"}
    assert not gate.ask("/studio/bar", forged, 8020).allowed
    assert not gate.ask("/studio/bar", cookie, 8021).allowed  # of a studio at another port
    broken = {**HOST, "Cookie": 'simrecon-studio-8020="\x00;;=='}
    assert not gate.ask("/", broken, 8020).allowed


@pytest.mark.parametrize("host", ["evil.example:8020", "192.168.1.7:8020", "", "localhost.evil.example"])
def test_another_host_is_refused_even_with_the_token(gate: Gate, host: str) -> None:
    """A page of the web whose name leads here (DNS rebinding)."""
    assert not gate.ask("/?token=secret", {"Host": host}, 8020).allowed


class Doubled(dict[str, str]):
    """Headers of which one is there twice, as the server gives them."""

    def get(self, name: str, default: Any = None) -> Any:
        if name == "Cookie":
            raise LookupError(name)
        return super().get(name, default)


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/?token=secret", {"Host": "[::1"}),
        ("/?token=secret", {**HOST, "Origin": "http://[x"}),
        ("//[?token=secret", HOST),
        ("/?token=secret", Doubled(HOST)),
    ],
)
def test_a_request_that_says_nothing_clear_is_refused(gate: Gate, path: str, headers: dict[str, str]) -> None:
    answer = gate.ask(path, headers, 8020)
    assert (answer.allowed, answer.reason) == (False, "the request is damaged")


def test_another_page_may_not_connect(gate: Gate) -> None:
    session = entered(gate)
    cookie = {**HOST, "Cookie": f"simrecon-studio-8020={session}"}
    assert gate.ask("/", {**cookie, "Origin": "http://127.0.0.1:8020"}, 8020).allowed
    for origin in ("http://evil.example", "http://127.0.0.1:9000", "null"):
        assert not gate.ask("/", {**cookie, "Origin": origin}, 8020).allowed


def test_with_host_any_address_is_taken_but_no_name() -> None:
    gate = Gate("secret", hosts=())
    assert gate.ask("/?token=secret", {"Host": "192.168.1.7:8020"}, 8020).allowed
    assert gate.ask("/?token=secret", {"Host": "[fe80::1]:8020"}, 8020).allowed
    assert not gate.ask("/?token=secret", {"Host": "evil.example:8020"}, 8020).allowed


def test_a_second_browser_looks_only(gate: Gate) -> None:
    first, second = entered(gate), entered(gate)
    for browser in (first, first, second):
        gate.enter(browser)
    assert (gate.edits(first), gate.edits(second), gate.edits("")) == (True, False, False)


def test_the_right_to_edit_waits_for_a_page_that_is_loaded_again(gate: Gate, clock: Clock) -> None:
    first, second = entered(gate), entered(gate)
    gate.enter(first)
    gate.enter(second)
    gate.leave(first)
    clock.now += AWAY_S / 2
    assert not gate.edits(second)
    gate.enter(first)
    clock.now += 2 * AWAY_S
    assert gate.edits(first)
    gate.leave(first)
    clock.now += 2 * AWAY_S
    assert gate.edits(second)
    gate.enter(first)
    assert not gate.edits(first)


def test_tokens_differ() -> None:
    assert len({new_token() for _ in range(20)}) == 20
    assert len(new_token()) >= 32
