"""What a batch is to do: clips from folders, globs and manifests, each with a name of its own."""

from __future__ import annotations

import csv
import glob
import hashlib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from simrecon.errors import InputError
from simrecon.evidence import formats
from simrecon.evidence.fov import FOV_RANGE_DEG, RATE_RANGE_HZ
from simrecon.evidence.npz import HEIGHT_RANGE_M, MASS_RANGE_KG
from simrecon.evidence.options import AXES, FRAMES, UNITS_M, place
from simrecon.evidence.video.weights import MODELS

SUFFIXES = (".npz", ".pkl", ".pt", ".pth", ".npy", ".json", ".bvh", ".trc", ".mot", ".c3d")
"""Files that are taken from a folder; a file that is named by itself may have any suffix."""
MANIFESTS = (".toml", ".csv")
RESERVED = ("batch.jsonl", "index.html")
VIDEOS = (".mp4", ".mov", ".avi", ".mkv", ".webm")
"""Taken from a folder too, if no other input there has the same stem."""
_FILES = ("input", "scene", "video", "keypoints", "camera")
_RANGES = {
    "mass_kg": MASS_RANGE_KG,
    "height_m": HEIGHT_RANGE_M,
    "fps": RATE_RANGE_HZ,
    "fov_deg": FOV_RANGE_DEG,
    "width_px": (16, 100_000),
    "height_px": (16, 100_000),
    "seed": (0, 2**63 - 1),
}
_CHOICES = {"up": AXES, "unit": tuple(UNITS_M), "frame": FRAMES, "format": formats.names(), "model": MODELS}


@dataclass(frozen=True)
class Clip:
    """One clip of a batch; None: as the input says, or the batch's default.

    Attributes:
        name: unique; the name of its folder.
        input, scene, video, keypoints, camera: absolute paths.
        plan: a name or path. seed: of random numbers.
        mass_kg, height_m: of the person.
        person, person_at, model, keypoints_person, camera_name, format, up, unit, frame, fps, fov_deg,
        width_px, height_px: how the input is read, as the options of `simrecon run`.
    """

    name: str
    input: str
    plan: str = "default"
    seed: int = 0
    scene: str | None = None
    video: str | None = None
    keypoints: str | None = None
    keypoints_person: str | None = None
    camera: str | None = None
    camera_name: str | None = None
    mass_kg: float | None = None
    height_m: float | None = None
    person: str | None = None
    person_at: str | None = None
    model: str | None = None
    format: str | None = None
    up: str | None = None
    unit: str | None = None
    frame: str | None = None
    fps: float | None = None
    fov_deg: float | None = None
    width_px: int | None = None
    height_px: int | None = None


KEYS = tuple(item.name for item in fields(Clip))
_WHOLE = ("seed", "width_px", "height_px")


def collect(
    inputs: Iterable[str],
    *,
    plan: str = "default",
    seed: int = 0,
    scene_folder: str | None = None,
    video_folder: str | None = None,
) -> tuple[Clip, ...]:
    """All clips of a batch, in the order given.

    Args:
        inputs: files, folders, globs and manifests (TOML or CSV).
        plan: of the clips that name none.
        seed: the same.
        scene_folder: where `NAME.toml` is the scene of the clip NAME, or None.
        video_folder: where `NAME.mp4`, or another video, is the video of the clip NAME, or None.

    Raises:
        InputError: an input is not there, a manifest has an unknown key or impossible value, or nothing is
            found.
    """
    found: list[tuple[str | None, Clip]] = []
    for given in inputs:
        for path, root in _paths(given):
            if path.suffix.lower() in MANIFESTS and root is None:
                found += _manifest(path, plan, seed)
            else:
                found.append((None, Clip(_stem(path, root), str(path.resolve()), plan, seed)))
    if not found:
        given = ", ".join(inputs)
        raise InputError(f"{given}: found no clip; valid: files of {', '.join(formats.names())}")
    clips = [_beside(clip, scene_folder, video_folder) for clip in _named(found)]
    return tuple(clips)


def _paths(given: str) -> list[tuple[Path, Path | None]]:
    """Files, and the folder in which each was found if it was not named itself."""
    path = Path(given).expanduser()
    if path.is_file():
        return [(path, None)]
    if path.is_dir():
        return [(item, path) for item in _inside(path)] if not _is_clip(path) else [(path, None)]
    matches = sorted(glob.glob(str(path), recursive=True))
    if not matches:
        raise InputError(f"{given}: found no such file or folder, and nothing that matches it")
    return [pair for match in matches for pair in _paths(match)]


def _inside(folder: Path) -> list[Path]:
    """Clips in a folder and those below it, by name; hidden ones, manifests and results are left out."""
    if (folder / "report.json").is_file() or (folder / "batch.jsonl").is_file():
        return []
    found: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir():
            found += [path] if _is_clip(path) else _inside(path)
        elif path.suffix.lower() in (*SUFFIXES, *VIDEOS):
            found.append(path)
    others = {path.stem for path in found if path.suffix.lower() not in VIDEOS}
    return [path for path in found if path.suffix.lower() not in VIDEOS or path.stem not in others]


def _is_clip(folder: Path) -> bool:
    """A folder that is one clip: OpenPose writes a JSON file for each frame."""
    return any(folder.glob("*_keypoints.json"))


def _stem(path: Path, root: Path | None) -> str:
    """A clip's first name: that of its file, with its folders below the one that was given."""
    inside = path.relative_to(root) if root is not None else Path(path.resolve().name)
    text = inside.as_posix()
    return _safe(text[: -len(path.suffix)] if path.is_file() and path.suffix else text)


def _safe(name: str) -> str:
    """A file name that is the same on every system."""
    safe = re.sub(r"[^\w.+-]+", "_", name.replace("/", "_")).strip("._") or "clip"
    return f"{safe}_clip" if safe in RESERVED else safe[:150]


def _named(found: list[tuple[str | None, Clip]]) -> list[Clip]:
    """Clips with names of their own: of those that share one, all get their input's hash behind it.

    A name that a manifest gives is never changed; two that are equal are an error.
    """
    given = [name for name, _ in found if name is not None]
    for word in given:
        if given.count(word) > 1:
            raise InputError(f"clip {word!r}: found {given.count(word)} of that name; valid: each its own")
    found = list(dict.fromkeys(found))  # the same file may be given twice
    count: dict[str, int] = {}
    for _, clip in found:
        count[clip.name.lower()] = count.get(clip.name.lower(), 0) + 1
    named: dict[str, Clip] = {}
    for name, clip in found:
        if name is None and count[clip.name.lower()] > 1:
            mark = hashlib.sha256(f"{clip.input} {clip.person} {clip.plan}".encode()).hexdigest()[:6]
            clip = replace(clip, name=f"{clip.name}_{mark}")
        if clip.name in named:
            raise InputError(
                f"{clip.input}: found two clips called {clip.name!r}; valid: a `name` for each in a manifest"
            )
        named[clip.name] = clip
    return list(named.values())


def _beside(clip: Clip, scenes: str | None, videos: str | None) -> Clip:
    """The clip with its scene and video, where a folder holds one of its name."""
    stem = Path(clip.input).stem
    for key, folder, suffixes in (
        ("scene", scenes, (".toml",)),
        ("video", videos, VIDEOS),
    ):
        if folder is None or getattr(clip, key) is not None:
            continue
        if not Path(folder).is_dir():
            raise InputError(
                f"--{key}-dir: found no folder {folder}; valid: one with a file NAME{suffixes[0]}"
            )
        there = [Path(folder) / f"{name}{suffix}" for name in (clip.name, stem) for suffix in suffixes]
        first = next((path for path in there if path.is_file()), None)
        if first is not None:
            given: dict[str, Any] = {key: str(first.resolve())}
            clip = replace(clip, **given)
    return clip


def _manifest(path: Path, plan: str, seed: int) -> list[tuple[str | None, Clip]]:
    rows, defaults = _toml(path) if path.suffix.lower() == ".toml" else _csv(path)
    given: dict[str, Any] = {"plan": plan, "seed": seed}
    found: list[tuple[str | None, Clip]] = []
    for where, row in rows:
        table = given | _checked(where, {**defaults, **row}, path.resolve().parent)
        if "input" not in table:
            raise InputError(f"{where} lacks the key 'input'; valid: {', '.join(KEYS)}")
        inputs = _paths(table.pop("input"))
        named = table.pop("name", None)
        if named is not None and len(inputs) > 1:
            raise InputError(f"{where} name: found one for {len(inputs)} inputs; valid: leave it out")
        for file, root in inputs:
            own = _stem(file, root) if named is None else named
            found.append((named, Clip(own, str(file.resolve()), **table)))
    return found


def _toml(path: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], dict[str, Any]]:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: can't be read as TOML: {error}") from error
    for key in content:
        if key not in ("clip", "defaults"):
            raise InputError(f"{path}: unknown key {key!r}; valid: [defaults] and [[clip]]")
    rows, defaults = content.get("clip"), content.get("defaults", {})
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"{path}: found no [[clip]]; valid: one for each clip")
    if not isinstance(defaults, dict) or "name" in defaults or "input" in defaults:
        raise InputError(f"{path}: [defaults] must be a table without name and input")
    return [(f"{path}: [[clip]] {i}:", row) for i, row in enumerate(rows, 1)], defaults


def _csv(path: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], dict[str, Any]]:
    """Rows of a table with a header; an empty cell is no value."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream, skipinitialspace=True)
            rows = [(f"{path}: line {reader.line_num}:", row) for row in reader]
            header = reader.fieldnames or ()
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: can't be read as CSV: {error}") from error
    if "input" not in header or not rows:
        raise InputError(f"{path}: found no column 'input', or no rows; valid columns: {', '.join(KEYS)}")
    for where, row in rows:
        if None in row or None in row.values():
            raise InputError(f"{where} found a row that is not as long as the header ({len(header)} columns)")
    return [
        (where, {key: cell.strip() for key, cell in row.items() if cell.strip()}) for where, row in rows
    ], {}


def _checked(where: str, row: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The values of a row, of their types; paths are relative to the manifest."""
    found: dict[str, Any] = {}
    for key, value in row.items():
        if key not in KEYS:
            raise InputError(f"{where} unknown key {key!r}; valid: {', '.join(KEYS)}")
        if key in _RANGES:
            found[key] = _number(f"{where} {key}", value, *_RANGES[key], whole=key in _WHOLE)
            continue
        if not isinstance(value, str) or not value.strip():
            raise InputError(f"{where} {key} must be text, found {value!r}")
        if key in _CHOICES and value not in _CHOICES[key]:
            raise InputError(f"{where} {key} must be one of {', '.join(_CHOICES[key])}, found {value!r}")
        if key == "person_at" and place(value) is None:
            raise InputError(f"{where} person_at must be x,y in pixels, such as 640,360, found {value!r}")
        if key == "name" and _safe(value) != value:
            raise InputError(f"{where} name: found {value!r}; valid: a file name such as {_safe(value)!r}")
        inside = folder / Path(value).expanduser()
        is_file = key in _FILES or (key == "plan" and inside.is_file())
        found[key] = str(inside) if is_file else value
        if key in _FILES[1:] and not inside.exists():
            raise InputError(f"{where} {key}: found no file {inside}")
    return found


def _number(where: str, value: Any, low: float, high: float, *, whole: bool) -> float | int:
    kind = "a whole number" if whole else "a number"
    try:
        if isinstance(value, bool):
            raise ValueError
        number = int(str(value)) if whole else float(value)
        if not low <= number <= high:
            raise ValueError
    except (ValueError, TypeError) as error:
        raise InputError(f"{where} must be {kind} from {low:g} to {high:g}, found {value!r}") from error
    return number
