"""A job that a program made, held to the rules of `job.toml`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any

from simrecon import plan as plans
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.io.messages import shown
from simrecon.job.options import Person, Reading
from simrecon.job.request import Job
from simrecon.scene import files as scene_files
from simrecon.types import ContactWish, Scene

_PARTS = {"reading": Reading, "person": Person, "scene": Scene, "plan": plans.Plan}
_READERS = {"scene": ", which simrecon.read_scene reads", "plan": ", which simrecon.read_plan reads"}


def checked(job: Job) -> Job:
    """The job with each value in its own type, as a path that is text; the planner is named.

    Raises:
        InputError: it is no job, or holds a value that a job file could not; the message names the field.
    """
    if not isinstance(job, Job):
        raise InputError(f"job must be a simrecon.Job, found {shown(job)}")
    for name, kind in _PARTS.items():
        if not isinstance(value := getattr(job, name), kind):
            more = _READERS.get(name, "")
            raise InputError(f"Job: {name} must be a {kind.__name__}{more}, found {shown(value)}")
    same = tables.build(Job, _table(job), "Job")
    plan = plans.build(plans.to_dict(same.plan), "Job: plan")
    scene, asked = _scene(same.scene, job.scene), wishes.build(_by_part(same.contacts), "Job: contacts")
    named = replace(plan, name=str(job.plan.name))
    return replace(same, plan=named, planner=job.planned_by, scene=scene, contacts=asked)


def _by_part(asked: tuple[ContactWish, ...]) -> dict[str, Any]:
    """The tables of wishes, of which there is one a part.

    Raises:
        InputError: there are two of one part.
    """
    table = wishes.to_table(asked)
    if len(table) < len(asked):
        raise InputError("Job: contacts: found two wishes of one part; valid: one with all its intervals")
    return table


def checked_threads(threads: Any) -> Any:
    """A number of threads that stands in for the job's; None and functions as they are.

    Raises:
        InputError: it is no such number.
    """
    if threads is None or callable(threads):
        return threads
    return tables.check(tables.keys(Job)["threads"], _plain(threads), "run:")


def _scene(scene: Scene, given: Scene) -> Scene:
    """The scene, of which only its kinds know the types of parameters: they are as they were given."""
    pairs = zip(scene.items, given.items, strict=True)
    items = tuple(replace(item, parameters=_plain(before.parameters)) for item, before in pairs)
    return scene_files.scene(scene_files.tables(replace(scene, items=items)), Path(scene.folder) / "scene")


def _table(value: Any) -> dict[str, Any]:
    """The table of a dataclass, with what is None in it: a field that may not be None is refused."""
    kind: Any = type(value)
    return {name: _plain(getattr(value, name)) for name in tables.keys(kind)}


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return _table(value)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value.tolist() if hasattr(value, "tolist") else value  # of NumPy
