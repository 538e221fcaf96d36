"""Progress lines with a clock that the test turns."""

from __future__ import annotations

import io

import pytest

from simrecon.system.progress import Progress, duration


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Ascii(Terminal):
    """A terminal that can't show block characters."""

    encoding = "ascii"


def test_plain_lines_come_at_most_once_per_interval_and_at_the_end() -> None:
    stream, clock = io.StringIO(), Clock()
    with Progress(100, "windows", stream, clock=clock) as progress:
        for done in range(1, 101):
            clock.now_s += 0.25
            progress.update(done)
    lines = stream.getvalue().splitlines()
    assert lines == [
        "windows  40%  15 s left",
        "windows  80%  5.0 s left",
        "windows 100%  done in 25 s",
    ]


def test_the_end_is_one_plain_line_however_long_the_last_piece_took() -> None:
    stream, clock = io.StringIO(), Clock()
    with Progress(4, "fit", stream, clock=clock) as progress:
        clock.now_s += 60
        progress.update(4, "loss 3.2")
    other = Progress(4, "fit", stream, clock=clock).__enter__()
    clock.now_s += 60
    other.end(4)
    assert stream.getvalue().splitlines() == [
        "fit 100%  done in 1 min 00 s  loss 3.2",
        "fit 100%  done in 1 min 00 s",
    ]


def test_terminal_redraws_one_line() -> None:
    stream, clock = Terminal(), Clock()
    with Progress(4, "fit", stream, clock=clock) as progress:
        clock.now_s += 1.0
        progress.update(1, "loss 3.2")
    text = stream.getvalue()
    assert text.count("\n") == 1
    assert text.endswith("\n")
    frames = text.split("\r\x1b[K")[1:]
    assert "fit   0%" in frames[0]
    assert "3.0 s left  loss 3.2" in frames[1]
    assert frames[1].count("█") == 7
    assert frames[1].count("░") == 21


def test_terminal_is_not_redrawn_for_every_update() -> None:
    stream, clock = Terminal(), Clock()
    with Progress(1000, "fit", stream, clock=clock) as progress:
        for done in range(1000):
            clock.now_s += 0.001
            progress.update(done)
    assert stream.getvalue().count("\r") <= 12


def test_terminal_without_block_characters_gets_ascii() -> None:
    stream, clock = Ascii(), Clock()
    with Progress(2, "fit", stream, clock=clock) as progress:
        clock.now_s += 1.0
        progress.update(1)
    assert "##############--------------" in stream.getvalue()
    assert stream.getvalue().isascii()


def test_a_failure_is_not_reported_as_done() -> None:
    stream, clock = io.StringIO(), Clock()
    progress = Progress(4, "fit", stream, clock=clock)

    def work() -> None:
        with progress:
            progress.update(1)
            raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        work()
    assert "stopped in 0.0 s" in stream.getvalue()
    assert "done" not in stream.getvalue()


def test_no_work_is_done_at_once() -> None:
    stream = io.StringIO()
    with Progress(0, "fit", stream, clock=Clock()):
        pass
    assert stream.getvalue() == "fit 100%  done in 0.0 s\n"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"),
        (9.94, "9.9 s"),
        (9.96, "10 s"),
        (59.6, "1 min 00 s"),
        (185, "3 min 05 s"),
        (7625, "2 h 07 min"),
    ],
)
def test_duration(seconds: float, text: str) -> None:
    assert duration(seconds) == text
