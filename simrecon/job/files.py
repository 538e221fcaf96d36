"""`job.toml` (`simrecon.job/1`) ↔ `Job`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from simrecon import plan as plans
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.evidence.video import frames
from simrecon.io import provenance, tables, toml
from simrecon.io.messages import check_keys, shown
from simrecon.job.options import Person, Reading
from simrecon.job.request import Job, contents
from simrecon.scene import files as scene_files
from simrecon.types import ContactWish, Scene

SCHEMA = "simrecon.job/1"
SECTIONS = {"reading": Reading, "person": Person}
_OWN_FORM = (*SECTIONS, "scene", "contacts", "plan")
_PATHS = ("input", "output", "video", "detected", "start")


def read(path: Path | str) -> Job:
    """Read a job; relative paths begin at its folder.

    Raises:
        InputError: it can't be read, lacks a key, or holds an unknown or impossible one.
    """
    table = toml.load(path, "job", any_bytes=True)
    where = f"{path}:"
    schema = table.pop("schema", None)
    if schema != SCHEMA:
        raise InputError(f"{where} schema is {shown(schema)}; valid: {SCHEMA!r}")
    folder = Path(path).resolve().parent
    known: dict[str, Any] = {
        name: tables.build(kind, table.pop(name, {}), f"{where} [{name}]") for name, kind in SECTIONS.items()
    }
    known["scene"] = _scene(table.pop("scene", {}), path, folder)
    known["contacts"] = _contacts(table.pop("contacts", {}), path, folder)
    known["plan"] = _plan(table.pop("plan", "default"), path, folder)
    plain = {name: key for name, key in tables.keys(Job).items() if name not in _OWN_FORM}
    check_keys(where, table, (*plain, *_OWN_FORM), ("input", "output"))
    for name, value in table.items():
        known[name] = tables.check(plain[name], value, where)
    return with_paths(Job(**known), lambda file: _absolute(folder, file, where))


def _absolute(folder: Path, file: str, where: str) -> str:
    """A path that begins at a folder."""
    try:
        return str((folder / file).resolve())
    except (OSError, ValueError, RuntimeError) as error:  # a NUL, links in a circle
        raise InputError(f"{where} found the path {shown(file)} ({error}); valid: one of a file") from error


def dumps(job: Job) -> str:
    """The text of a job; `read` gives an equal one if its paths are absolute (`absolute`)."""
    content: dict[str, Any] = {"schema": SCHEMA}
    for item in fields(Job):
        if item.name not in _OWN_FORM and getattr(job, item.name) is not None:
            content[item.name] = tables.plain(getattr(job, item.name))
    for name in SECTIONS:
        content[name] = tables.to_table(getattr(job, name))
    content["scene"] = {"folder": job.scene.folder, **scene_files.tables(job.scene)}
    if job.contacts:
        content["contacts"] = wishes.to_table(job.contacts)
    content["plan"] = {"name": job.plan.name, **plans.to_dict(job.plan)}
    return toml.dumps(content)


def absolute(job: Job) -> Job:
    """The job with absolute paths, to be read back anywhere."""
    scene = replace(job.scene, folder=str(Path(job.scene.folder).resolve()))
    return with_paths(replace(job, scene=scene), lambda file: str(Path(file).resolve()))


def identity(job: Job) -> str:
    """Hash of all of a job that its motion depends on: what files hold, settings, the code and its versions.

    Where the files lie, where the result goes, what is drawn on and how, and whether a page is made, make no
    difference. Of a video beside the input, frame rate and image size do.
    """
    hashes = {name: digest for name, digest in contents(job).items() if name != "video"}
    bare = replace(with_paths(job, lambda _: ""), sha256=hashes, threads=0, video=None, no_report=False)
    bare = replace(bare, style=Job.style)
    bare = replace(bare, scene=replace(job.scene, folder=""), plan=replace(job.plan, name=""))
    beside = None if job.detected is not None or job.retarget else job.video
    content = {
        "job": dumps(bare),
        "video": None if beside is None else _told(beside),
        "code": provenance.code_digest(),
        "versions": provenance.versions(),
    }
    return provenance.digest_of(content)


def _told(video: str) -> tuple[Any, ...] | None:
    """What of a video beside the input its reading depends on; None of one that can't be read."""
    try:
        info = frames.probe(Path(video))
    except InputError:  # said when it is read
        return None
    return info.rate_hz, info.size_px, info.form.aspect


def with_paths(job: Job, change: Callable[[str], str]) -> Job:
    """The job with each of its paths changed."""

    def changes(value: Any, names: tuple[str, ...]) -> dict[str, str]:
        return {name: change(getattr(value, name)) for name in names if getattr(value, name)}

    def files_of(kind: type) -> tuple[str, ...]:
        return tuple(item.name for item in fields(kind) if item.metadata.get("file"))

    reading = replace(job.reading, **changes(job.reading, files_of(Reading)))  # type: ignore[arg-type]
    person = replace(job.person, **changes(job.person, files_of(Person)))  # type: ignore[arg-type]
    own: dict[str, Any] = changes(job, _PATHS)
    known = {change(path): digest for path, digest in job.sha256.items()}
    return replace(job, reading=reading, person=person, sha256=known, **own)


def _scene(table: Any, path: Path | str, folder: Path) -> Scene:
    """A scene that stands in the file, or that a path names."""
    if isinstance(table, str):
        return scene_files.read(folder / table)
    if not isinstance(table, dict):
        raise InputError(f"{path}: scene is {shown(table)}; valid: a table, or the path of a scene file")
    if not isinstance(own := table.get("folder", "."), str) or "\0" in own:
        raise InputError(f"{path}: [scene] folder must be a path in quotes, found {shown(own)}")
    return scene_files.scene(table, folder / Path(path).name)


def _contacts(table: Any, path: Path | str, folder: Path) -> tuple[ContactWish, ...]:
    """Wishes that stand in the file, or that a path names."""
    if isinstance(table, str):
        return wishes.read(folder / table)
    return wishes.build(table, f"{path}: [contacts]")


def _plan(table: Any, path: Path | str, folder: Path) -> plans.Plan:
    """A plan that a name or a path names, or that stands in the file; what it leaves out has its default."""
    if isinstance(table, str):
        own = folder / table
        return plans.read(own if own.is_file() else table)
    if not isinstance(table, dict):
        raise InputError(f"{path}: plan is {shown(table)}; valid: a table, or the name of a plan")
    inside, usual = dict(table), plans.read("default")
    name = str(inside.pop("name", "" if table else usual.name))
    content = {**plans.to_dict(usual), **inside}
    for section, values in plans.to_dict(usual).items():
        if isinstance(values, dict) and isinstance(content[section], dict):
            content[section] = {**values, **content[section]}
    return replace(plans.build(content, f"{path}: [plan]"), name=name)
