"""Input files of a batch: named, found in folders or by globs; and the first names of their clips."""

from __future__ import annotations

import glob
import re
from pathlib import Path

from simrecon.errors import InputError
from simrecon.io import atomic

SUFFIXES = (".npz", ".pkl", ".pt", ".pth", ".npy", ".json", ".bvh", ".trc", ".mot", ".c3d")
"""Files that are taken from a folder; a file that is named by itself may have any suffix."""
NAME_MAX_BYTES = 150
"""Longest name of a clip: what is added to it for its files must find room too."""
RESERVED = ("batch.jsonl", "index.html")
VIDEOS = (".mp4", ".mov", ".avi", ".mkv", ".webm")
"""Taken from a folder too, if no other input there has the same stem."""


def find(text: str) -> list[tuple[Path, Path | None]]:
    """Files, and the folder in which each was found if it was not named itself."""
    path = Path(text).expanduser()
    try:
        is_file, is_folder = path.is_file(), path.is_dir()
    except OSError as error:  # a name that no file can have
        raise InputError(f"{text[:80]}: cannot be looked for: {error.strerror}") from error
    if is_file:
        return [(path, None)]
    if is_folder:
        return [(item, path) for item in _inside(path)] if not _is_clip(path) else [(path, None)]
    matches = sorted(glob.glob(str(path), recursive=True))
    if not matches:
        raise InputError(f"{text}: found no such file or folder, and nothing that matches it")
    return [pair for match in matches for pair in find(match)]


def _inside(folder: Path) -> list[Path]:
    """Clips in a folder and those below it, by name; hidden ones, manifests and results are left out."""
    if (folder / "report.json").is_file() or (folder / "batch.jsonl").is_file():
        return []
    inputs: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir():
            inputs += [path] if _is_clip(path) else _inside(path)
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
