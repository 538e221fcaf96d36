"""Files read whole: regular ones, of a size that is known beforehand; a pipe or a device may never end."""

from __future__ import annotations

import errno
import os
import stat

from simrecon.io.limits import MAX_BYTES, size_text
from simrecon.io.paths import is_usable

TEXT_MAX_BYTES = 64 << 20
"""Largest file that people write: a scene, a plan, a job, a camera, a manifest."""


def read_bytes(path: str | os.PathLike[str], most: int = MAX_BYTES) -> bytes:
    """The bytes of a regular file.

    Args:
        path: of it.
        most: bytes that are read at most.

    Raises:
        OSError: it can't be read, is a folder, a pipe or a device, or is larger.
    """
    if not is_usable(os.fspath(path)):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    with open(os.open(path, flags), "rb") as stream:
        status = os.fstat(stream.fileno())
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > most:
            raise OSError(
                errno.EFBIG, f"it has {size_text(status.st_size)}, more than {size_text(most)}", str(path)
            )
        return stream.read()


def read_text(path: str | os.PathLike[str], most: int = TEXT_MAX_BYTES) -> str:
    """A regular file as UTF-8; see `read_bytes`.

    Raises:
        OSError: as `read_bytes`.
        UnicodeDecodeError: it is no UTF-8.
    """
    return read_bytes(path, most).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
