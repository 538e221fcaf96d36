"""The input of commands that read evidence without a run, with the options by which `run` would read it."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from simrecon.cli import options
from simrecon.cli.stages import Stages
from simrecon.errors import InputError, printable
from simrecon.job import Job, inputs, request
from simrecon.job.text import options as job_options
from simrecon.job.text import with_options
from simrecon.results import folder, open_result
from simrecon.types import Evidence

READING = ("reading",)
READING_AND_PERSON = ("reading", "person")


def add(
    parser: argparse.ArgumentParser,
    sections: tuple[str, ...] = READING_AND_PERSON,
    without: tuple[str, ...] = (),
) -> None:
    """Add the options by which evidence is read; what is not given is None.

    Args:
        parser: of a command.
        sections: of the options of a job that the command has.
        without: names of options in them that it does not have.
    """
    options.add(parser, sections=sections, without=without)
    parser.add_argument("--video", metavar="FILE", help="of the input: for its frame rate and image size")


def job(parsed: argparse.Namespace, path: str | None) -> Job:
    """The job of reading an input, with what was said of it and of the person.

    Raises:
        InputError: there is no input for the options that were given.
    """
    given = options.given(parsed)
    if path is None:
        flags = [option.flag for option in job_options() if option.name in given and option.section]
        if flags or parsed.video is not None:
            raise InputError(f"{', '.join(flags or ['--video'])}: found no EVIDENCE for it; valid: name one")
        return Job("", "")
    own = {option.name for option in job_options() if option.section or option.name == "video"}
    before = _of_result(path) if folder.holds_result(Path(path)) else Job(path, "")
    asked = with_options(before, {name: value for name, value in given.items() if name in own})
    if request.detected_by(before) != request.detected_by(asked):
        asked = replace(asked, detected=None)
    return asked


def _of_result(path: str) -> Job:
    """The job of reading what a result was made from, with the landmarks that are kept of a video.

    Raises:
        InputError: there is no such evidence any more, or it never had any.
    """
    job = open_result(path).job
    source = job.detected or job.input
    if job.retarget:
        raise InputError(f"{path}: found a motion that was retargeted; valid: the result that it is of")
    if not Path(source).exists():
        raise InputError(f"{source}: is not there, from which {path} was made; valid: its place of now")
    return Job(job.input, "", job.reading, job.person, video=job.video, detected=job.detected)


def observe(asked: Job) -> Evidence:
    """Read the evidence, and say on stderr how it was read.

    Raises:
        InputError: it can't be read that way.
    """
    with Stages() as stages:
        seen = inputs.observe(asked, lambda done, total: stages.stage("landmarks", done, total))
    for line in seen.reading.splitlines():
        print(f"read as {printable(line)}", file=sys.stderr)
    return seen
