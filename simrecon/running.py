"""The front door: `run` does what a job asks for; command line, batch, bench and programs all call it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from simrecon import body as bodies
from simrecon import engines, kinematics, planners, results, softfloor, suggesting, viewer
from simrecon import evidence as readers
from simrecon import job as jobs
from simrecon.body import ShapeRequest, known, mass
from simrecon.contact import wishes
from simrecon.drawing import overlay, video
from simrecon.engines import checkpoint as checkpoints
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading, ahead, checking, inputs, looking, request, text
from simrecon.kinematics import retargeting
from simrecon.observer import SILENT, Observer
from simrecon.pipeline import Reconstruction, Setup, reconstruct
from simrecon.results import kinematic
from simrecon.results.view import Result
from simrecon.sim.quiet import unwarned
from simrecon.sim.rollout import Threads
from simrecon.softfloor import Calibration, Simulate
from simrecon.system import blas
from simrecon.types import Body, Evidence, KinematicFit, Motion, Scene

NOT_DRAWN_ON = (
    "no video is drawn on, for nothing says where the camera stands: the picture is over plain ground"
)


def run(
    job: Job,
    observer: Observer = SILENT,
    *,
    checkpoint: checkpoints.Store | None = None,
    threads: Threads | None = None,
    overwrite: bool = False,
    keep: bool = True,
) -> Result:
    """Run a job, and write the result folder.

    Everything that may be wrong is checked before the long work begins.

    Args:
        job: what to do.
        observer: is told of the progress, and may stop the run.
        checkpoint: where solved windows are kept, and taken from; None: nowhere.
        threads: of the simulator, instead of the job's; a function is called before each generation.
        overwrite: replace an earlier result even if it is better than this one.
        keep: leave what can be replayed beside the folder, if that can't be written to its end.

    Returns:
        The result, read back from its folder: that of the job, or one beside it if that held a better one.

    Raises:
        InputError: something that the job names can't be used; nothing was written.
        SimreconError: the job failed.
    """
    job, threads = jobs.checked(job), checking.checked_threads(threads)
    check(job)
    with unwarned(), blas.one_thread(), tempfile.TemporaryDirectory(prefix="simrecon-") as scratch:
        sources = _sources(job, observer, Path(scratch))
        job = suggesting.completed(sources.job, sources.evidence, observer)
        job = replace(job, sha256=request.hashes(job))
        setup = Setup(
            planner=job.planned_by,
            engine=job.engine,
            seed=job.seed,
            threads=job.threads if threads is None else threads,
            shape=sources.shape,
            contacts=job.contacts,
            fit=sources.fit,
            observer=observer,
            checkpoint=checkpoint,
            identity=jobs.identity(job),
        )

        def simulate(scene: Scene, start: Motion | None) -> Reconstruction:
            return reconstruct(sources.evidence, scene, job.plan, replace(setup, start=start))

        scene, start, calibration = _calibrated(job, sources, simulate, observer)
        reconstruction = simulate(scene, start)
        result = results.write(
            job, reconstruction, calibration, landmarks=sources.landmarks, overwrite=overwrite, keep=keep
        )
        return result if job.no_report else _with_page(result)


def _with_page(result: Result) -> Result:
    """The result with its page, or with what kept it from being made in its report."""
    missing = viewer.add(result)
    if missing is not None:
        results.note(result.folder, page=missing)
    return results.open_result(result.folder)


@dataclass(frozen=True, eq=False)
class _Sources:
    """What a job begins with: it may have landmarks of its video by now, in a file of their own."""

    job: Job
    evidence: Evidence
    shape: ShapeRequest | None = None
    fit: KinematicFit | None = None
    landmarks: Path | None = None


def check(job: Job) -> None:
    """Check all that can be known to be wrong before a video is looked at, which may take hours.

    Raises:
        InputError: names it.
    """
    if looking.asks_for_all(job):
        raise InputError(
            f"{job.input}: found all for a person, which makes several results; "
            f"valid: `simrecon run`, simrecon.run_people, or the number of one"
        )
    planners.check(job.planned_by)
    engines.check(job.engine)
    if job.scene.ground.calibrate and not engines.simulates(job.engine):
        raise InputError(
            f'engine {job.engine}: found [ground] stiffness_Npm = "fit", which only simulations find; '
            "valid: engine sampling, or a stiffness and damping in numbers"
        )
    _check_files(job)
    results.check_writable(job.output)
    if not job.retarget:
        ahead.check(job)
    if job.video is not None:
        video.check_video(job.video, np.zeros(1))
    if job.start is not None:
        results.read_motion(job.start)


def _check_files(job: Job) -> None:
    source = job.detected or job.input
    for path in (source, *request.files(job).values()):
        if not Path(path).exists():
            raise InputError(f"{path}: cannot be read (there is no such file); give an existing file")
    if job.retarget:
        _check_retargeting(job)
    if paths := request.changed(job):
        raise InputError(
            f"{paths[0]}: its sha256 is not the one that the job was made with; "
            f"valid: the same file, or a new run"
        )


def _check_retargeting(job: Job) -> None:
    if Path(job.input).resolve() == Path(job.output).resolve():
        raise InputError(f"{job.output}: is the result that is retargeted; valid: another folder")
    if job.suggest:
        raise InputError(f"{job.input}: found suggest for a result that is retargeted; valid: false")
    if job.contacts:
        raise InputError(
            f"{job.input}: found contacts for a result that is retargeted; "
            f"valid: rerun it with --contacts, then retarget that"
        )
    usual = Reading()
    said = [
        option.flag
        for option in text.options()
        if option.section == "reading" and getattr(job.reading, option.name) != getattr(usual, option.name)
    ]
    if said:
        found = ", ".join(said)
        raise InputError(f"{job.input}: found {found} for a result that is retargeted; valid: leave it out")


def _sources(job: Job, observer: Observer, scratch: Path) -> _Sources:
    """Evidence, shape and, for a retargeting, the motion on the other body."""
    if job.retarget:
        return _retargeted(job, observer)
    shown, shape = inputs.background(job), inputs.shape_of(job.person)
    seen = inputs.seen(job, partial(observer.stage, f"landmarks of {Path(job.input).name}"))
    for row, line in enumerate(seen.reading.splitlines()):
        observer.note(line if row else f"read as {line}")
    landmarks = None
    if job.detected is None and inputs.is_video(job):
        landmarks = scratch / "evidence.npz"
        job, seen = _kept(job, seen, landmarks)
    seen = inputs.told(job, seen)
    wishes.check_times(job.contacts, seen.times_s)
    if shown is not None:
        overlay.check_video(shown, seen, job.reading.rotate or 0)
        if not overlay.is_placed(seen):
            observer.note(NOT_DRAWN_ON)
    return _Sources(job, seen, shape, landmarks=landmarks)


def _kept(job: Job, seen: Evidence, path: Path) -> tuple[Job, Evidence]:
    """A video's evidence as a file, from which the run goes on, so that a rerun begins with the same bits.

    It holds what was seen, not what the job says of it: a rerun may say something else.
    """
    readers.write(path, seen)
    return replace(job, detected=str(path)), replace(readers.read(path), reading=seen.reading)


def _retargeted(job: Job, observer: Observer) -> _Sources:
    """The kinematic motion of a result on another body."""
    bare, before = kinematic.read(job.input)
    before, body = replace(before, scene=job.scene), _other_body(job.person, before.body)
    observer.stage("retargeting", 0.0, 1.0)
    fit = kinematics.retarget(before, body, job.plan.kinematics)
    observer.stage("retargeting", 1.0, 1.0)
    scale = retargeting.scale_of(before, body)
    bare = replace(bare, reading=f"{bare.reading}, scaled by {scale:.4g} to another body")
    return _Sources(job, bare, None, fit)


def _other_body(person: Person, before: Body) -> Body:
    """The other body: of betas, or the one before with what is to be changed.

    A distribution of mass comes with the mass of the character that it was made for.
    """
    mass_kg, distribution = person.mass_kg, person.mass_distribution
    if mass_kg is None and distribution is not None:
        mass_kg = mass.distribution(distribution).mass_kg
    if person.betas is None and person.body_model is None:
        return known.changed(before, height_m=person.height_m, mass_kg=mass_kg, distribution=distribution)
    space = inputs.space_of(person)
    betas = np.zeros(space.size) if person.betas is None else inputs.betas_of(person, space)
    return bodies.build(
        betas=betas,
        height_m=person.height_m,
        mass_kg=mass_kg,
        shapes=space,
        distribution=distribution or "standard",
    )


def _calibrated(
    job: Job, sources: _Sources, simulate: Simulate, observer: Observer
) -> tuple[Scene, Motion | None, Calibration | None]:
    """The scene with a known floor, and the motion to begin from."""
    if not job.scene.ground.calibrate:
        return job.scene, None if job.start is None else results.read_motion(job.start), None
    calibration = softfloor.calibrate(simulate, job.scene, sources.evidence.mass_kg, observer)
    return replace(job.scene, ground=calibration.ground), calibration.motion, calibration
