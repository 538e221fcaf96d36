"""What a batch is to do: clips from folders, globs and manifests, each with a name of its own."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.batch import files, manifest, shared
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.evidence import formats
from simrecon.job import Job, looking, text
from simrecon.types import Scene

OF_PART = ("from_s", "to_s", "every")
"""Options that select a part of an input, of which a batch may have several."""


@dataclass(frozen=True)
class Clip:
    """One clip of a batch.

    Attributes:
        name: unique; the name of its folder.
        input: absolute path.
        plan: a name or path.
        scene, contacts: absolute paths, or None.
        planner, engine: by name; no planner: that of the plan.
        options: of its job (`job.options`), by name; what is not there is as the input says.
    """

    name: str
    input: str
    plan: str = "default"
    scene: str | None = None
    contacts: str | None = None
    planner: str | None = None
    engine: str = "sampling"
    options: Mapping[str, Any] = field(default_factory=dict)

    def job(self, output: Path | str) -> Job:
        """The job of the clip.

        Args:
            output: folder of its result.

        Raises:
            InputError: the plan, the scene or the contacts can't be read.
        """
        bare = Job(
            self.input,
            str(output),
            plan=plans.read(self.plan),
            scene=Scene() if self.scene is None else scenes.read(self.scene),
            contacts=() if self.contacts is None else wishes.read(self.contacts),
            planner=self.planner,
            engine=self.engine,
        )
        return text.with_options(bare, dict(self.options))


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
        defaults: of the clips: plan, scene, contacts, planner, engine and options by name.
        scene_folder: where `NAME.toml` is the scene of the clip NAME, or None.
        video_folder: where `NAME.mp4`, or another video, is the video of the clip NAME, or None.

    Raises:
        InputError: an input is not there, a manifest has an unknown key or impossible value, or there is no
            clip at all.
    """
    values = dict(defaults or {})
    entries: list[tuple[str | None, Clip]] = []
    for word in inputs:
        for path, root in files.find(word):
            if path.suffix.lower() in manifest.SUFFIXES and root is None:
                entries += [_listed(entry, values) for entry in manifest.read(path)]
            else:
                own = shared.without_foreign(values, tuple(values), path)
                entries.append((None, _clip(files.stem(path, root), path, own)))
    if not entries:
        words = ", ".join(inputs)
        raise InputError(f"{words}: found no clip; valid: files of {', '.join(formats.names())}")
    used = {name for _, clip in entries for name in clip.options}
    shared.refuse_idle(tuple(values), used)
    return tuple(_beside(clip, scene_folder, video_folder) for clip in _named(entries))


def _clip(name: str, path: Path, values: Mapping[str, Any]) -> Clip:
    """A clip with its own fields and options of the values."""
    options = {key: value for key, value in values.items() if key in manifest.OPTIONS}
    if options.get("person") == looking.EVERYBODY:
        valid = "the number of one in a clip for each, in a manifest; or `simrecon run`"
        raise InputError(f"{path}: person: found {looking.EVERYBODY!r}; valid in a batch: {valid}")
    own: dict[str, Any] = {key: value for key, value in values.items() if key not in manifest.OPTIONS}
    return Clip(name, str(path.resolve()), options=options, **own)


def _listed(entry: manifest.Entry, defaults: Mapping[str, Any]) -> tuple[str | None, Clip]:
    """A clip of a manifest, and the name that it was given."""
    name = entry.name or files.stem(entry.path, entry.root)
    values = text.over(defaults, entry.values)
    common = {*entry.shared, *(key for key in defaults if key not in entry.values)}
    return entry.name, _clip(name, entry.path, shared.without_foreign(values, common, entry.path))


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
            told = f"{clip.input} {clip.options.get('person')} {clip.plan}"
            parts = [f" {key} {clip.options[key]}" for key in OF_PART if key in clip.options]
            mark = hashlib.sha256((told + "".join(parts)).encode("utf-8", "surrogateescape")).hexdigest()[:6]
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
        ("video", videos, files.VIDEOS),
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
