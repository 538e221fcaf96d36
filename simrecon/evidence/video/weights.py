"""The weights of BlazePose: which there are, where they are kept, and whether they are whole.

They are Apache-2.0 and no part of simrecon (`fetching`). Each file is compared with its SHA-256.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from simrecon.errors import InputError

MODELS = ("heavy", "full", "lite")
BY_NAME = ("lite",)
"""Models that are fetched only where they are named."""
COMMAND = "simrecon models fetch"


@dataclass(frozen=True)
class Weights:
    """One file.

    Attributes:
        name: `detector` or one of `MODELS`.
        file: its name in the cache.
        sha256: of the file as npm has it, and as pip has it where it differs.
        npm, pip: its path in the packages, None where it is in none.
        purpose: a few words.
    """

    name: str
    file: str
    sha256: tuple[str, ...]
    npm: str | None
    pip: str | None
    purpose: str


TABLE: tuple[Weights, ...] = (
    Weights(
        "detector",
        "pose_detection.tflite",
        (
            "a63c614bef30d35947f13be361820b1e4e3bec9cfeebf4d11216a18373108e85",
            "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
        ),
        "package/pose_solution_packed_assets.data",
        "mediapipe/modules/pose_detection/pose_detection.tflite",
        "finds people",
    ),
    Weights(
        "heavy",
        "pose_landmark_heavy.tflite",
        ("59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe",),
        "package/pose_landmark_heavy.tflite",
        None,
        "landmarks, most accurate",
    ),
    Weights(
        "full",
        "pose_landmark_full.tflite",
        ("e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",),
        "package/pose_landmark_full.tflite",
        "mediapipe/modules/pose_landmark/pose_landmark_full.tflite",
        "landmarks, faster",
    ),
    Weights(
        "lite",
        "pose_landmark_lite.tflite",
        ("f17bfbecadb61c3be1baa8b8d851cc6619c870a87167b32848ad20db306b9d61",),
        "package/pose_landmark_lite.tflite",
        None,
        "landmarks, fastest",
    ),
)


def cache_folder() -> Path:
    """`SIMRECON_CACHE`, else `simrecon` in `XDG_CACHE_HOME`, else in `~/.cache`."""
    if place := os.environ.get("SIMRECON_CACHE"):
        return Path(place)
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if base.startswith("/") else Path.home() / ".cache") / "simrecon"


def folder() -> Path:
    """Of the weights."""
    return cache_folder() / "weights"


def entry(name: str) -> Weights:
    """The row of the table by name."""
    return next(one for one in TABLE if one.name == name)


def state(one: Weights) -> str:
    """`there`, `missing` or `damaged`."""
    path = folder() / one.file
    if not path.is_file():
        return "missing"
    stat = path.stat()
    return "there" if _digest(path, stat.st_mtime_ns, stat.st_size) in one.sha256 else "damaged"


@cache
def _digest(path: Path, _changed: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def find(name: str) -> tuple[Path, str]:
    """The file of a network and its SHA-256.

    Raises:
        InputError: missing or damaged; the message is the command to type.
    """
    one = entry(name)
    path, status = folder() / one.file, state(one)
    command = f"{COMMAND} {name}" if name in BY_NAME else COMMAND
    if status == "missing":
        raise InputError(f"{path}: the weights of BlazePose ({name}) are not there; fetch them: {command}")
    if status == "damaged":
        raise InputError(f"{path}: found other content than its SHA-256 says; fetch it again: {command}")
    stat = path.stat()
    return path, _digest(path, stat.st_mtime_ns, stat.st_size)


def best() -> str:
    """The most accurate model that is there; `heavy` if none is."""
    return next((name for name in MODELS if state(entry(name)) != "missing"), MODELS[0])
