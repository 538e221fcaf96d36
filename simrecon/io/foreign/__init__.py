"""Parsers of other projects, run apart: in a process of their own, with limits of memory and time.

They are libraries that a damaged file may crash, hang or fill with memory. The process reads one
file, a copy in an empty folder, may write no other, and answers with plain arrays; whatever becomes of it,
the reader has one line to say.

storage      OpenCV's FileStorage: YAML, XML, JSON
mesh         trimesh: meshes of scenes
__main__     the process
"""

from __future__ import annotations

import subprocess  # nosec B404  # runs this Python alone
import sys
import tempfile
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from simrecon.io import packing
from simrecon.io.limits import MAX_BYTES
from simrecon.system import child

PARSERS = ("storage", "mesh")
MEMORY_BYTES, MEMORY_PER_BYTE = 512 << 20, 24
"""That the process may take, and more for each byte of the file."""
SECONDS, SECONDS_PER_BYTE = 4.0, 5e-7
"""Of a processor, and more for each byte of the file."""
WAIT = 6.0
"""How much longer the process may take where others are at work."""
REFUSED = 3
"""Exit status of a process that says why."""


class DamageError(Exception):
    """A file that its parser can't read; the message says why."""


def parse(parser: str, content: bytes, *words: str) -> dict[str, NDArray[Any]]:
    """What a parser makes of a file.

    Args:
        parser: one of `PARSERS`.
        content: of the file.
        words: more that its module is to be told.

    Returns:
        Arrays of numbers and text by name, as its module says.

    Raises:
        DamageError: the file is damaged, or takes more memory or time than it may for its size.
    """
    if parser not in PARSERS:
        raise ValueError(f"parser: found {parser!r}; valid: {', '.join(PARSERS)}")
    memory = MEMORY_BYTES + MEMORY_PER_BYTE * len(content)
    seconds = SECONDS + SECONDS_PER_BYTE * len(content)
    with tempfile.TemporaryDirectory(prefix="simrecon-") as folder:
        file = Path(folder) / "file"
        file.write_bytes(content)
        limits = [str(memory), f"{seconds:.0f}"]
        command = [sys.executable, "-P", "-m", __name__, parser, str(file), *limits, *words]
        try:
            done = subprocess.run(  # nosec B603  # no shell, words of our own
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=child.environment(),
                cwd=folder,
                timeout=WAIT * seconds,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise DamageError(f"it takes more than {WAIT * seconds:.0f} s to read") from error
    return _answer(done.returncode, done.stdout)


def _answer(status: int, output: bytes) -> dict[str, NDArray[Any]]:
    if status == REFUSED:
        raise DamageError(" ".join(output.decode("utf-8", "replace").split())[:300])
    if status != 0 or len(output) > MAX_BYTES:
        raise DamageError("its parser failed on it, or took more memory or time than it may")
    try:
        return packing.unpacked(output)
    except (ValueError, KeyError, TypeError, EOFError) as error:
        raise DamageError("its parser failed on it") from error
