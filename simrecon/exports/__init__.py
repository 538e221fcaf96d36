"""A result as files of other programs: one module for each format, all made of a `Result`.

A format is a name in `results.folder.EXPORTS`, which is also the suffix, and the module of that name here,
whose `write` makes the file. It is imported when it is first used: a format may need packages of its own.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path

from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.results import Result, open_result
from simrecon.results.folder import EXPORTS

FORMATS = EXPORTS


def writer(name: str) -> Callable[[Result], bytes]:
    """What makes the file of a format, one of `FORMATS`."""
    write: Callable[[Result], bytes] = importlib.import_module(f"simrecon.exports.{name}").write
    return write


def export(
    result: Result | Path | str, formats: Sequence[str], target: Path | str | None = None
) -> list[Path]:
    """Write the simulated motion of a result in other formats.

    Args:
        result: an opened result, or its folder.
        formats: names of `FORMATS`.
        target: folder to write to, which is made; that of the result if None.

    Returns:
        The files written, `motion.<format>`.

    Raises:
        InputError: it is no result, there is no such format, or the folder can't be written.
    """
    if unknown := [name for name in formats if name not in FORMATS]:
        raise InputError(f"--to: found {', '.join(unknown)}; valid: {', '.join(FORMATS)}")
    opened = result if isinstance(result, Result) else open_result(result)
    folder = Path(opened.folder if target is None else target)
    written = []
    for name in formats:
        path, content = folder / f"motion.{name}", writer(name)(opened)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            atomic.write_bytes(path, content)
        except OSError as error:
            raise atomic.cannot_write(path, error) from error
        written.append(path)
    return written
