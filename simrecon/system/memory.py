"""Memory of the machine, and of a process that does not need all of it any more."""

from __future__ import annotations

import ctypes
import gc
import os


def total_bytes() -> int:
    """Memory of the machine."""
    if hasattr(os, "sysconf"):
        return int(os.sysconf("SC_PAGE_SIZE")) * int(os.sysconf("SC_PHYS_PAGES"))
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    if not ctypes.CDLL("kernel32").GlobalMemoryStatusEx(ctypes.byref(status)):
        raise OSError("Windows does not tell how much memory there is")
    return int(status.total)


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of Windows."""

    _fields_ = (
        ("length", ctypes.c_uint32),
        ("load_pct", ctypes.c_uint32),
        ("total", ctypes.c_uint64),
        ("others", ctypes.c_uint64 * 6),
    )


def release() -> None:
    """Collect garbage, and give the free pages between what is in use back to the system.

    Without it a worker grows for some dozen clips, as its threads leave holes in the heap. Where the C
    library has no call for it (musl), only garbage is collected.
    """
    gc.collect()
    library = ctypes.CDLL("ucrtbase" if os.name == "nt" else None)
    if hasattr(library, "malloc_trim"):  # glibc
        library.malloc_trim(0)
    elif hasattr(library, "malloc_zone_pressure_relief"):  # macOS
        library.malloc_zone_pressure_relief(None, ctypes.c_size_t(0))
    elif hasattr(library, "_heapmin"):  # Windows
        library._heapmin()
