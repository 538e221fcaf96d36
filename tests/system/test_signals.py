"""What ends a session ends the program as Ctrl-C does."""

from __future__ import annotations

import enum
import importlib
import signal
import threading

import pytest

from simrecon.system import signals


@pytest.mark.parametrize("number", signals.ENDING)
def test_a_signal_interrupts_and_the_handler_before_comes_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), signals.interruptible():
        signal.raise_signal(number)
    assert signal.getsignal(number) is before


def test_the_exit_status_says_which_signal_it_was() -> None:
    assert signals.exit_status(KeyboardInterrupt()) == 130
    with pytest.raises(KeyboardInterrupt) as caught:
        end_while_drawing()
    assert signals.exit_status(caught.value) == 143


def end_while_drawing() -> None:
    with signals.interruptible():
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt as error:
            raise KeyboardInterrupt("all but the picture") from error


def test_a_signal_waits_for_the_end_of_a_block() -> None:
    done: list[str] = []

    def work() -> None:
        with signals.interruptible(), signals.deferred():
            signal.raise_signal(signal.SIGTERM)
            done.append("all of it")

    with pytest.raises(KeyboardInterrupt) as caught:
        work()
    assert done == ["all of it"]
    assert signals.exit_status(caught.value) == 143


def test_other_threads_than_the_main_one_leave_handlers_alone() -> None:
    handlers = [signal.getsignal(number) for number in signals.ENDING]
    inside: list[object] = []

    def work() -> None:
        with signals.interruptible():
            inside.extend(signal.getsignal(number) for number in signals.ENDING)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert inside == handlers


def test_windows_has_other_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    windows = enum.IntEnum("windows", {"SIGINT": 2, "SIGTERM": 15, "SIGBREAK": 21})
    with monkeypatch.context() as patch:
        patch.setattr(signal, "Signals", windows)
        try:
            ending = importlib.reload(signals).ENDING
        finally:
            patch.undo()
            importlib.reload(signals)
    assert [member.name for member in ending] == ["SIGTERM", "SIGBREAK"]
    assert [member.name for member in signals.ENDING] == ["SIGTERM", "SIGHUP"]
