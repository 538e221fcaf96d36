"""A result as files of other programs: one module for each format, all made of a `Result`.

A format is a name in `results.folder.EXPORTS`, which also has the names of its files, and the module of that
name here, whose `write` makes them. It is imported when it is first used: a format may need packages of its
own.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from simrecon.errors import InputError
from simrecon.exports import view as views
from simrecon.exports.view import ResultView
from simrecon.io import atomic
from simrecon.io.messages import hint
from simrecon.io.paths import usable
from simrecon.results import Result, open_result
from simrecon.results.folder import EXPORT, EXPORTS

FORMATS = tuple(EXPORTS)
RIGGED = ("bvh", "glb", "usd")
"""Formats that name joints as a rig has them."""
SHAPED = ("amass", "smplx")
"""Formats that hold the shape of a body model."""


def writer(name: str) -> Callable[[ResultView], Mapping[str, bytes]]:
    """What makes the files of a format, one of `FORMATS`: their contents by name."""
    write: Callable[[ResultView], Mapping[str, bytes]] = importlib.import_module(
        f"simrecon.exports.{name}"
    ).write
    return write


def export(
    result: Result | Path | str,
    formats: Sequence[str],
    target: Path | str | None = None,
    *,
    rig: str = "simrecon",
    fps: float | None = None,
    of: str = "simulation",
    legs: float = 1.0,
    cutoff_hz: float | None = None,
    body_model: Path | str | None = None,
) -> list[Path]:
    """Write the motion of a result in other formats.

    Args:
        result: an opened result, or its folder.
        formats: names of `FORMATS`.
        target: folder to write to, which is made; `export` in that of the result if None.
        rig: whose joint names BVH, GLB and USD have: `simrecon`, `mixamo`, `lafan1` or `rokoko`.
        fps: frame rate, Hz; that of the result if None.
        of: `simulation`, or `fit` for the kinematic fit.
        legs: length of the rig's legs over that of the person's; feet stay where they stand.
        cutoff_hz: of a zero-lag low-pass filter that motion and forces go through alike, at most
            `metrics.filters.possible_hz` of the frame rate; None: none.
        body_model: where the body model is that the person's shape is of; None: where the job says. Files of
            SMPL's family need it, if there is one.

    Returns:
        The files written.

    Raises:
        InputError: it is no result, there is no such format, an option is none, a format needs a package that
            is not installed, or the folder can't be written.
    """
    for name in formats:
        if name not in EXPORTS:
            found = f"{name}{hint(name, FORMATS)}" if name else "nothing between commas"
            raise InputError(f"--to: found {found}; valid: {', '.join(FORMATS)}")
    if rig != views.RIGS[0] and not set(RIGGED) & set(formats):
        raise InputError(f"--rig: found {rig!r} without a skeleton; valid: with {', '.join(RIGGED)}")
    if body_model is not None and not set(SHAPED) & set(formats):
        raise InputError(f"--body-model: found {body_model}; valid: with {' or '.join(SHAPED)}")
    model = None if body_model is None else str(body_model)
    choices = views.Choices(fps=fps, of=of, rig=rig, legs=legs, cutoff_hz=cutoff_hz, body_model=model)
    opened = result if isinstance(result, Result) else open_result(result)
    view = views.of(opened, choices)
    folder = opened.folder / EXPORT if target is None else usable(target)
    made = {folder / file: content for name in formats for file, content in writer(name)(view).items()}
    for path, content in made.items():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            atomic.write_bytes(path, content)
        except OSError as error:
            raise atomic.cannot_write(path, error) from error
    return list(made)
