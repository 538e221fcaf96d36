"""Who is in the video of a job, before anybody is reconstructed."""

from __future__ import annotations

from simrecon import evidence as readers
from simrecon.evidence.content import Content, open_content
from simrecon.evidence.video import reader
from simrecon.evidence.video.detection import Look
from simrecon.evidence.video.kept import Detection
from simrecon.job.inputs import Progress, is_video, span
from simrecon.job.options import Reading
from simrecon.job.request import Job

EVERYBODY = "all"
"""As `--person`: everybody in the video, each in a result of their own."""


def asks_for_all(job: Job) -> bool:
    """Whether a job is of everybody in a video."""
    return job.reading.person == EVERYBODY and is_video(job)


def look(content: Content, reading: Reading, progress: Progress | None = None) -> tuple[Detection, Look]:
    """Follow the person that a reading names.

    Returns:
        What was found, and how it was looked for.

    Raises:
        InputError: no weights, no extra, a damaged video, or no such person.
    """
    said = readers.Options(
        person=reading.person,
        person_at=reading.person_at_px,
        model=reading.model,
        fps=reading.fps,
        turn_deg=reading.rotate,
        span=span(reading),
        progress=progress,
    )
    detected, asked, _ = reader.look(content, said)
    return detected, asked


def first(job: Job, progress: Progress | None = None) -> Detection:
    """The person of a job's video as they are followed; the landmarks are kept in the cache for the run.

    Raises:
        InputError: as `look`.
    """
    return look(open_content(job.input), job.reading, progress)[0]
