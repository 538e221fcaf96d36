"""Memory of a worker between clips."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

import pytest

from simrecon.system import memory

MIB = 2**20


def resident() -> int:
    """Bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(
    not hasattr(ctypes.CDLL(None), "malloc_trim") or not Path("/proc/self/statm").exists(),
    reason="needs glibc and /proc",
)
def test_free_pages_between_what_is_in_use_are_given_back() -> None:
    blocks = [bytearray(64 * 1024) for _ in range(3000)]
    kept = blocks[::50]
    del blocks
    before = resident()
    memory.release()
    assert before - resident() > 100 * MIB
    assert len(kept) == 60
