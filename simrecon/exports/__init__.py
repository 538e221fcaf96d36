"""A result as files of other programs: one module for each format, all made of a `Result`.

A format is a row of `FORMATS`: its name, which is also the suffix, and the function that makes the file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from simrecon.errors import InputError
from simrecon.exports import bvh
from simrecon.io import atomic
from simrecon.results import Result, open_result

FORMATS: dict[str, Callable[[Result], bytes]] = {"bvh": bvh.write}


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
        path, content = folder / f"motion.{name}", FORMATS[name](opened)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            atomic.write_bytes(path, content)
        except OSError as error:
            raise atomic.cannot_write(path, error) from error
        written.append(path)
    return written
