"""Words of messages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import simrecon
from simrecon.io.messages import counted

THINGS = "frames|people|landmarks|joints|clips|files|images|points|items|windows|runs|numbers|poses"
BARE = re.compile(rf"(?<! of )(?<! of the )\{{len\([^{{}}]*\)\}} ({THINGS})\b")
"""A number that may be one, before a plural; `3 of {n} frames` has two or more."""


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 frames"), (1, "1 frame"), (2, "2 frames"), (-1, "-1 frames")]
)
def test_one_thing_and_several(number: int, text: str) -> None:
    assert counted(number, "frame") == text
    assert counted(number, "person", "people").split()[1] == ("person" if number == 1 else "people")


def test_no_message_says_one_frames() -> None:
    found = {}
    for path in Path(simrecon.__file__).parent.rglob("*.py"):
        if lines := [match[0] for match in BARE.finditer(path.read_text(encoding="utf-8"))]:
            found[path.name] = lines
    assert found == {}
