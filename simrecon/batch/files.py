"""Input files of a batch: named, found in folders or by globs; and the first names of their clips."""

from __future__ import annotations

import glob
import os
import re
from pathlib import Path

from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.io.paths import usable

SUFFIXES = (".npz", ".pkl", ".pt", ".pth", ".npy", ".json", ".bvh", ".trc", ".mot", ".c3d")
"""Files that are taken from a folder; a file that is named by itself may have any suffix."""
NAME_MAX_BYTES = 150
"""Longest name of a clip: what is added to it for its files must find room too."""
_DEPTH_MAX = 200
RESERVED = ("batch.jsonl", "index.html")
VIDEOS = (".mp4", ".mov", ".avi", ".mkv", ".webm")
"""Taken from a folder too, if no other input there has the same stem."""


def find(text: str) -> list[tuple[Path, Path | None]]:
    """Files, and the folder in which each was found if it was not named itself."""
    path = usable(text).expanduser()
    try:
        is_file, is_folder = path.is_file(), path.is_dir()
    except OSError as error:  # a name that no file can have
        raise InputError(f"{text[:80]}: cannot be looked for: {error.strerror}") from error
    if is_file:
        return [(path, None)]
    if is_folder:
        return [(item, path) for item in _inside(path)] if not _is_clip(path) else [(path, None)]
    if os.path.lexists(path):
        found = "a pipe or a device" if path.exists() else "a link that leads nowhere"
        raise InputError(f"{text}: found {found}; valid: a file, a folder or a glob")
    matches = _matches(path)
    if not matches:
        raise InputError(f"{text}: found no such file or folder, and nothing that matches it")
    return [pair for match in matches for pair in find(match)]


def _matches(path: Path) -> list[str]:
    """What a glob finds; `**` goes into no folder by a link, for links may go in a circle."""
    parts = path.parts
    if "**" not in parts:
        return sorted(glob.glob(str(path)))
    first = next(i for i, part in enumerate(parts) if glob.has_magic(part))
    base, pattern = Path(*parts[:first]), Path(*parts[first:])
    found = base.glob(str(pattern / "*" if parts[-1] == "**" else pattern))
    return sorted({str(one) for one in found if not _is_hidden(one.relative_to(base))})


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _inside(folder: Path, seen: set[Path] | None = None) -> list[Path]:
    """Clips in a folder and those below it, by name; hidden ones, manifests and results are left out.

    A folder that links lead to more than once (`seen`) is looked at once.
    """
    seen = set() if seen is None else seen
    place = folder.resolve()
    if place in seen or (folder / "report.json").is_file() or (folder / "batch.jsonl").is_file():
        return []
    if len(place.parts) > _DEPTH_MAX:
        raise InputError(f"{folder}: found folders in more than {_DEPTH_MAX} others; valid: fewer")
    seen.add(place)
    inputs: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir():
            inputs += [path] if _is_clip(path) else _inside(path, seen)
        elif path.suffix.lower() in (*SUFFIXES, *VIDEOS):
            inputs.append(path)
    others = {path.stem for path in inputs if path.suffix.lower() not in VIDEOS}
    return [path for path in inputs if path.suffix.lower() not in VIDEOS or path.stem not in others]


def _is_clip(folder: Path) -> bool:
    """A folder that is one clip: OpenPose writes a JSON file for each frame."""
    return any(folder.glob("*_keypoints.json"))


def stem(path: Path, root: Path | None) -> str:
    """A clip's first name: that of its file, with its folders below the one that was given."""
    inside = path.relative_to(root) if root is not None else Path(path.resolve().name)
    text = inside.as_posix()
    return safe(text[: -len(path.suffix)] if path.is_file() and path.suffix else text)


def safe(name: str) -> str:
    """A file name that is the same on every system."""
    word = re.sub(r"[^\w.+-]+", "_", name.replace("/", "_")).strip("._") or "clip"
    return f"{word}_clip" if word in RESERVED else atomic.fitted(word, longest=NAME_MAX_BYTES)
