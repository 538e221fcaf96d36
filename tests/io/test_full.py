"""What says that a disk is full, however often it was passed on."""

from __future__ import annotations

import errno
import pickle

import pytest

from simrecon.errors import InputError
from simrecon.io import full


def passed_on(error: Exception) -> Exception:
    try:
        try:
            raise error
        except Exception as cause:
            raise InputError("cannot be written") from cause
    except InputError as last:
        return last


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_it_is_told_from_other_errors(number: int) -> None:
    assert full.is_full(OSError(number, "no space"))
    assert full.is_full(passed_on(OSError(number, "no space")))
    assert not full.is_full(passed_on(OSError(errno.EACCES, "no")))
    circle = ValueError("a")
    circle.__context__ = KeyError("b")
    circle.__context__.__context__ = circle
    assert not full.is_full(circle)


def test_it_is_one_line_and_others_pass() -> None:
    with pytest.raises(full.DiskFullError, match=r"^out: the disk is full; nothing"), full.told("out"):
        raise passed_on(OSError(errno.ENOSPC, "no space"))
    with pytest.raises(ValueError, match="odd"), full.told("out"):
        raise ValueError("odd")


def test_it_comes_back_from_a_process() -> None:
    error = pickle.loads(pickle.dumps(full.stopped("out")))
    assert full.is_full(error)
    assert str(error) == str(full.stopped("out"))
