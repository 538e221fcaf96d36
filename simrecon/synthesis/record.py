"""What a synthesis has written into its folder (`synthesis.json`): no file but those is ever replaced."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.io.provenance import file_digest
from simrecon.io.reading import read_text

RECORD, PAGE = "synthesis.json", "report.html"
_OURS = re.compile(r"future_[0-9]{2,4}\.npz|report\.html")


def name(row: int, count: int) -> str:
    """Of the file of a future, one of so many."""
    return f"future_{row:0{max(2, len(str(count - 1)))}d}.npz"


def names(count: int) -> tuple[str, ...]:
    """Of all files of so many futures, beside the record."""
    return (*(name(row, count) for row in range(count)), PAGE)


def earlier(folder: Path) -> tuple[str, ...]:
    """Files of an earlier synthesis that are there as it wrote them."""
    noted = _noted(folder) or {}
    return tuple(
        one
        for one, digest in noted.items()
        if _OURS.fullmatch(one) and (folder / one).is_file() and file_digest(folder / one) == digest
    )


def check(folder: Path, count: int) -> None:
    """Check that nothing is lost if so many futures are written.

    Raises:
        InputError: a file that would be replaced is none that a synthesis wrote.
    """
    ours = {*earlier(folder), *((RECORD,) if _noted(folder) is not None else ())}
    for one in (*names(count), RECORD):
        if one not in ours and (folder / one).exists():
            raise InputError(
                f"{folder / one}: found a file that is not as a synthesis wrote it, which would be lost; "
                "valid: another folder"
            )


def write(folder: Path, files: Mapping[str, bytes], **said: Any) -> None:
    """Write files and their record; those of an earlier synthesis go.

    The record comes first: a synthesis that is cut off knows its files again.

    Args:
        folder: which is made.
        files: content by name, those of `names`.
        said: what else the record holds.

    Raises:
        InputError: it can't be written.
    """
    hashes = {one: hashlib.sha256(content).hexdigest() for one, content in files.items()}
    with atomic.reported(folder):
        folder.mkdir(parents=True, exist_ok=True)
        _remove(folder, earlier(folder))
        content = {**said, "files": [one for one in files if one != PAGE], "sha256": hashes}
        atomic.write_json(folder / RECORD, content)
        for one, raw in files.items():
            atomic.write_bytes(folder / one, raw)


def _remove(folder: Path, ours: Iterable[str]) -> None:
    for one in ours:
        (folder / one).unlink()


def _noted(folder: Path) -> dict[str, Any] | None:
    """Hashes of the files of an earlier synthesis, by name; None: there is no record of one."""
    try:
        record = json.loads(read_text(folder / RECORD))
        return {str(one): digest for one, digest in record["sha256"].items()}
    except (OSError, ValueError, RecursionError, LookupError, TypeError, AttributeError):
        return None
