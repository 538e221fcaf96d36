"""What a process does not need any more goes back to the system."""

from __future__ import annotations

import ctypes
import gc


def release() -> None:
    """Collect garbage, and give back the free pages between what is in use.

    Without it a worker grows for some dozen clips, as its threads leave holes in the heap. Needs glibc; with
    another C library only garbage is collected.
    """
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
