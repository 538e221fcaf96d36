"""What is noted of a finished clip: key, figures and files; believed only where all of it fits."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeGuard

from simrecon.batch import journal
from simrecon.batch.journal import Places
from simrecon.errors import InputError
from simrecon.results import verdict, whole

_NUMBERS = ("fallback", "frames", "video_s", "wall_s")


@dataclass(frozen=True)
class Record:
    """Of a finished clip.

    Attributes:
        key: hash of all that the result depends on.
        figures: what the batch shows of it.
        files: sizes and hashes (`whole.note`).
    """

    key: str
    figures: Mapping[str, Any]
    files: Mapping[str, Any]


def write(places: Places, name: str, key: str, figures: Mapping[str, Any]) -> None:
    """Note that a clip is done, once its result is on the disk.

    Raises:
        OSError: the disk is full, or fails.
    """
    files = whole.note(places.result(name))
    journal.write_json(places.record(name), {"key": key, "figures": figures, "files": files})


def read(places: Places, name: str) -> Record | None:
    """The record of a clip; None where there is none, or it is damaged."""
    said = journal.read_json(places.record(name)) or {}
    key, figures, files = said.get("key"), said.get("figures"), said.get("files", {})
    if not isinstance(key, str) or not isinstance(files, dict) or not _fit(figures):
        return None
    return Record(key, figures, files)


def damage(places: Places, name: str, *, hashes: bool = False) -> str:
    """What is wrong with the result of a clip that is done, in a few words; nothing is `""`."""
    found = read(places, name)
    if found is None:
        return "its record is damaged" if os.path.lexists(places.record(name)) else ""
    return whole.damage(places.result(name), found.files, hashes=hashes)


def verify(places: Places) -> dict[str, str]:
    """What is wrong with each clip that is done, by name: all files are read and compared.

    Raises:
        InputError: there is no batch.
    """
    if not places.events.is_file():
        raise InputError(f"{places.root}: found no batch there; valid: the folder of `simrecon batch`")
    folder = places.record("x").parent
    names = sorted(path.stem for path in folder.glob("*.json")) if folder.is_dir() else []
    return {name: damage(places, name, hashes=True) for name in names}


def _fit(figures: Any) -> TypeGuard[dict[str, Any]]:
    """Whether figures are of the types that are shown."""
    if not isinstance(figures, dict) or not isinstance(figures.get("verdict"), str):
        return False
    numbers = [figures.get(name) for name in _NUMBERS]
    metrics = figures.get("metrics")
    if not isinstance(metrics, dict) or not isinstance(figures.get("fell"), bool):
        return False
    numbers += [0.0 if value is None else value for value in (figures.get("loss"), *metrics.values())]
    known = figures.get("quality", verdict.GOOD) in verdict.LEVELS
    return known and all(journal.is_number(value) for value in numbers)
