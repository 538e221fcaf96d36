"""`simrecon look`: who is in a video, and how well the person is followed, before anything is optimised."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from simrecon.cli import arguments, options
from simrecon.cli.commands import purpose
from simrecon.cli.stages import Stages
from simrecon.drawing import looked, video
from simrecon.errors import InputError, printable
from simrecon.evidence.content import open_content
from simrecon.evidence.video import survey
from simrecon.evidence.video.kept import Detection
from simrecon.io.messages import counted, spans
from simrecon.job import Job, looking
from simrecon.job.text import options as job_options
from simrecon.job.text import with_options

OPTIONS = ("person", "person_at_px", "model", "from_s", "to_s", "every", "fps", "rotate")
"""Of a reading, those that say how a video is looked at."""


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    look = arguments.command(commands, "look", _look, purpose("look"))
    look.add_argument("input", metavar="VIDEO", help="the video")
    look.add_argument("-o", dest="output", metavar="PNG", help="sheet [the video's name, .png, beside it]")
    others = [option.name for option in job_options() if option.name not in OPTIONS]
    options.add(look, sections=("reading",), without=tuple(others))


def _look(parsed: argparse.Namespace) -> int:
    path = Path(parsed.input)
    content = open_content(path)
    if content.kind != "video":
        raise content.fail("content", content.kind, "a video")
    target = Path(parsed.output or path.with_suffix(".png"))
    if target.suffix.lower() != ".png":
        raise InputError(f"{target}: is no .png; valid: a name that ends in .png")
    reading = with_options(Job(parsed.input, ""), options.given(parsed)).reading
    with Stages() as stages:
        detected, asked = looking.look(
            content, reading, lambda done, total: stages.stage("landmarks", done, total)
        )
    video.write_image(target, looked.sheet(path, detected, asked))
    for name, words in _facts(detected):
        print(f"{name:<9}{printable(words)}")
    print(f"{'written':<9}{printable(str(target))}")
    return 0


def _facts(detected: Detection) -> list[tuple[str, str]]:
    known = survey.described(detected.sightings, len(detected.looked))
    seen, count = int(detected.seen.sum()), len(detected.rows)
    rows = [
        ("people", known or "none in the frames that were looked at"),
        ("followed", str(detected.chosen + 1) if detected.chosen >= 0 else "somebody else"),
        ("seen", f"in {seen} of {counted(count, 'frame')}, lost {counted(detected.losses, 'time')}"),
    ]
    if seen < count:
        rows.append(("lost", spans(detected.rows[~detected.seen].tolist())))
    return rows
