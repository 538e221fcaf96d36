"""`report.html` of a result: template, style, scripts and three.js, with what the result holds."""

from __future__ import annotations

import base64
import html
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import __version__, resources
from simrecon.errors import printable
from simrecon.exports import glb, scenery
from simrecon.exports.gltf import Document
from simrecon.io import atomic
from simrecon.results import Result, report_file
from simrecon.results.folder import PAGE
from simrecon.types import Array, IntArray, Primitive
from simrecon.viewer import curves, quality, seen, stills, tables

FRAMES_MAX = 1500
"""More than these are thinned out, which keeps a page below 5 MB."""
SCRIPTS = ("three.min.js", "scene.js", "charts.js", "page.js")
FIT, GHOST = "fit", "ghost"


@dataclass(frozen=True, eq=False)
class Ghosts:
    """Other motions of the person that a page shows, such as what may follow.

    Attributes:
        times_s: (F,) from the first frame of the result's motion on.
        qpos: (S, F, nq) configurations.
    """

    times_s: Array
    qpos: Array


_MARK = re.compile(r"<!--([A-Z]+)-->")


def add(result: Result) -> str | None:
    """Write the page of a result into its folder; what kept it from being made, or None."""
    try:
        write(result)
    except Exception as error:
        return " ".join(f"{error}".split()) or type(error).__name__
    return None


def write(result: Result) -> Path:
    """Write the page of a result into its folder.

    Raises:
        InputError: the result can't be read, or the page not written.
    """
    path, text = result.folder / PAGE, render(result)
    try:
        atomic.write_text(path, text)
    except OSError as error:
        raise atomic.cannot_write(path, error) from error
    return path


def render(result: Result, *, alone: bool = False, ghosts: Ghosts | None = None) -> str:
    """The page as text; `alone` where the other files of the result are not beside it."""
    folder = resources.folder("viewer")
    rows = frames(len(result.motion.times_s))
    values = {
        "TITLE": html.escape(printable(result.folder.resolve().name)),
        "STYLE": (folder / "page.css").read_text(encoding="utf-8"),
        "LICENCE": html.escape((folder / "three.LICENSE.txt").read_text(encoding="utf-8")),
        "DATA": data(result, rows, ({"video": None} if alone else {}) | _told(ghosts)),
        "MODEL": base64.b64encode(model(result, rows, ghosts)).decode(),
        "SCRIPTS": "\n".join(
            f"<script>{(folder / name).read_text(encoding='utf-8')}</script>" for name in SCRIPTS
        ),
    }
    template = (folder / "page.html").read_text(encoding="utf-8")
    return _MARK.sub(lambda mark: values.get(mark[1], mark[0]), template)


def data(result: Result, rows: IntArray, more: dict[str, Any]) -> str:
    """`content` of a result, and more, as it stands in the page.

    Raises:
        InputError: its report holds values of another kind than one of ours.
    """
    with report_file.understood(result.folder):
        return embedded(content(result, rows) | more)


def frames(count: int) -> IntArray:
    """Which of so many frames of a motion are shown: all, or each n-th and the last."""
    step = -(-count // FRAMES_MAX)
    return np.unique(np.append(np.arange(0, count, step), count - 1))


def content(result: Result, rows: IntArray) -> dict[str, Any]:
    """What the scripts are told, beside the model.

    Args:
        result: opened.
        rows: (F,) frames of the motion that are shown.
    """
    report, motion = result.report, result.motion
    return {
        "name": printable(result.folder.resolve().name),
        "version": __version__,
        "began_s": round(float(motion.times_s[0]), 4),
        "frame_count": len(motion.times_s),
        "verdict": report.get("verdict"),
        "curves": curves.make(result, rows),
        "seconds": quality.seconds(result),
        "camera": seen.make(report, rows, len(motion.times_s)),
        "stills": stills.make(result.folder, rows),
        "video": stills.VIDEO if (result.folder / stills.VIDEO).is_file() else None,
        "primitives": [_primitive(part) for part in result.body.primitives],
        "highlights": tables.highlights(report),
        "tables": tables.make(report),
        "fit": motion.kinematic_qpos is not None,
    }


def _told(ghosts: Ghosts | None) -> dict[str, Any]:
    """What the scripts are told of ghosts."""
    if ghosts is None:
        return {}
    begin, end = (round(float(ghosts.times_s[row]), 4) for row in (0, -1))
    return {"ghosts": {"from_s": begin, "to_s": end, "count": len(ghosts.qpos)}}


def _primitive(part: Primitive) -> dict[str, Any]:
    return {
        "name": part.name,
        "segment": part.segment,
        "kind": part.kind,
        "points_m": curves.rounded(part.points_m, 4),
        "size_m": curves.rounded(part.size_m, 4),
    }


def model(result: Result, rows: IntArray, ghosts: Ghosts | None = None) -> bytes:
    """The person with the clips `motion`, `fit` where it is known, `ghost 0`, …, and the scene, as GLB."""
    document, motion = Document(f"simrecon {__version__}"), result.motion
    joints = glb.add_person(document, result.body)
    times_s = motion.times_s[rows]
    clip = glb.add_clip(document, glb.MOTION, times_s, motion.qpos[rows], result.body, joints)
    scenery.add(document, result, motion.qpos[rows], clip)
    if motion.kinematic_qpos is not None:
        glb.add_clip(document, FIT, times_s, motion.kinematic_qpos[rows], result.body, joints)
    if ghosts is not None:
        for row, qpos in enumerate(ghosts.qpos):
            glb.add_clip(document, f"{GHOST} {row}", ghosts.times_s, qpos, result.body, joints)
    return document.binary()


def embedded(value: Any) -> str:
    """JSON that can stand in a script of a page, whatever its texts hold."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
