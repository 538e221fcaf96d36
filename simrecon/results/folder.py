"""The result folder (`simrecon.result/1`): which files it holds, and how it appears whole or not at all."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from simrecon.errors import InputError, SimreconError
from simrecon.io.atomic import cannot_write

SCHEMA = "simrecon.result/1"
MOTION, MODEL, SCENE, REPORT, JOB = "motion.npz", "model.xml", "scene.toml", "report.json", "job.toml"
START = "start.npz"
"""The motion that the optimisation began from, where there was one."""
OVERLAYS = ("overlay.mp4", "overlay.png")
EXPORTS = ("bvh", "trc")
"""Formats of `simrecon.exports`: the files `motion.<format>` belong to a result."""
FILES = (
    MOTION, MODEL, SCENE, REPORT, JOB, START, *OVERLAYS,
    *(f"motion.{name}" for name in EXPORTS),
)  # fmt: skip
"""All that a result folder may hold: only a folder of these is ever replaced."""


def check_writable(folder: Path | str) -> None:
    """Check, before any long work, that a result can be written; leaves nothing behind.

    Args:
        folder: of the result, which may be missing, empty, or an earlier result.

    Raises:
        InputError: it is a file, holds what is no result, or can't be made.
    """
    target = Path(folder).resolve()
    try:
        if target.exists():
            _check_replaceable(folder, target)
        parent = target.parent
        while not parent.exists():
            parent = parent.parent
        os.rmdir(tempfile.mkdtemp(prefix=f".{target.name}.", dir=parent))
    except OSError as error:
        raise cannot_write(folder, error) from error


@dataclass
class Place:
    """A folder to write into, and the one that it becomes, which may still be changed meanwhile."""

    partial: Path
    target: Path


@contextlib.contextmanager
def replacing(folder: Path | str) -> Iterator[Place]:
    """A folder beside the target to write into, which takes its place when the block ends without an error.

    Raises:
        InputError: it can't be written.
        SimreconError: something else went wrong after the motion was there. Either way what can be replayed
            is kept, and the message says where.
    """
    target = Path(folder).resolve()
    place = Place(target.with_name(f".{target.name}.{os.getpid()}.partial"), target)
    made = _missing_parents(target)
    whole = False
    try:
        shutil.rmtree(place.partial, ignore_errors=True)
        place.partial.mkdir(parents=True)
        yield place
        whole = True
        _put_in_place(place.partial, place.target)
        whole, made = False, []
    except OSError as error:
        whole = whole or _is_usable(place.partial)
        kept = f"; the result is kept in {place.partial}" if whole else ""
        raise InputError(f"{cannot_write(folder, error)}{kept}") from error
    except Exception as error:
        if not (whole := _is_usable(place.partial)):
            raise
        reason = str(error) if isinstance(error, SimreconError) else f"{type(error).__name__}: {error}"
        raise SimreconError(f"{folder}: {reason}; the motion is kept in {place.partial}") from error
    finally:
        if not whole:
            shutil.rmtree(place.partial, ignore_errors=True)
            for parent in made:
                with contextlib.suppress(OSError):
                    parent.rmdir()


def _is_usable(partial: Path) -> bool:
    """Whether all that replays the motion is there: the scene is written after motion and model."""
    return (partial / SCENE).is_file()


def free(target: Path) -> Path:
    """The first of `OUT-2`, `OUT-3`, … that is not there."""
    names = (target.with_name(f"{target.name}-{i}") for i in itertools.count(2))
    return next(path for path in names if not path.exists())


def _missing_parents(target: Path) -> list[Path]:
    """Folders above the target that are not there yet, innermost first."""
    return [parent for parent in target.parents if not parent.exists()]


def _put_in_place(partial: Path, target: Path) -> None:
    """Rename the finished folder; an earlier result is moved aside first and deleted last."""
    if not target.exists():
        partial.rename(target)
        return
    earlier = partial.with_suffix(".earlier")
    target.rename(earlier)
    try:
        partial.rename(target)
    except BaseException:
        if not target.exists():
            earlier.rename(target)
        raise
    shutil.rmtree(earlier, ignore_errors=True)


def _check_replaceable(folder: Path | str, target: Path) -> None:
    """Refuse a target that is no folder, or holds anything that simrecon did not write there."""
    if not target.is_dir():
        raise InputError(f"{folder}: found a file; valid: a folder for the result")
    if os.path.ismount(target):
        raise InputError(f"{folder}: found a mount point, which cannot be renamed; valid: a folder inside it")
    inside = sorted(path.name for path in target.iterdir())
    foreign = [name for name in inside if name not in FILES]
    if foreign or (inside and REPORT not in inside):
        found = foreign[0] if foreign else f"no {REPORT}"
        raise InputError(
            f"{folder}: found a folder that holds {found}; "
            f"valid: a new or empty folder, or an earlier result with nothing added"
        )
    if inside and not _is_result(target):
        raise InputError(
            f"{folder}: found a {REPORT} that is not simrecon's; "
            f"valid: a new or empty folder, or an earlier result"
        )


def _is_result(target: Path) -> bool:
    try:
        report = json.loads((target / REPORT).read_text(encoding="utf-8"))
    except ValueError:  # not UTF-8, or not JSON
        return False
    return isinstance(report, dict) and str(report.get("schema", "")).startswith("simrecon.result/")
