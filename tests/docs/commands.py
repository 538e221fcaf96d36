"""The command lines of README and docs, as they stand."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tools import CHECKOUT

PAGES = sorted(
    [CHECKOUT / "README.md", *(CHECKOUT / "docs").rglob("*.md"), CHECKOUT / "windows" / "README.md"]
)
PROGRAMS = ("simrecon", "python", "python3", ".", "npm", "source")


@dataclass(frozen=True)
class Command:
    """A command line of a page, without its comment."""

    page: str
    line: int
    text: str


def of_page(path: Path) -> list[Command]:
    """The commands in the code blocks of a page, which are fenced or indented by four spaces."""
    found: list[Command] = []
    fenced = False
    lines = path.read_text(encoding="utf-8").splitlines()
    page = path.relative_to(CHECKOUT).as_posix()
    text, start = "", 0
    for number, line in enumerate(lines, 1):
        if line.startswith("```"):
            fenced = not fenced
            continue
        if not (fenced or line.startswith("    ") or text):
            continue
        start, text = (start, text + " " + line.strip()) if text else (number, line.strip())
        if text.endswith("\\"):
            text = text[:-1].strip()
            continue
        found += [Command(page, start, part) for part in _parts(text)]
        text = ""
    return found


def _parts(text: str) -> list[str]:
    """The commands of a line that is one."""
    if text.split(" ", 1)[0] not in PROGRAMS:
        return []
    return [part.strip() for part in re.sub(r"\s+#\s.*", "", text).split(" && ")]


def all_of_them() -> list[Command]:
    """Those of all pages, in their order."""
    return [command for path in PAGES for command in of_page(path)]
