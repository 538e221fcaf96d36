"""Locks on open files: held by one process, given back when the file is closed or the process ends."""

from __future__ import annotations

import errno
import importlib
import os
from typing import IO, Any

_OFFSET = 2**30
"""Windows forbids others even to read what is locked, so the byte that is locked lies behind any content."""


def acquire(stream: IO[Any], *, shared: bool = False) -> bool:
    """Lock a file without waiting.

    Args:
        stream: the open file; the lock lasts until it is closed.
        shared: others may hold the lock too if theirs is shared; on Windows every lock is exclusive.

    Returns:
        Whether the lock could be had; False if another open file holds it.

    Raises:
        OSError: the file system has no locks.
    """
    try:
        fcntl = importlib.import_module("fcntl")
    except ModuleNotFoundError:
        return _acquire_windows(stream.fileno())
    try:
        fcntl.flock(stream, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _acquire_windows(descriptor: int) -> bool:
    msvcrt = importlib.import_module("msvcrt")
    before = os.lseek(descriptor, 0, os.SEEK_CUR)
    os.lseek(descriptor, _OFFSET, os.SEEK_SET)
    try:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EDEADLK):
            return False
        raise
    finally:
        os.lseek(descriptor, before, os.SEEK_SET)
    return True
