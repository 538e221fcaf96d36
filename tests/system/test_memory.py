"""Memory of the machine, and of a worker between clips."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

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


def test_memory_of_the_machine() -> None:
    total = memory.total_bytes()
    assert 512 * MIB < total < 2**50
    if Path("/proc/meminfo").exists():
        kib = int(Path("/proc/meminfo").read_text(encoding="ascii").split()[1])
        assert total == pytest.approx(kib * 1024, rel=1e-3)


def load(libraries: dict[str | None, object]) -> Any:
    """In place of `ctypes.CDLL`."""
    return lambda name: libraries[name]


def test_memory_of_a_machine_with_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    def status(pointer: Any) -> int:
        assert pointer._obj.length == 64  # bytes of MEMORYSTATUSEX
        pointer._obj.total = 48 * 2**30
        return 1

    monkeypatch.delattr(os, "sysconf")
    monkeypatch.setattr(ctypes, "CDLL", load({"kernel32": SimpleNamespace(GlobalMemoryStatusEx=status)}))
    assert memory.total_bytes() == 48 * 2**30
    refusal = SimpleNamespace(GlobalMemoryStatusEx=lambda _: 0)
    monkeypatch.setattr(ctypes, "CDLL", load({"kernel32": refusal}))
    with pytest.raises(OSError, match="how much memory"):
        memory.total_bytes()


@pytest.mark.parametrize(
    ("system", "library", "call"),
    [
        ("posix", None, "malloc_trim"),
        ("posix", None, "malloc_zone_pressure_relief"),
        ("nt", "ucrtbase", "_heapmin"),
    ],
)
def test_every_c_library_is_asked_in_its_own_way(
    monkeypatch: pytest.MonkeyPatch, system: str, library: str | None, call: str
) -> None:
    calls: list[tuple[object, ...]] = []
    monkeypatch.setattr(memory, "os", SimpleNamespace(name=system))
    monkeypatch.setattr(
        ctypes, "CDLL", load({library: SimpleNamespace(**{call: lambda *values: calls.append(values)})})
    )
    memory.release()
    assert len(calls) == 1


def test_without_such_a_call_only_garbage_is_collected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", load({None: SimpleNamespace()}))
    collections: list[int] = []
    monkeypatch.setattr(memory.gc, "collect", lambda: collections.append(1))
    memory.release()
    assert collections == [1]
