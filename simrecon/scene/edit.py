"""Changes to a user's scene file: comments, order and spelling of what is not changed stay."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import tomlkit

from simrecon.errors import InputError
from simrecon.io import atomic, tables
from simrecon.io.messages import hint
from simrecon.io.reading import read_bytes
from simrecon.scene import files, schema
from simrecon.types import Scene, SceneItem

GROUND = "ground"
"""Name by which the floor is edited."""
_LINE = re.compile(r"[^\n]*\n|[^\n]+$")
_HEADER = re.compile(r"[ \t]*(\[\[[ \t]*item[ \t]*\]\]|\[[ \t]*ground[ \t]*\])[ \t]*(#.*)?\n?$")
_COMMENT = re.compile(r"[ \t]*#")
_TRIVIA = re.compile(r"[ \t]*(#.*)?\n?$")


class Edited:
    """A scene file while it is changed; `save` checks and writes it.

    The text is kept in blocks: what is above the first header, then one for each header with the comment
    above it. A file in another form, such as `item = [{…}]`, is rewritten in this one first.
    """

    def __init__(self, content: str, path: Path | str = "scene.toml") -> None:
        scene = files.parse(content, path)
        self._path = Path(path)
        self._newline = "\r\n" if "\r\n" in content else "\n"
        content = content.replace("\r\n", "\n")
        self._blocks = _blocks(content) or _blocks(files.dumps(scene))

    @classmethod
    def read(cls, path: Path | str) -> Edited:
        """Read a file in order to change it.

        Raises:
            InputError: it can't be read, or is not valid.
        """
        files.read(path)
        return cls(read_bytes(path).decode("utf-8", "surrogateescape"), path)

    @property
    def names(self) -> list[str]:
        """Names of the items, in the order of the file."""
        return [table["item"][0]["name"] for table in map(tomllib.loads, self._blocks) if "item" in table]

    @property
    def text(self) -> str:
        """The text as it is now, which may not be valid; lines end as in the file."""
        return "".join(self._blocks).replace("\n", self._newline)

    def item(self, name: str) -> SceneItem:
        """An item of the file.

        Raises:
            InputError: there is none of that name.
        """
        table = tomllib.loads(self._blocks[self._index(name)])
        return schema.item(table["item"][0], f"{self._path}: item")

    def set(self, name: str, key: str, value: Any) -> None:
        """Change a key of an item or the ground; None removes it, so that its default holds.

        Raises:
            InputError: there is no such item.
        """
        index = self._ground() if name == GROUND else self._index(name)
        head, tail = _without_trivia(self._blocks[index])
        document: Any = tomlkit.parse(head)
        table = document[GROUND] if name == GROUND else document["item"][0]
        if value is not None:
            table[key] = tables.plain(value)
        elif key in table:
            del table[key]
        self._blocks[index] = document.as_string() + tail

    def add(self, item: SceneItem) -> None:
        """Add an item at the end."""
        self._append(files.dumps_item(item))

    def remove(self, name: str) -> None:
        """Remove an item and the comment right above it.

        Raises:
            InputError: there is no such item.
        """
        del self._blocks[self._index(name)]

    def save(self, path: Path | str | None = None) -> Scene:
        """Check the text and write it to the file, or to another; return the scene.

        Raises:
            InputError: a value is not valid, or the file can't be written; the file is then unchanged.
        """
        path = self._path if path is None else Path(path)
        scene = files.parse("".join(self._blocks), path)
        with atomic.reported(path):
            atomic.write_text(path, self.text)
        return scene

    def _index(self, name: str) -> int:
        if name not in self.names:
            there = ", ".join(self.names) or "none"
            raise InputError(
                f"{self._path}: there is no item {name!r}{hint(name, self.names)}; there: {there}"
            )
        rows = [i for i, block in enumerate(self._blocks) if "item" in tomllib.loads(block)]
        return rows[self.names.index(name)]

    def _ground(self) -> int:
        """Index of the ground's block; a new one is put before the items."""
        for i, block in enumerate(self._blocks):
            if GROUND in tomllib.loads(block):
                return i
        self._blocks.insert(1, f"[{GROUND}]\n" + ("\n" if len(self._blocks) > 1 else ""))
        return 1

    def _append(self, block: str) -> None:
        last = self._blocks[-1]
        if last and not last.endswith("\n"):
            self._blocks[-1] = last = f"{last}\n"
        gap = "" if last.endswith("\n\n") or not "".join(self._blocks) else "\n"
        self._blocks.append(gap + block)


def _blocks(content: str) -> list[str]:
    """Text above the first header, then a block for each header; empty where that is not the whole file."""
    blocks: list[list[str]] = [[]]
    for line in _LINE.findall(content):
        if _HEADER.match(line):
            above = blocks[-1]
            count = 0
            while count < len(above) and _COMMENT.match(above[-1 - count]):
                count += 1
            start = len(above) - count
            blocks.append(above[start:])
            del above[start:]
        blocks[-1].append(line)
    texts = ["".join(block) for block in blocks]
    try:
        parts = [tomllib.loads(text) for text in texts]
    except tomllib.TOMLDecodeError:
        return []
    rows = [part["item"] for part in parts if "item" in part]
    whole = all(len(row) == 1 and isinstance(row, list) for row in rows)
    return texts if whole and not {"item", GROUND} & parts[0].keys() else []


def _without_trivia(block: str) -> tuple[str, str]:
    """A block up to its last key, and the blank lines and comments after it."""
    lines = _LINE.findall(block)
    count = len(lines)
    while count > 1 and _TRIVIA.match(lines[count - 1]) and not _HEADER.match(lines[count - 1]):
        count -= 1
    head = "".join(lines[:count])
    return (head if head.endswith("\n") else f"{head}\n"), "".join(lines[count:])
