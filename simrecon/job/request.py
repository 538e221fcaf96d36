"""`Job`: all that a result depends on, as a value."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from pathlib import Path

from simrecon import plan as plans
from simrecon.io import provenance
from simrecon.job.options import Person, Reading, option
from simrecon.plan import Plan
from simrecon.types import Scene

LARGEST_SEED = 2**63 - 1
MOST_THREADS = 1024
_TAKEN = ("motion.npz", "model.xml")
"""Files of a result that a retargeting reads, beside parts of its report."""


@dataclass(frozen=True)
class Hashes:
    """`[sha256]`: of the files that a job reads, empty where it reads none or they are not known yet."""

    input: str = ""
    keypoints: str = ""
    camera: str = ""
    body_model: str = ""
    detected: str = ""
    start: str = ""
    meshes: str = ""


@dataclass(frozen=True)
class Job:
    """What a user asks for; `running.run` does it.

    Attributes:
        input: a video, evidence, another program's output or motion capture; with `retarget` a result.
        output: folder of the result.
        reading: how the input is read, where it doesn't say so itself.
        person: what is known of the person.
        scene: what the person may touch.
        plan: how the clip is cut and optimised.
        planner: what turns the kinematic fit into the reference.
        engine: what optimises the simulation.
        seed: of all random numbers.
        threads: of the simulator, 0 for one per core; no bit depends on it.
        video: what the overlay is drawn on; None: the input if it is a video, else plain ground.
        detected: evidence file with the landmarks of a video, which is read instead of detecting them again.
        start: a motion (`motion.npz`) from which the optimisation begins, perhaps of another scene.
        estimated: what of `person` an earlier run estimated, and nobody says: `height_m`, `mass_kg`.
        retarget: whether the kinematic motion of the result `input` is put on `person`, instead of a fit.
        sha256: of the files; those that are given must agree.
    """

    input: str
    output: str
    reading: Reading = field(default_factory=Reading)
    person: Person = field(default_factory=Person)
    scene: Scene = field(default_factory=Scene)
    plan: Plan = field(default_factory=lambda: plans.read("default"))
    planner: str = "none"
    engine: str = "sampling"
    seed: int = option(0, bounds=(0, LARGEST_SEED), metavar="N", text="seed of the random numbers [0]")
    threads: int = option(
        0, bounds=(0, MOST_THREADS), metavar="N", text="threads of the simulator; 0: one per core [0]"
    )
    video: str | None = option(
        None, file=True, metavar="FILE", text="what the overlay is drawn on [plain ground]"
    )
    detected: str | None = None
    start: str | None = None
    estimated: tuple[str, ...] = ()
    retarget: bool = False
    sha256: Hashes = field(default_factory=Hashes)


def hashes(job: Job) -> Hashes:
    """SHA-256 of the files that a job reads, as they are now; a file that is missing has none."""
    files = {
        "input": job.input,
        "keypoints": job.reading.keypoints,
        "camera": job.reading.camera,
        "body_model": job.person.body_model,
        "detected": job.detected,
        "start": job.start,
    }
    known = {name: provenance.file_digest(Path(path)) for name, path in files.items() if path and _is(path)}
    if job.retarget and Path(job.input).is_dir():
        known["input"] = _retargeted(Path(job.input))
    if meshes := _meshes(job.scene):
        known["meshes"] = provenance.digest_of([provenance.file_digest(path) for path in meshes])
    return Hashes(**known)


def changed(job: Job) -> tuple[str, ...]:
    """Names of the files whose hash the job knows and which are missing or no longer the same."""
    now = hashes(job)
    names = (item.name for item in fields(Hashes))
    return tuple(name for name in names if getattr(job.sha256, name) not in ("", getattr(now, name)))


def _is(path: str) -> bool:
    return Path(path).exists()


def _retargeted(result: Path) -> str:
    """Hash of what a retargeting takes from a result; the scene is the job's own.

    What else is written there later, such as an exported motion, makes no difference.
    """
    content = [provenance.file_digest(path) for name in _TAKEN if (path := result / name).is_file()]
    try:
        report = json.loads((result / "report.json").read_text(encoding="utf-8"))
        said = [report["person"]["height_m"], report.get("frames", {}).get("interpolated_frames", [])]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):  # refused when it is read
        said = []
    return provenance.digest_of([content, said])


def _meshes(scene: Scene) -> list[Path]:
    """Files that items of the scene name."""
    words = [value for item in scene.items for value in item.parameters.values() if isinstance(value, str)]
    paths = [Path(scene.folder) / word for word in words]
    return [path for path in paths if path.is_file()]
