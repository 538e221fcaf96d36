"""What can be opened: a result, evidence or a video, or the folder of a batch."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from simrecon import kinematics, plan, suggesting
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.job import Job, inputs
from simrecon.results import Result, open_result
from simrecon.results.folder import holds_result
from simrecon.scene import suggest
from simrecon.scene.suggest import Suggestion
from simrecon.studio.clip import Clip
from simrecon.types import Evidence, KinematicFit, Scene

FIT_PLAN = "quick"
DEPTH = 3
"""How far below the folder of a batch results are looked for."""


def results_in(folder: Path, depth: int = DEPTH) -> tuple[Path, ...]:
    """The results in a folder, such as that of a batch, by name."""
    found: list[Path] = []
    for path in sorted(path for path in folder.iterdir() if path.is_dir() and path.name[:1] != "."):
        if holds_result(path):
            found.append(path)
        elif depth > 1:
            found += results_in(path, depth - 1)
    return tuple(found)


def check(path: Path) -> None:
    """Refuse what can't be opened, before a server starts.

    Raises:
        InputError: there is no such file, or a folder without results.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file; valid: a result, evidence, a video, or a batch")
    if path.is_dir() and not holds_result(path) and not results_in(path):
        raise InputError(f"{path}: holds no result; valid: a result folder, or one of a batch")


def base_of(path: Path, reading: Job | None = None) -> Result | Job:
    """A result, or the job of reading evidence.

    Args:
        path: of a result folder, evidence, another program's output, or a video.
        reading: how evidence is to be read, with its person.

    Raises:
        InputError: it is none of them.
    """
    if path.is_dir() and holds_result(path):
        return open_result(path)
    return replace(reading or Job("", ""), input=str(path))


def evidence_of(base: Result | Job) -> Evidence:
    """The evidence that a result was made of, or that is opened.

    Raises:
        InputError: it is not there any more, or can't be read; or a retargeted motion never had any.
    """
    job = base.job if isinstance(base, Result) else base
    if job.retarget:
        raise InputError(f"{job.input}: is a motion that was retargeted, which has no evidence of its own")
    return inputs.observe(job)


def fitted(job: Job, seen: Evidence, scene: Scene) -> KinematicFit:
    """Kinematic fit to evidence, as a quick run makes it."""
    shape = inputs.shape_of(job.person)
    return kinematics.fit(resample(seen)[0], scene, plan.read(FIT_PLAN).kinematics, shape)


@dataclass(frozen=True, eq=False)
class Needed:
    """What a motion needs: suggestions, and what has to be said of them."""

    suggestions: tuple[Suggestion, ...]
    warning: str = ""


def needed(base: Result | Job, clip: Clip | None, scene: Scene) -> Needed:
    """Supports that a motion needs and the scene has not, as `simrecon scene suggest`.

    Args:
        base: what was opened.
        clip: its kinematic motion, which is looked at where there is no evidence any more.
        scene: what is known.

    Raises:
        InputError: there is neither evidence nor a motion.
    """
    try:
        seen = evidence_of(base)
    except InputError:
        if clip is None:
            raise
        found = suggest.suggest(clip.body, scene, clip.times_s, clip.asked_qpos)
        return Needed(found)
    job = base.job if isinstance(base, Result) else base
    _, found = suggesting.suggestions(seen, scene, job.person)
    return Needed(found, "" if suggesting.has_size(seen) else suggesting.UNSURE)
