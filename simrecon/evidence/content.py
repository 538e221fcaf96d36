"""A file or folder of any format, opened as far as its container goes: what is within is for the readers."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from simrecon.errors import InputError
from simrecon.evidence import containers, trees
from simrecon.io.limits import MAX_BYTES, size_text
from simrecon.io.paths import usable
from simrecon.io.reading import read_bytes

_JSON_FILES_MAX = 500_000
_FRAME_MAX_BYTES = 1 << 24
"""Of the file of one frame."""


@dataclass(frozen=True)
class Content:
    """A file or folder.

    Attributes:
        path: of it; source: the same for messages.
        kind: `folder`, `npz`, `torch`, `npy`, `pickle`, `json`, `text`, `c3d`, `video` or `unknown`.
    """

    path: Path
    kind: str

    @property
    def source(self) -> str:
        """The path, for messages."""
        return os.fspath(self.path)

    @cached_property
    def raw(self) -> bytes:
        """The bytes of the file."""
        return _bytes(self.path)

    @cached_property
    def sha256(self) -> str:
        """Of the bytes of the file; of a folder, of those of its JSON files in the order of their names."""
        if self.kind == "video":  # of any size
            with self.path.open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        if self.kind != "folder":
            return hashlib.sha256(self.raw).hexdigest()
        total = hashlib.sha256()
        for path in self.json_files:
            total.update(_bytes(path))
        return total.hexdigest()

    @cached_property
    def text(self) -> str:
        """The file as text: UTF-16 with its mark, UTF-8 or Latin-1."""
        try:
            return self.raw.decode("utf-16" if self.raw.startswith(containers.UTF16) else "utf-8-sig")
        except UnicodeDecodeError:
            return self.raw.decode("latin-1")

    @cached_property
    def json_files(self) -> tuple[Path, ...]:
        """JSON files of a folder, by name."""
        return tuple(sorted(self.path.glob("*.json"))[:_JSON_FILES_MAX])

    @cached_property
    def tree(self) -> Any:
        """Nested dictionaries, lists, numbers, text and arrays; None for files that hold none."""
        if self.kind == "json":
            return trees.of_json(self.source, self.text)
        read = trees.BINARY.get(self.kind)
        return None if read is None else read(self.source, self.raw)

    def fail(self, key: str, found: str, valid: str) -> InputError:
        """The one-line error of a key, to be raised."""
        found = " ".join(found.split())
        return InputError(f"{self.source}: {key}: found {found}; valid: {valid}")


def open_content(path: str | os.PathLike[str]) -> Content:
    """See what kind of container a path is, by its first bytes.

    Raises:
        InputError: it can't be read or is too large.
    """
    path = usable(path)
    try:
        if path.is_dir():
            return Content(path, "folder")
        if not path.is_file() and path.exists():
            raise InputError(f"{path}: found a pipe or a device; valid: a file, or a folder")
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give an existing file") from error
    kind = containers.kind(path, head)
    if size > MAX_BYTES and kind != "video":
        raise InputError(f"{path}: found {size_text(size)}; valid: at most {size_text(MAX_BYTES)}")
    return Content(path, kind)


def json_or_none(path: Path) -> Any:
    """What the JSON file of one frame holds; None where it can't be read."""
    try:
        return json.loads(read_bytes(path, _FRAME_MAX_BYTES))
    except (OSError, ValueError, RecursionError):
        return None


def is_video(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a video, by its first bytes.

    Raises:
        InputError: as `open_content`.
    """
    return open_content(path).kind == "video"


def _bytes(path: Path) -> bytes:
    try:
        return read_bytes(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give an existing file") from error
