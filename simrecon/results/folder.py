"""The result folder (`simrecon.result/1`): which files it holds, and whether one may be written."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Collection
from pathlib import Path

from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.io.atomic import cannot_write
from simrecon.io.paths import usable
from simrecon.io.reading import read_text

SCHEMA = "simrecon.result/1"
MOTION, MODEL, SCENE, REPORT, JOB = "motion.npz", "model.xml", "scene.toml", "report.json", "job.toml"
CONTACTS = "contacts.toml"
"""What the user wished of the contacts, where that was anything."""
START = "start.npz"
"""The motion that the optimisation began from, where there was one."""
PAGE = "report.html"
"""All of a result, to be looked at in a browser."""
OVERLAYS = ("overlay.mp4", "overlay.png")
EXPORT = "export"
"""The folder in a result that holds its motion in other formats."""
EXPORTS = {
    "bvh": ("motion.bvh",),
    "glb": ("motion.glb",),
    "trc": ("motion.trc",),
    "mot": ("forces.mot", "forces.xml"),
    "c3d": ("motion.c3d",),
    "amass": ("amass.npz",),
    "smplx": ("smplx.npz",),
    "protomotions": ("protomotions.motion",),
    "holosoma": ("holosoma.npz",),
    "locomujoco": ("locomujoco.npz", "locomujoco.xml"),
    "mjcf": ("hinges.npz", "hinges.xml"),
    "csv": ("motion.csv", "forces.csv", "moments.csv"),
    "usd": ("motion.usd",),
}
"""Formats of `simrecon.exports`, and the files of each in `EXPORT`."""
EXPORTED = frozenset(name for names in EXPORTS.values() for name in names)
EARLIER = ("motion.bvh", "motion.trc")
"""Exports beside the motion, where earlier versions wrote them."""
FILES = (MOTION, MODEL, SCENE, CONTACTS, REPORT, JOB, START, PAGE, *OVERLAYS, *EARLIER)
"""All that a result folder may hold beside `EXPORT`: only a folder of these is ever replaced."""


def check_writable(folder: Path | str) -> None:
    """Check, before any long work, that a result can be written; leaves nothing behind.

    Args:
        folder: of the result, which may be missing, empty, or an earlier result.

    Raises:
        InputError: it is a file, holds what is no result, or can't be made.
    """
    target = usable(folder).resolve()
    try:
        if target.exists():
            _check_replaceable(folder, target)
        parent = target.parent
        while not parent.exists():
            parent = parent.parent
        with tempfile.TemporaryFile(dir=parent):  # which has no name where the system can do that
            pass
    except OSError as error:
        raise cannot_write(folder, error) from error


def _check_replaceable(folder: Path | str, target: Path) -> None:
    """Refuse a target that is no folder, or holds anything that simrecon did not write there."""
    if not target.is_dir():
        raise InputError(f"{folder}: found a file; valid: a folder for the result")
    if os.path.ismount(target):
        raise InputError(f"{folder}: found a mount point, which cannot be renamed; valid: a folder inside it")
    if Path.cwd().is_relative_to(target):
        raise InputError(
            f"{folder}: found the folder that this runs in, which the result would replace; "
            f"valid: another folder"
        )
    inside, foreign = _inside(target)
    if foreign or (inside and REPORT not in inside):
        found = foreign[0] if foreign else f"no {REPORT}"
        raise InputError(
            f"{folder}: found a folder that holds {found}; "
            f"valid: a new or empty folder, or an earlier result with nothing added"
        )
    if inside and not _is_result(target):
        raise InputError(
            f"{folder}: found a {REPORT} that is not simrecon's; "
            f"valid: a new or empty folder, or an earlier result"
        )


def is_plain(folder: Path) -> bool:
    """Whether a folder is empty, or holds a result and nothing else."""
    inside, foreign = _inside(folder)
    return not foreign and (not inside or (REPORT in inside and _is_result(folder)))


def _inside(folder: Path) -> tuple[list[str], list[str]]:
    """Names in a folder, and those of them that are no file of a result."""
    entries = sorted(folder.iterdir())
    foreign = []
    for path in entries:
        if path.name == EXPORT and path.is_dir() and not path.is_symlink():
            names = sorted(os.listdir(path))
            foreign += [f"{EXPORT}/{name}" for name in names if not _is_ours(name, EXPORTED)]
        elif not _is_ours(path.name, FILES) or path.is_dir():
            foreign.append(f"{path.name}/" if path.is_dir() else path.name)
    return [path.name for path in entries], foreign


def _is_ours(name: str, ours: Collection[str]) -> bool:
    """Whether a file is one of ours, or what a killed process left of one."""
    return name in ours or atomic.partial_of(name) in ours


def holds_result(path: Path) -> bool:
    """Whether a folder has the files without which it is no result; what is in them is not looked at."""
    return (path / MOTION).is_file() and (path / REPORT).is_file()


def person(number: int) -> str:
    """Name of the folder with the result of one of several people."""
    return f"person{number}"


def people(path: Path) -> tuple[Path, ...]:
    """Folders of the results of several people in a folder, by number; none where it holds no such."""
    found = [one for one in path.glob("person*") if one.name[6:].isdecimal() and holds_result(one)]
    return tuple(sorted(found, key=lambda one: int(one.name[6:])))


def _is_result(target: Path) -> bool:
    try:
        report = json.loads(read_text(target / REPORT))
    except (OSError, ValueError, RecursionError):  # not UTF-8, or not JSON
        return False
    return isinstance(report, dict) and str(report.get("schema", "")).startswith("simrecon.result/")
