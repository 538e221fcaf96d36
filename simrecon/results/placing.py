"""How a result folder appears whole or not at all, and what is removed for it: nothing that is not ours."""

from __future__ import annotations

import contextlib
import itertools
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from simrecon.errors import InputError, SimreconError
from simrecon.io import atomic
from simrecon.results import folder as folders
from simrecon.system import signals

MARK = ".simrecon-unfinished"
"""The file in a folder that is being written; only a folder that has it is removed with all that it holds."""


@dataclass
class Place:
    """A folder to write into, and the one that it becomes.

    Attributes:
        partial: where to write.
        target: what it becomes, which may still be changed meanwhile.
        kept: where the earlier result of the target is now, if somebody has put files of their own into it.
    """

    partial: Path
    target: Path
    kept: Path | None = None


@contextlib.contextmanager
def replacing(folder: Path | str, *, keep: bool = True) -> Iterator[Place]:
    """A folder beside the target to write into, which takes its place when the block ends without an error.

    It is on the disk before it is renamed.

    Args:
        folder: the target.
        keep: leave what can be replayed if an error comes after the motion was there, and say where; False:
            it can be made again from what is kept elsewhere.

    Raises:
        InputError: it can't be written.
        SimreconError: something else went wrong after the motion was there, which is kept.
    """
    target = Path(folder).resolve()
    made = _missing_parents(target)
    place = Place(target, target)
    whole = False
    try:
        with signals.deferred():
            place.partial = _begin(target)
        yield place
        whole = True
        try:
            with signals.deferred():
                _put_in_place(place)
                whole, made = False, []
        except KeyboardInterrupt as error:
            raise KeyboardInterrupt(f"{place.target} is whole but for its picture") from error
    except OSError as error:
        whole = keep and (whole or _is_usable(place.partial))
        kept = f"; the result is kept in {place.partial}" if whole else ""
        raise InputError(f"{atomic.cannot_write(folder, error)}{kept}") from error
    except Exception as error:
        if not (whole := keep and (whole or _is_usable(place.partial))):
            raise
        reason = str(error) if isinstance(error, SimreconError) else f"{type(error).__name__}: {error}"
        raise SimreconError(f"{folder}: {reason}; the motion is kept in {place.partial}") from error
    finally:
        if whole:  # and kept
            (place.partial / MARK).unlink(missing_ok=True)
        else:
            remove_unfinished(place.partial)
            if place.partial != target and place.partial.is_dir():  # its mark was gone already
                discard(place.partial)
            for parent in made:
                with contextlib.suppress(OSError):
                    parent.rmdir()


def remove_unfinished(folder: Path) -> None:
    """Remove a folder that carries our mark, with all that it holds; another one stays."""
    if (folder / MARK).is_file() and not folder.is_symlink():
        shutil.rmtree(folder, ignore_errors=True)


def discard(folder: Path) -> bool:
    """Remove a result file by file; one with anything else in it stays.

    Returns:
        Whether it is gone.
    """
    if folder.is_symlink() or not folders.is_plain(folder):
        return False
    try:
        for path in sorted(folder.iterdir(), key=lambda path: path.name == folders.REPORT):
            if path.name == folders.EXPORT:
                for exported in path.iterdir():
                    exported.unlink()
                path.rmdir()
            else:
                path.unlink()
        folder.rmdir()
    except OSError:  # what is put into it meanwhile stays
        return False
    return True


def free(target: Path, word: str = "") -> Path:
    """The first of `OUT-2`, `OUT-3`, … that is not there; with a word of `OUT-word`, `OUT-word-2`, …."""
    first = [f"-{word}"] if word else []
    others = (f"{''.join(first)}-{i}" for i in itertools.count(2))
    names = (target.with_name(atomic.fitted(target.name, end)) for end in itertools.chain(first, others))
    return next(path for path in names if not os.path.lexists(path))


def _begin(target: Path) -> Path:
    """A new folder beside the target, with our mark in it."""
    for i in itertools.count():
        ending = f".{os.getpid()}{f'-{i}' if i else ''}.partial"
        partial = target.with_name(atomic.fitted(f".{target.name}", ending))
        remove_unfinished(partial)  # of a killed process that had the same number
        with contextlib.suppress(FileExistsError):
            partial.mkdir(parents=True)
            (partial / MARK).touch()
            return partial
    raise AssertionError


def _is_usable(partial: Path) -> bool:
    """Whether all that replays the motion is there: the scene is written after motion and model."""
    return (partial / MARK).is_file() and (partial / folders.SCENE).is_file()


def _missing_parents(target: Path) -> list[Path]:
    """Folders above the target that are not there yet, innermost first."""
    return [parent for parent in target.parents if not parent.exists()]


def _put_in_place(place: Place) -> None:
    """Rename the finished folder; an earlier result is moved aside first, looked at again, deleted last."""
    partial, target = place.partial, place.target
    atomic.flush_all(partial)
    (partial / MARK).unlink()
    atomic.flush(partial)  # or a power cut leaves a result with our mark in it
    if not target.exists():
        partial.rename(target)
    else:
        earlier = partial.with_suffix(".earlier")
        target.rename(earlier)
        try:
            partial.rename(target)
        except BaseException:
            if not target.exists():
                earlier.rename(target)
            raise
        if not discard(earlier) and earlier.is_dir():
            place.kept = earlier.rename(free(target, "earlier"))
    atomic.flush(target.parent)
