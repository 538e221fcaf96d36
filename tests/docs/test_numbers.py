"""What README says of the demo is what the demo says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from simrecon import cli
from tools import CHECKOUT

NUMBER = re.compile(r"\d+(?:\.\d+)?")
SHARE = 0.2
"""By so much of it a number may be another on another machine."""


def said() -> list[str]:
    """The lines of the page, but for those that begin with a time."""
    page = (CHECKOUT / "README.md").read_text(encoding="utf-8")
    block = page[page.index("Of the demo:") :].split("\n\n")[1]
    lines = (line.strip() for line in block.splitlines())
    return [line for line in lines if line[0].isalpha()]


def compare(wanted: str, line: str) -> None:
    """The same words, and nearly the same numbers."""
    assert NUMBER.sub("#", line) == NUMBER.sub("#", wanted)
    numbers = [[float(number) for number in NUMBER.findall(text)] for text in (line, wanted)]
    assert numbers[0] == pytest.approx(numbers[1], rel=SHARE)


def test_lines_are_compared_by_words_and_numbers() -> None:
    compare("motion   21 mm off", "motion   23 mm off")
    for other in ("motion   31 mm off", "motion   21 cm off", "image   21 mm off"):
        with pytest.raises(AssertionError):
            compare("motion   21 mm off", other)
    assert said()[0].startswith("person ")
    assert "verdict  good" in said()


@pytest.mark.slow
def test_the_demo_says_what_the_page_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["demo", "-o", str(tmp_path / "out")]) == 0
    shown = {line.split()[0]: line for line in capsys.readouterr().out.splitlines() if line.strip()}
    for wanted in said():
        compare(wanted, shown[wanted.split()[0]].strip())
