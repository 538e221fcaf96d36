"""What the user asks to be written, where they say: scene, contacts, and whole results."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

from simrecon import job as jobs
from simrecon import scene as scenes
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.io import atomic, toml
from simrecon.io.paths import usable
from simrecon.job import request
from simrecon.results import Result, check_writable, open_result, placing
from simrecon.results.folder import FILES, JOB, START
from simrecon.studio.clip import Clip
from simrecon.studio.document import Document
from simrecon.studio.journal import state_folder


def scene(document: Document, path: Path | str, *, replaces: bool) -> None:
    """Write `scene.toml`, with the comments of the file that was opened.

    Raises:
        InputError: it is there already and is not to be replaced, or can't be written.
    """
    place = target(path, replaces, document.where)
    text = document.edits.scene
    folder = Path(document.scene.folder).resolve()
    meshes = any(item.kind == "mesh" for item in document.scene.items)
    if meshes and folder != place.resolve().parent and "folder" not in toml.loads(text, str(path)):
        text = toml.dumps({"folder": str(folder)}) + text
    scenes.parse(text, place)
    with atomic.reported(place):
        atomic.write_text(place, text)


def contacts(document: Document, clip: Clip | None, path: Path | str, *, replaces: bool) -> None:
    """Write `contacts.toml`: the wishes, beside what was found.

    Raises:
        InputError: as of `scene`.
    """
    place = target(path, replaces)
    found = clip.touched if clip is not None and clip.motion is not None else None
    with atomic.reported(place):
        atomic.write_text(place, wishes.dumps(document.edits.wishes, found))


def result(made: Result, folder: Path | str) -> Result:
    """Copy a result to where the user wants it; its job says that it is there.

    Raises:
        InputError: the folder can't be written, or holds what is no result.
    """
    check_writable(folder)
    with placing.replacing(folder, keep=False) as place:
        for path in sorted(made.folder.iterdir()):
            if path.name in FILES and path.name != JOB:
                shutil.copyfile(path, place.partial / path.name)
        job = replace(made.job, output=str(place.target))
        if job.start is not None:
            job = request.moved(job, "start", str(place.target / START))
        text = jobs.dumps(jobs.absolute(job))
        (place.partial / JOB).write_bytes(text.encode("utf-8", "surrogateescape"))
    return open_result(place.target)


def discard(made: Result) -> None:
    """Remove a result from the cache; one that lies elsewhere stays."""
    if state_folder().resolve() in made.folder.resolve().parents:
        placing.discard(made.folder)


def target(path: Path | str, replaces: bool, own: str = "") -> Path:
    """The file to write; another one than the opened is not replaced unasked.

    Raises:
        InputError: it is no .toml, or is there already.
    """
    place = usable(path)
    if place.suffix != ".toml":
        raise InputError(f"{path}: is no .toml; valid: a name that ends in .toml")
    same = os.path.realpath(place) == os.path.realpath(own or ".")
    if os.path.lexists(place) and not replaces and not same:
        raise InputError(f"{path}: exists already; valid: a new file, or tick 'replace'")
    return place
