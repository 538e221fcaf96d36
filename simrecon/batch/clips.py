"""What a batch is to do: clips from folders, globs and manifests, each with a name of its own."""

from __future__ import annotations

import csv
import glob
import hashlib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from simrecon import engines, planners
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.evidence import formats
from simrecon.job import Job
from simrecon.job.text import Option, with_options
from simrecon.job.text import options as job_options
from simrecon.types import Scene

SUFFIXES = (".npz", ".pkl", ".pt", ".pth", ".npy", ".json", ".bvh", ".trc", ".mot", ".c3d")
"""Files that are taken from a folder; a file that is named by itself may have any suffix."""
MANIFESTS = (".toml", ".csv")
RESERVED = ("batch.jsonl", "index.html")
VIDEOS = (".mp4", ".mov", ".avi", ".mkv", ".webm")
"""Taken from a folder too, if no other input there has the same stem."""
OLDER_KEYS = ("person_at", "width_px", "height_px")
"""Keys of manifests that were options of their own: `person_at_px`, and `size_px` in two parts."""
OPTIONS = {option.name: option for option in job_options()}
KEYS = ("name", "input", "plan", "scene", "planner", "engine", *OPTIONS, *OLDER_KEYS)


@dataclass(frozen=True)
class Clip:
    """One clip of a batch.

    Attributes:
        name: unique; the name of its folder.
        input: absolute path.
        plan: a name or path.
        scene: absolute path, or None.
        planner, engine: by name.
        options: of its job (`job.options`), by name; what is not there is as the input says.
    """

    name: str
    input: str
    plan: str = "default"
    scene: str | None = None
    planner: str = "none"
    engine: str = "sampling"
    options: Mapping[str, Any] = field(default_factory=dict)

    def job(self, output: Path | str) -> Job:
        """The job of the clip.

        Args:
            output: folder of its result.

        Raises:
            InputError: the plan or the scene can't be read.
        """
        bare = Job(
            self.input,
            str(output),
            plan=plans.read(self.plan),
            scene=Scene() if self.scene is None else scenes.read(self.scene),
            planner=self.planner,
            engine=self.engine,
        )
        return with_options(bare, dict(self.options))


def collect(
    inputs: Iterable[str],
    defaults: Mapping[str, Any] | None = None,
    *,
    scene_folder: str | None = None,
    video_folder: str | None = None,
) -> tuple[Clip, ...]:
    """All clips of a batch, in the order in which they are named.

    Args:
        inputs: files, folders, globs and manifests (TOML or CSV).
        defaults: of the clips: plan, scene, planner, engine and options by name.
        scene_folder: where `NAME.toml` is the scene of the clip NAME, or None.
        video_folder: where `NAME.mp4`, or another video, is the video of the clip NAME, or None.

    Raises:
        InputError: an input is not there, a manifest has an unknown key or impossible value, or there is no
            clip at all.
    """
    values = dict(defaults or {})
    entries: list[tuple[str | None, Clip]] = []
    for word in inputs:
        for path, root in _paths(word):
            if path.suffix.lower() in MANIFESTS and root is None:
                entries += _manifest(path, values)
            else:
                entries.append((None, _clip(_stem(path, root), path, values)))
    if not entries:
        words = ", ".join(inputs)
        raise InputError(f"{words}: found no clip; valid: files of {', '.join(formats.names())}")
    return tuple(_beside(clip, scene_folder, video_folder) for clip in _named(entries))


def _clip(name: str, path: Path, values: Mapping[str, Any]) -> Clip:
    """A clip with its own fields and options of the values."""
    options = {key: value for key, value in values.items() if key in OPTIONS}
    own: dict[str, Any] = {key: value for key, value in values.items() if key not in OPTIONS}
    return Clip(name, str(path.resolve()), options=options, **own)


def _paths(text: str) -> list[tuple[Path, Path | None]]:
    """Files, and the folder in which each was found if it was not named itself."""
    path = Path(text).expanduser()
    if path.is_file():
        return [(path, None)]
    if path.is_dir():
        return [(item, path) for item in _inside(path)] if not _is_clip(path) else [(path, None)]
    matches = sorted(glob.glob(str(path), recursive=True))
    if not matches:
        raise InputError(f"{text}: found no such file or folder, and nothing that matches it")
    return [pair for match in matches for pair in _paths(match)]


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


def _stem(path: Path, root: Path | None) -> str:
    """A clip's first name: that of its file, with its folders below the one that was given."""
    inside = path.relative_to(root) if root is not None else Path(path.resolve().name)
    text = inside.as_posix()
    return _safe(text[: -len(path.suffix)] if path.is_file() and path.suffix else text)


def _safe(name: str) -> str:
    """A file name that is the same on every system."""
    safe = re.sub(r"[^\w.+-]+", "_", name.replace("/", "_")).strip("._") or "clip"
    return f"{safe}_clip" if safe in RESERVED else safe[:150]


def _named(entries: list[tuple[str | None, Clip]]) -> list[Clip]:
    """Clips with names of their own: of those that share one, all get their input's hash behind it.

    A name that a manifest gives is never changed; two that are equal are an error.
    """
    chosen = [name for name, _ in entries if name is not None]
    for word in chosen:
        if chosen.count(word) > 1:
            raise InputError(f"clip {word!r}: found {chosen.count(word)} of that name; valid: each its own")
    entries = [
        entry for i, entry in enumerate(entries) if entry not in entries[:i]
    ]  # a file may be named twice
    count: dict[str, int] = {}
    for _, clip in entries:
        count[clip.name.lower()] = count.get(clip.name.lower(), 0) + 1
    named: dict[str, Clip] = {}
    for name, clip in entries:
        if name is None and count[clip.name.lower()] > 1:
            mark = hashlib.sha256(
                f"{clip.input} {clip.options.get('person')} {clip.plan}".encode()
            ).hexdigest()[:6]
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
        if folder is None or (clip.scene if key == "scene" else clip.options.get(key)) is not None:
            continue
        if not Path(folder).is_dir():
            raise InputError(
                f"--{key}-dir: found no folder {folder}; valid: one with a file NAME{suffixes[0]}"
            )
        there = [Path(folder) / f"{name}{suffix}" for name in (clip.name, stem) for suffix in suffixes]
        first = next((path for path in there if path.is_file()), None)
        if first is not None:
            value = str(first.resolve())
            if key == "scene":
                clip = replace(clip, scene=value)
            else:
                clip = replace(clip, options={**clip.options, key: value})
    return clip


def _manifest(path: Path, defaults: Mapping[str, Any]) -> list[tuple[str | None, Clip]]:
    rows, shared = _toml(path) if path.suffix.lower() == ".toml" else _csv(path)
    entries: list[tuple[str | None, Clip]] = []
    for where, row in rows:
        own = _checked(where, {**shared, **row}, path.resolve().parent)
        if "input" not in own:
            raise InputError(f"{where} lacks the key 'input'; valid: {', '.join(KEYS)}")
        inputs = _paths(own.pop("input"))
        name = own.pop("name", None)
        if name is not None and len(inputs) > 1:
            raise InputError(f"{where} name: found one for {len(inputs)} inputs; valid: leave it out")
        for file, root in inputs:
            entries.append((name, _clip(name or _stem(file, root), file, {**defaults, **own})))
    return entries


def _toml(path: Path) -> tuple[list[tuple[str, Mapping[str, Any]]], dict[str, Any]]:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
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
    values: dict[str, Any] = {}
    for key, value in _renamed(where, row).items():
        if key not in KEYS:
            raise InputError(f"{where} unknown key {key!r}; valid: {', '.join(KEYS)}")
        if key in OPTIONS:
            values[key] = _option(f"{where} {key}", OPTIONS[key], value)
        elif not isinstance(value, str) or not value.strip():
            raise InputError(f"{where} {key} must be text, found {value!r}")
        else:
            values[key] = value
        if key == "name" and _safe(value) != value:
            raise InputError(f"{where} name: found {value!r}; valid: a file name such as {_safe(value)!r}")
        values[key] = _path(f"{where} {key}", key, values[key], folder)
    _check_names(where, values)
    return values


def _renamed(where: str, row: Mapping[str, Any]) -> dict[str, Any]:
    """A row with the older keys under the names of today's options."""
    values = dict(row)
    if "person_at" in values:
        values["person_at_px"] = values.pop("person_at")
    sides = [values.pop(key, None) for key in ("width_px", "height_px")]
    if sides != [None, None]:
        if None in sides:
            raise InputError(f"{where} found one of width_px and height_px; valid: both, or size_px")
        values["size_px"] = f"{sides[0]}x{sides[1]}"
    return values


def _option(where: str, option: Option, value: Any) -> Any:
    """A value of TOML, or a cell of a table, as that of an option."""
    try:
        return option.parse(value) if isinstance(value, str) else option.check(value)
    except InputError as error:
        raise InputError(f"{where} {error}") from error


def _path(where: str, key: str, value: Any, folder: Path) -> Any:
    """A file's path as seen from the manifest's folder; other values as they are."""
    is_file = key in ("input", "scene") or (key in OPTIONS and OPTIONS[key].rules.get("file"))
    if not is_file and key != "plan":
        return value
    inside = folder / Path(value).expanduser()
    if key == "plan":
        return str(inside) if inside.is_file() else value
    if key != "input" and not inside.exists():
        raise InputError(f"{where}: found no file {inside}")
    return str(inside)


def _check_names(where: str, values: Mapping[str, Any]) -> None:
    """Check that planner and engine are there."""
    for key, valid in (("planner", planners.names()), ("engine", engines.names())):
        if key in values and values[key] not in valid:
            raise InputError(f"{where} {key} must be one of {', '.join(valid)}, found {values[key]!r}")
