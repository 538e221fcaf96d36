"""The process: `python -m simrecon.io.foreign PARSER FILE MEMORY SECONDS [WORD…]`."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

from simrecon.io import foreign, packing


def limit(memory: int, seconds: int) -> None:
    """Limits of this process from now on, where the system has them."""
    try:
        resource = importlib.import_module("resource")
    except ModuleNotFoundError:  # Windows: the time is watched from outside
        return
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except OSError:  # not Linux
        pages = 1 << 18
    limits = {
        "RLIMIT_AS": pages * resource.getpagesize() + memory,
        "RLIMIT_CPU": seconds,
        "RLIMIT_FSIZE": 0,
        "RLIMIT_CORE": 0,
    }
    for name, most in limits.items():
        kind = getattr(resource, name)
        _, highest = resource.getrlimit(kind)
        resource.setrlimit(kind, (most if highest == resource.RLIM_INFINITY else min(most, highest), highest))


def main(parser: str, file: str, memory: int, seconds: int, *words: str) -> int:
    """Parse, and write what there is to standard output."""
    if parser not in foreign.PARSERS:
        return 2
    module = importlib.import_module(f"{foreign.__name__}.{parser}")
    limit(memory, seconds)
    try:
        answer = packing.packed(module.parse(file, *words))
    except Exception as error:
        reason = str(error).replace(file, "the file") or type(error).__name__
        sys.stdout.buffer.write(reason.encode("utf-8", "replace"))
        return foreign.REFUSED
    sys.stdout.buffer.write(answer)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), *sys.argv[5:]))
