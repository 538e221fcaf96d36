"""A disk that is full: how errors tell of it, and the one of work that goes on once there is space."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from pathlib import Path

from simrecon.errors import SimreconError


class DiskFullError(SimreconError):
    """There is no space left: work of many parts stops, for every further part would fail as well."""


def is_full(error: BaseException) -> bool:
    """Whether an error, or one that it came from, says that there was no space left, or no quota."""
    seen: list[BaseException] = []
    cause: BaseException | None = error
    while cause is not None and cause not in seen:
        if isinstance(cause, DiskFullError) or (
            isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT)
        ):
            return True
        seen.append(cause)
        cause = cause.__cause__ or cause.__context__
    return False


def stopped(folder: Path | str) -> DiskFullError:
    """The error of work in a folder that goes on from what it has kept there."""
    return DiskFullError(
        f"{folder}: the disk is full; nothing is lost: make space, then give the same command again"
    )


@contextlib.contextmanager
def told(folder: Path | str) -> Iterator[None]:
    """Turns an error of a full disk, whatever was written, into that of `stopped`."""
    try:
        yield
    except Exception as error:
        if is_full(error):
            raise stopped(folder) from error
        raise
