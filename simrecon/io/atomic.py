"""Files that appear whole or not at all: written aside, then renamed into place."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import json
import os
import re
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.errors import InputError
from simrecon.io.paths import is_usable

NAME_MAX_BYTES = 255
"""Longest name of a file that usual file systems have."""
_SURROGATE = re.compile("[\ud800-\udfff]")
_PARTIAL = re.compile(r"\.(.+)\.\d+\.\d+\.partial(\..{1,19})?")


def fitted(name: str, ending: str = "", longest: int = NAME_MAX_BYTES) -> str:
    """A file name with an ending, of at most so many bytes: of a longer one a hash stands for the rest."""
    room = longest - len(os.fsencode(ending))
    raw = os.fsencode(name)
    if len(raw) <= room:
        return name + ending
    mark = "-" + hashlib.sha256(raw).hexdigest()[:8]
    kept = name[:room]
    while len(os.fsencode(kept)) > room - len(mark):
        kept = kept[:-1]
    return kept + mark + ending


def cannot_write(target: Path | str, error: OSError) -> InputError:
    """The error of a file or folder that can't be written, in one line."""
    return InputError(f"{target}: cannot be written ({error.strerror or error}); valid: a writable place")


@contextlib.contextmanager
def reported(target: Path | str) -> Iterator[None]:
    """Turns the OSError of writing a file that the user asked for into `cannot_write`."""
    try:
        yield
    except OSError as error:
        raise cannot_write(target, error) from error


@contextlib.contextmanager
def beside(target: Path) -> Iterator[Path]:
    """A path beside the target to write to, renamed to it when the block ends and removed if it fails.

    The name ends as the target's does, for libraries that go by the suffix. A target that is a symbolic link
    stays one: what it points to is replaced. A device or a pipe is refused, for it would be replaced too.

    Raises:
        OSError: the target can't be replaced; what was there before is still there.
    """
    if not is_usable(os.fspath(target)):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(target))
    target = Path(os.path.realpath(target))
    if target.exists() and not target.is_file():
        raise OSError(errno.EINVAL, "not a regular file", str(target))
    mark = f"{os.getpid()}.{threading.get_ident()}"
    partial = target.with_name(fitted(f".{target.name}", f".{mark}.partial{target.suffix[:20]}"))
    try:
        yield partial
        os.replace(partial, target)
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)


def partial_of(name: str) -> str | None:
    """The file that a process was writing (`beside`) under a name, which stays if it is killed; or None."""
    found = _PARTIAL.fullmatch(name)
    return None if found is None else found[1]


def write_bytes(target: Path | str, content: bytes, *, durable: bool = False) -> None:
    """Write a file; the one that was there is replaced at once.

    Args:
        target: in a folder that exists.
        content: of the file.
        durable: flush it to the disk, and the folder after the rename, so that it survives a power cut.

    Raises:
        OSError: it can't be written; what was there before is still there.
    """
    path = Path(target)
    with beside(path) as partial, partial.open("wb") as stream:
        stream.write(content)
        if durable:
            stream.flush()
            os.fsync(stream.fileno())
    if durable:
        flush(path.parent)


def write_text(target: Path | str, content: str) -> None:
    """Write a file as UTF-8, with the bytes of paths (`os.fsdecode`) as they are; see `write_bytes`."""
    write_bytes(target, content.encode("utf-8", "surrogateescape"))


def write_json(target: Path | str, content: Any, *, durable: bool = False) -> None:
    """Write plain data as JSON with an indent of one; see `write_bytes`.

    Raises:
        ValueError: a number is not finite.
    """
    write_bytes(target, json_bytes(content, indent=1), durable=durable)


def json_bytes(content: Any, indent: int | None = None) -> bytes:
    r"""Plain data as a line of JSON, or as several with an indent.

    Bytes of a path that are no UTF-8 (`os.fsdecode`) are written as `\udcXX`, and read back so.

    Raises:
        ValueError: a number is not finite.
    """
    text = json.dumps(content, indent=indent, ensure_ascii=False, allow_nan=False) + "\n"
    return _SURROGATE.sub(lambda found: f"\\u{ord(found[0]):04x}", text).encode("utf-8")


def write_npz(target: Path | str, arrays: Mapping[str, Any]) -> None:
    """Write arrays as a compressed `.npz` without pickles: same arrays, same bytes; see `write_bytes`."""
    write_bytes(target, npz_bytes(arrays))


def npz_bytes(arrays: Mapping[str, Any]) -> bytes:
    """The content of a `.npz`; see `write_npz`.

    Raises:
        ValueError: an array holds objects.
    """
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def flush(path: Path) -> None:
    """Bring a file, or the names in a folder, to the disk, to survive a power cut; not folders on Windows."""
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def flush_all(folder: Path) -> None:
    """`flush` of the files in a folder, then of the folder."""
    for path in folder.iterdir():
        if path.is_file():
            flush(path)
    flush(folder)
