"""Make the clips of the suite `possible`: motions that a simulator executed, seen by a virtual camera.

usage: python -m tools.make.possible --data DATA -o FOLDER [--observer FILE] [--plan overnight] [--seed N]
                                     [--threads N] [--only NAME ...] [--list]

A recording of `possible.toml` beside this file is cut, put on another body where the file says so, and
simulated from its joints with steps of at most 4.2 ms. What the simulator did is the truth: nothing in
it is impossible, and its forces and contacts are known. FILE is a program that is run as `FILE RESULT NAME
FOLDER SEED` (`../tools/observe.py` of DATA if left out). It looks at a result folder with a virtual camera
and a pose network's errors, and writes `evidence/NAME.npz` and `truth/NAME.npz` into FOLDER.

Every motion is kept with what it was made of (`made/NAME/record.json`), so the same command goes on where it
was stopped. `possible.json` lists all. A motion whose simulation fell, or is farther from its reference than
`NEAR_M` on average or `NEAREST_M` in its worst frame, is left out: it says nothing of the motion it is named
after.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import simrecon
from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.errors import InputError, SimreconError
from simrecon.evidence import markers
from simrecon.evidence.opensim import read_trc
from simrecon.io import atomic, provenance, tables
from simrecon.io.tables import number, option, text
from simrecon.job import Job, Person
from simrecon.types import Evidence, Scene

MOTIONS = Path(__file__).with_suffix(".toml")
STEP_MAX_S, RATE_HZ = 0.0042, 30.0
TRUST = "mocap,assume=1,joints_m=0.05,place_m=0.05"
"""Of the recording, which may be left by centimetres, so that feet that stand are level and on the floor.

With the joints alone, the soles of a man who washes himself are 17 mm from level, and he rocks on edges.
"""
NEAR_M, NEAREST_M = 0.06, 0.25
"""Farthest that a truth may be from its reference, on average and in its worst frame."""


@dataclass(frozen=True)
class Motion:
    """`[[motion]]`: where a recording lies, what of it is taken, and on which body it is put."""

    name: str = text()
    file: str = text()
    mass_kg: float = number(5.0, 400.0)
    view: int = number(0, 2**31)
    archive: str | None = None
    static: str | None = None
    span_s: tuple[float, float] | None = None
    height_m: float | None = number(0.3, 2.5, default=None)
    distribution: str | None = None


@dataclass(frozen=True)
class Motions:
    """All of `possible.toml`."""

    motion: tuple[Motion, ...] = option()


@dataclass(frozen=True)
class Making:
    """How motions are made: data, target folder, program that looks at them, plan, seed and threads."""

    data: Path
    folder: Path
    observer: Path
    plan: str
    seed: int
    threads: int


def main() -> None:
    """Make what is not there yet, one line for each motion."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    parser.add_argument("--observer", type=Path)
    parser.add_argument("--plan", default="overnight")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    parser.add_argument("--list", action="store_true", help="print the names and end")
    options = parser.parse_args()
    motions = tables.read(Motions, MOTIONS, "list of motions").motion
    if options.list:
        print("\n".join(motion.name for motion in motions))
        return
    observer = options.observer or options.data.resolve().parent / "tools" / "observe.py"
    making = Making(options.data, options.folder, observer, options.plan, options.seed, options.threads)
    try:
        made = make(making, chosen(motions, options.only))
    except InputError as error:
        sys.exit(str(error))
    print(f"{sum(row['kept'] for row in made)} of {len(made)} motions are in {making.folder}")


def chosen(motions: tuple[Motion, ...], names: list[str]) -> list[Motion]:
    """The motions of these names, all without any.

    Raises:
        InputError: there is no motion of a name.
    """
    valid = [motion.name for motion in motions]
    if unknown := [name for name in names if name not in valid]:
        raise InputError(f"--only: found {', '.join(unknown)}; valid: {', '.join(valid)}")
    return [motion for motion in motions if not names or motion.name in names]


def make(making: Making, motions: list[Motion]) -> list[dict[str, Any]]:
    """Make motions, and write `possible.json`.

    Raises:
        InputError: data, or the program that looks at motions, are not there.
    """
    for path, what in ((making.data, "the data"), (making.observer, "the program that looks at motions")):
        if not path.exists():
            raise InputError(f"{path}: cannot be read (there is no such file); give {what}")
    rows = []
    for motion in motions:
        row = _made(making, motion)
        print(f"{motion.name}: {row['verdict']}", flush=True)
        rows.append(row)
    found = sorted((making.folder / "made").glob("*/record.json"))
    listed = [json.loads(path.read_text(encoding="utf-8")) for path in found]
    atomic.write_json(making.folder / "possible.json", listed)
    return rows


def _made(making: Making, motion: Motion) -> dict[str, Any]:
    """The record of a motion, made if it isn't there with the same settings."""
    folder = making.folder / "made" / motion.name
    record = folder / "record.json"
    asked = {
        **asdict(motion),
        "plan": making.plan,
        "seed": making.seed,
        "step_max_s": STEP_MAX_S,
        "trust": TRUST,
    }
    key = provenance.digest_of([asked, provenance.file_digest(making.data / (motion.archive or motion.file))])
    if record.is_file():
        known: dict[str, Any] = json.loads(record.read_text(encoding="utf-8"))
        if known["key"] == key:
            return known
    folder.mkdir(parents=True, exist_ok=True)
    try:
        content = _told(_simulated(making, motion, folder))
    except SimreconError as error:
        content = {"kept": False, "verdict": f"left out: {error}"}
    if content["kept"]:
        arguments = [folder / "result", motion.name, making.folder, motion.view]
        subprocess.run([sys.executable, str(making.observer), *map(str, arguments)], check=True)
    content = asked | {"key": key, **content, "versions": provenance.versions()}
    atomic.write_json(record, content)
    return content


def _simulated(making: Making, motion: Motion, folder: Path) -> dict[str, Any]:
    """The report of a motion's simulation in `result`."""
    clean, result = folder / "clean.npz", folder / "result"
    readers.write(clean, recording(making.data, motion))
    plan = plans.overridden(
        plans.read(making.plan), {"simulation.timestep_max_s": STEP_MAX_S}, f"motion {motion.name}"
    )
    job = Job(str(clean), str(result), plan=plan, seed=making.seed, threads=making.threads)
    if motion.height_m is not None:
        # only its kinematic fit is used, which no plan of the search changes
        before = replace(job, output=str(folder / "before"), plan=plans.read("quick"))
        simrecon.run(before, overwrite=True)
        body = Person(height_m=motion.height_m, mass_kg=motion.mass_kg, mass_distribution=motion.distribution)
        job = replace(job, input=before.output, person=body, retarget=True)
    return dict(simrecon.run(job, overwrite=True).report)


def _told(report: dict[str, Any]) -> dict[str, Any]:
    """Whether a simulation may be a truth, and why."""
    agreement = report["agreement"]
    mean_m, worst_m = float(agreement["fit_mean_m"]), float(agreement["fit_max_m"])
    said = f"{1e3 * mean_m:.0f} mm from its reference, {1e3 * worst_m:.0f} mm in the worst frame"
    reasons = [
        *(["not all frames are simulated"] if report["frames"]["fallback"] else []),
        *(["the person fell"] if agreement["fell"] else []),
        *([said] if mean_m > NEAR_M or worst_m > NEAREST_M else []),
    ]
    return {
        "kept": not reasons,
        "verdict": f"left out: {', '.join(reasons)}" if reasons else said,
        "mean_mm": 1e3 * mean_m,
        "worst_mm": 1e3 * worst_m,
        "height_m": report["person"]["height_m"],
        "cpu_s": report["totals"]["cpu_s"],
    }


def recording(data: Path, motion: Motion) -> Evidence:
    """The joints of a recording over a floor at z = 0, at most 30 frames a second, with the mass of its body.

    Raises:
        InputError: it can't be read, or has no frames there.
    """
    if motion.static is not None:
        seen = markers.evidence(read_trc(data / motion.static), read_trc(data / motion.file), motion.mass_kg)
    elif motion.archive is None:
        seen = _read(data / motion.file)
    else:
        with tempfile.TemporaryDirectory() as folder, tarfile.open(data / motion.archive) as archive:
            archive.extract(motion.file, folder, filter="data")
            seen = _read(Path(folder) / motion.file)
    every = max(1, round(1.0 / (RATE_HZ * float(np.median(np.diff(seen.times_s))))))
    first, last = motion.span_s or (None, None)
    part = readers.within(seen, readers.Span(first, last, every), motion.file)
    times_s = part.times_s - part.times_s[0]
    return _on_floor(replace(part, times_s=times_s, mass_kg=motion.mass_kg, trust=TRUST, part=None))


def _on_floor(seen: Evidence) -> Evidence:
    """Evidence with the floor that its feet show at z = 0, as those have it who see the truth."""
    fit = kinematics.fit(readers.resample(seen)[0], Scene(), plans.read("default").kinematics)
    return replace(seen, joints_m=seen.joints_m - [0.0, 0.0, fit.scene.ground.height_m])


def _read(path: Path) -> Evidence:
    """A file of motion capture, or the joints of a reference."""
    if path.suffix != ".npz":
        return readers.read(path)
    with np.load(path, allow_pickle=False) as truth:
        names = [str(name) for name in truth["joint_names"]]
        return readers.from_arrays(truth["times_s"], joint_names=names, joints_m=truth["joints_m"])


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
