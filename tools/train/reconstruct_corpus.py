"""Make the corpus that the synthesis learns from (Xie 2021, section 4.3): truth, fit and simulation.

usage: python -m tools.train.reconstruct_corpus --data DATA -o FOLDER [--seconds 8] [--jobs N] [--seed 0]
                                                 (needs the extra [batch]; about one night on two cores)

Every motion of DATA/mocap that `synthesis_split.toml` beside this file names is put on simrecon's body, cut
to its first seconds, seen by a virtual camera with a pose network's errors (`synthesis_views`), and
reconstructed by the batch with the plan `quick`: first those that are trained on, then the tests. What is
there is kept, so the same command goes on where it was stopped.

    FOLDER/truth/NAME.npz      the motion: qpos, joints, height and mass of the person
    FOLDER/evidence/NAME.npz   what the camera saw
    FOLDER/results/NAME/       the reconstruction
    FOLDER/clips/NAME.npz      joints of all three side by side (`synthesis_corpus`)
    FOLDER/corpus.json         how far fit and simulation are from the truth, clip by clip
"""

from __future__ import annotations

import argparse
import os
import sys
import tarfile
import zlib
from pathlib import Path

import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.batch import ahead, clips, runner
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.types import Evidence, KinematicFit, Scene
from tools.train import contact_motions, synthesis_corpus, synthesis_views

ARCHIVE = "cmu_asf_amc_bvh.tar.xz"
PLAN = "quick"
PARTS = ("train", "test")


def main() -> None:
    """Make what is not there yet."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=8.0, help="of each motion [%(default)s]")
    parser.add_argument("--jobs", type=int, default=0, help="clips at once; 0: one per core")
    parser.add_argument("--seed", type=int, default=0, help="of cameras and errors")
    options = parser.parse_args()
    try:
        make_views(options.data / "mocap", options.folder, options.seconds, options.seed)
        for part in PARTS:
            reconstruct(options.folder, part, options.jobs)
            print(synthesis_corpus.join(options.folder), flush=True)
    except InputError as error:
        sys.exit(str(error))


def make_views(mocap: Path, folder: Path, seconds: float, seed: int) -> None:
    """Truth and evidence of each motion of the split that is not there yet.

    Args:
        mocap: the recordings.
        folder: of the corpus.
        seconds: of each motion, from its begin.
        seed: of cameras and errors; each motion draws from its own, so that none depends on the others.

    Raises:
        InputError: the recordings are not there, or there is none of a name of the split.
    """
    names = synthesis_corpus.split().names
    missing = [name for name in names if not _files(folder, name)[1].is_file()]
    if not missing:
        return
    for kind in ("truth", "evidence"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    found = set()
    for name, motion in contact_motions.recordings(mocap, _unpacked(mocap, folder)):
        found.add(name)
        if name in missing:
            _view(folder, name, _fitted(motion, seconds), seed)
            print(f"{name}: seen", flush=True)
    if unknown := sorted(set(names) - found):
        raise InputError(
            f"{synthesis_corpus.SPLIT}: found {', '.join(unknown)}, of which {mocap} has no file"
        )


def _unpacked(mocap: Path, folder: Path) -> Path:
    """The folder of the CMU recordings, unpacked once."""
    target = folder / "cmu"
    if not target.is_dir():
        if not (mocap / ARCHIVE).is_file():
            raise InputError(f"{mocap / ARCHIVE}: cannot be read (there is no such file)")
        with tarfile.open(mocap / ARCHIVE) as archive:
            archive.extractall(folder / "cmu.part", filter="data")
        (folder / "cmu.part").rename(target)
    return target


def _fitted(motion: Evidence | KinematicFit, seconds: float) -> KinematicFit:
    """The first seconds of a recording on simrecon's body, over a floor at z = 0."""
    if isinstance(motion, KinematicFit):
        return motion
    part = readers.within(motion, readers.Span(None, motion.times_s[0] + seconds), "recording")
    fit = kinematics.fit(readers.resample(part)[0], Scene(), plans.read(PLAN).kinematics)
    return synthesis_views.on_floor(fit)


def _view(folder: Path, name: str, fit: KinematicFit, seed: int) -> None:
    """Write truth and evidence; the evidence last, for it says that both are there."""
    truth, evidence = _files(folder, name)
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    points = fit.body.skeleton.point_names
    atomic.write_npz(
        truth,
        {
            "schema": "simrecon.truth/1",
            "times_s": fit.times_s,
            "joint_names": np.array(points),
            "joints_m": synthesis_views.marks_of(fit, fit.qpos),
            "qpos": fit.qpos,
            "height_m": np.array(fit.body.height_m),
            "mass_kg": np.array(fit.body.mass_kg),
        },
    )
    readers.write(evidence, synthesis_views.seen(fit, rng))


def _files(folder: Path, name: str) -> tuple[Path, Path]:
    return folder / "truth" / f"{name}.npz", folder / "evidence" / f"{name}.npz"


def reconstruct(folder: Path, part: str, jobs: int) -> None:
    """The results of a part of the split, by the batch; what is finished is kept."""
    names = getattr(synthesis_corpus.split(), part)
    paths = [str(_files(folder, name)[1]) for name in names]
    chosen = clips.collect(paths, {"plan": PLAN, "threads": 1, "no_report": True})
    runner.run(chosen, ahead.Settings(folder / "results", jobs), lambda line: print(line, flush=True))


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
