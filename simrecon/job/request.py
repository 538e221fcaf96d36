"""`Job`: all that a result depends on, as a value."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from simrecon import plan as plans
from simrecon.body import clothed
from simrecon.io import fields, provenance
from simrecon.io.reading import read_text
from simrecon.job.options import Person, Reading, option
from simrecon.plan import Plan
from simrecon.types import ContactWish, Scene, frozen

LARGEST_SEED = 2**63 - 1
MOST_THREADS = 1024
_TAKEN = ("motion.npz", "model.xml")
"""Files of a result that a retargeting reads, beside parts of its report."""


@dataclass(frozen=True)
class Job:
    """What a user asks for; `running.run` does it.

    Attributes:
        input: a video, evidence, another program's output or motion capture; with `retarget` a result.
        output: folder of the result.
        reading: how the input is read, where it doesn't say so itself.
        person: what is known of the person.
        scene: what the person may touch.
        contacts: which parts of the body the user wishes to touch when (`contact.wishes`).
        plan: how the clip is cut and optimised.
        planner: what turns the kinematic fit into the reference; None: that of the plan.
        engine: what optimises the simulation.
        seed: of all random numbers.
        threads: of the simulator, 0 for one per core; no bit depends on it.
        video: what the overlay is drawn on; None: the input if it is a video, else plain ground.
        style: how the person is drawn, `skin` or `primitives`.
        no_report: no `report.html` is made of the result.
        detected: evidence file with the landmarks of a video, which is read instead of detecting them again.
        start: a motion (`motion.npz`) from which the optimisation begins, perhaps of another scene.
        suggest: whether the scene is completed by the supports that the motion needs, before it is simulated.
        retarget: whether the kinematic motion of the result `input` is put on `person`, instead of a fit.
        sha256: of files by absolute path; one that the job reads must have its hash, others are passed over.
    """

    input: str = fields.option(file=True)
    output: str = fields.option(file=True)
    reading: Reading = field(default_factory=Reading)
    person: Person = field(default_factory=Person)
    scene: Scene = field(default_factory=Scene)
    contacts: tuple[ContactWish, ...] = ()
    plan: Plan = field(default_factory=lambda: plans.read("default"))
    planner: str | None = None
    engine: str = "sampling"
    seed: int = option(0, bounds=(0, LARGEST_SEED), metavar="N", text="seed of the random numbers [0]")
    threads: int = option(
        0, bounds=(0, MOST_THREADS), metavar="N", text="threads of the simulator; 0: one per core [0]"
    )
    video: str | None = option(
        None, file=True, metavar="FILE", text="what the overlay is drawn on [plain ground]"
    )
    style: str = option(
        "skin",
        choices=clothed.STYLES,
        text="how overlay and pictures show the person: skin or primitives [skin]",
    )
    no_report: bool = option(False, text="make no report.html of the result")
    detected: str | None = fields.option(None, file=True)
    start: str | None = fields.option(None, file=True)
    suggest: bool = False
    retarget: bool = False
    sha256: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Keep a copy of the hashes that nobody changes."""
        object.__setattr__(self, "sha256", frozen(self.sha256))

    @property
    def planned_by(self) -> str:
        """Name of the planner."""
        return self.plan.planner if self.planner is None else self.planner


def files(job: Job) -> dict[str, str]:
    """Paths of the files that a job reads, by what they are to it."""
    named = {
        "input": job.input,
        "keypoints": job.reading.keypoints,
        "camera": job.reading.camera,
        "body_model": job.person.body_model,
        "detected": job.detected,
        "start": job.start,
        "video": job.video,
    }
    known = {name: path for name, path in named.items() if path}
    return known | {f"mesh {i}": str(path) for i, path in enumerate(_meshes(job.scene), 1)}


def contents(job: Job) -> dict[str, str]:
    """SHA-256 of the files that a job reads, by what they are to it; a file that is missing has none."""
    paths = {name: Path(path) for name, path in files(job).items()}
    return {name: _digest(job, name, path) for name, path in paths.items() if path.exists()}


def hashes(job: Job) -> dict[str, str]:
    """SHA-256 of the files that a job reads, as they are now, by absolute path."""
    paths = files(job)
    return {_place(paths[name]): digest for name, digest in contents(job).items()}


def changed(job: Job) -> tuple[str, ...]:
    """Paths of the files whose hash the job knows and which are missing or no longer the same."""
    known = {name: path for name, path in files(job).items() if _place(path) in job.sha256}
    return tuple(path for name, path in known.items() if job.sha256[_place(path)] != _now(job, name, path))


def known_digest(job: Job, name: str) -> str | None:
    """SHA-256 that one of the files had when the job was made; None if the job doesn't know it."""
    path = files(job).get(name)
    return None if path is None else job.sha256.get(_place(path))


def moved(job: Job, name: str, path: str) -> Job:
    """The job with one of its own files in another place, where its hash must be the same."""
    known = dict(job.sha256)
    before = getattr(job, name)
    if before is not None and (digest := known.pop(_place(before), None)) is not None:
        known[_place(path)] = digest
    changes: dict[str, Any] = {name: path}
    return replace(job, sha256=known, **changes)


def taken_anew(job: Job, names: Iterable[str]) -> Job:
    """The job without the hashes of some of its files, which may be others than they were."""
    places = {_place(path) for name, path in files(job).items() if name in names}
    return replace(job, sha256={path: digest for path, digest in job.sha256.items() if path not in places})


def detected_by(job: Job) -> Reading:
    """What the landmarks that are kept of a video depend on."""
    return replace(job.reading, ignore=(), trust=None)


def meshes_of(job: Job) -> tuple[str, ...]:
    """What `files` calls the meshes of the scene."""
    return tuple(name for name in files(job) if name.startswith("mesh "))


def _place(path: str) -> str:
    return str(Path(path).resolve())


def _now(job: Job, name: str, path: str) -> str | None:
    return _digest(job, name, Path(path)) if Path(path).exists() else None


def _digest(job: Job, name: str, path: Path) -> str:
    if name == "input" and job.retarget and path.is_dir():
        return _retargeted(path)
    return provenance.file_digest(path)


def _retargeted(result: Path) -> str:
    """Hash of what a retargeting takes from a result; the scene is the job's own.

    What else is written there later, such as an exported motion, makes no difference.
    """
    content = [provenance.file_digest(path) for name in _TAKEN if (path := result / name).is_file()]
    try:
        report = json.loads(read_text(result / "report.json"))
        said = [report["person"]["height_m"], report.get("frames", {}).get("interpolated_frames", [])]
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):  # refused later
        said = []
    return provenance.digest_of([content, said])


def _meshes(scene: Scene) -> list[Path]:
    """Files that items of the scene name."""
    words = [value for item in scene.items for value in item.parameters.values() if isinstance(value, str)]
    paths = [Path(scene.folder) / word for word in words]
    return [path for path in paths if path.is_file()]
