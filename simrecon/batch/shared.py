"""What was said of all clips of a batch at once: each clip takes what has a meaning for its own input."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from simrecon.errors import InputError
from simrecon.evidence import applicable, formats
from simrecon.job.text import options

_FIELDS = {"person_at_px": "person_at", "rotate": "turn_deg"}
"""Options of a job that have another name for the readers."""
_BESIDE = {
    "keypoints_person": ("keypoints",),
    "camera_name": ("camera",),
    "size_px": ("fov_deg", "camera", "unknown_camera"),
}
"""Options that have a meaning only beside one of others."""


def without_foreign(values: Mapping[str, Any], shared: Collection[str], path: Path) -> dict[str, Any]:
    """The values of a clip, less those of all clips that have no meaning for its input.

    What was said of this clip alone stays, and is refused when the clip is read.

    Args:
        values: fields of the clip and options of its job, by name.
        shared: names of those that were said of all clips.
        path: the input.
    """
    foreign = {name for name in shared if name in _BESIDE and not any(map(values.get, _BESIDE[name]))}
    if asked := {name for name in shared if _FIELDS.get(name, name) in applicable.FLAGS}:
        taken = _taken([str(path), *filter(None, [values.get("keypoints")])], values.get("format"))
        if "up" in asked and values.get("camera") is not None:
            taken |= {"up"}
        foreign |= {name for name in asked if _FIELDS.get(name, name) not in taken}
    return {name: value for name, value in values.items() if name not in foreign}


def refuse_idle(names: Collection[str], used: Collection[str]) -> None:
    """Refuse options of the command line that no clip has taken.

    Raises:
        InputError: names them.
    """
    flags = [option.flag for option in options() if option.name in names and option.name not in used]
    if flags:
        raise InputError(f"{', '.join(flags)}: has no meaning for any of these inputs; valid: leave it out")


def _taken(paths: list[str], format_name: str | None) -> set[str]:
    """Options that the readers of a clip's files look at; all of them for a file that can't be read."""
    try:
        first = set(applicable.TAKES[formats.format_of(paths[0], format_name)])
        for path in paths[1:]:
            first |= set(applicable.OF_SECOND) & set(applicable.TAKES[formats.format_of(path)])
    except InputError:  # said when its turn comes
        return set(applicable.FLAGS)
    return first
