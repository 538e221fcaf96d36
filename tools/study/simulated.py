"""How closely the simulation follows motion capture of motions that a body can perform, clip by clip.

usage: python -m tools.study.simulated --data DATA -o OUT [--only NAME ...] [--threads N] [--page PAGE]

Runs each clip as `simrecon run` does, with the scene that it was recorded in, and compares the simulated
joints with the file's (MPJPE-G over all joints but the neck), next to those of the kinematic fit. A result
that is there already is scored without being made again.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from simrecon import evidence, kinematics, results, running, scene
from simrecon import plan as plans
from simrecon.body import names
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading, inputs
from simrecon.types import Array, Evidence, Scene
from tools.study import mocap

BEGIN, END = "<!-- table: written by tools/study/simulated.py -->\n", "<!-- end of simulated table -->"
HEAD = (
    "| clip | plan | frames simulated | fit from the file, mm | simulation from the file, mm | "
    "worst frame, mm (s) | simulation from the fit, mm |",
    "|---|---|---|---|---|---|---|",
)
DROP_BOX = """
[ground]
[[item]]
name = "box"
kind = "box"
position_m = [-1.214, 0.587, 0.0]
size_m = [0.558, 0.581, 0.295]
yaw_rad = -0.41
"""
"""The box of the drop jump, which is not in the data: what `simrecon scene suggest` proposes."""


@dataclass(frozen=True)
class Clip:
    """A clip: its file, below DATA, and what is said of it."""

    file: str
    plan: str = "default"
    reading: Reading = field(default_factory=Reading)
    person: Person = field(default_factory=Person)
    scene: str = ""


SUBJECT = Person(mass_kg=60.1)
CLIPS: Mapping[str, Clip] = {
    "walk.bvh": Clip("mocap/mass_bvh/walk.bvh"),
    "run.bvh": Clip("mocap/mass_bvh/run.bvh"),
    "kick.bvh": Clip("mocap/mass_bvh/kick.bvh", "flips"),
    "backflip.bvh": Clip("mocap/mass_bvh/backflip.bvh", "flips"),
    "backflip.bvh, 45 Hz": Clip("mocap/mass_bvh/backflip.bvh", "flips", reading=Reading(fps=45.0)),
    "dance.bvh": Clip("mocap/mass_bvh/dance.bvh"),
    "walking2.trc": Clip("grf/opencap_subject4/walking2.trc", person=SUBJECT),
    "DJ1.trc, box": Clip("grf/opencap_subject4/DJ1.trc", person=SUBJECT, scene=DROP_BOX),
    "squatsAsym1.trc, 4 s": Clip(
        "grf/opencap_subject4/squatsAsym1.trc", reading=Reading(to_s=4.0), person=SUBJECT
    ),
    "synth_jump": Clip("truth/synth_jump.npz"),
    "synth_kick": Clip("truth/synth_kick.npz", "flips"),
    "synth_backflip": Clip("truth/synth_backflip.npz", "flips"),
    "synth_walk": Clip("truth/synth_walk.npz"),
}  # fmt: skip


def main() -> None:
    """Print a table, and write it into a page between its marks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument("--only", nargs="+", choices=list(CLIPS), default=list(CLIPS), metavar="NAME")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--page", type=Path, help="a page with the marks between which the table goes")
    options = parser.parse_args()
    lines = [*HEAD]
    for name in options.only:
        lines.append(row(name, made(CLIPS[name], options.data, options.output / slug(name), options.threads)))
        print(lines[-1], flush=True)
    if options.page:
        page = options.page.read_text(encoding="utf-8")
        before, after = page.split(BEGIN)[0], page.split(END)[1]
        options.page.write_text("\n".join([before + BEGIN, *lines, "", END]) + after, encoding="utf-8")


def slug(name: str) -> str:
    """A folder's name."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)


def made(clip: Clip, data: Path, output: Path, threads: int) -> Path:
    """The folder of a clip's result; it is made if it is not there."""
    if output.is_dir():
        return output
    with tempfile.TemporaryDirectory() as folder:
        file = data / clip.file
        if file.suffix == ".npz":
            file = Path(folder) / file.name
            evidence.write(file, mocap.recorded(data / clip.file))
        place = scene.parse(clip.scene, "box.toml") if clip.scene else Scene()
        job = Job(
            str(file), str(output), plan=plans.read(clip.plan), scene=place, reading=clip.reading,
            person=clip.person, threads=threads,
        )  # fmt: skip
        seen = inputs.observe(job)
        running.run(job)
    evidence.write(output.with_suffix(".seen.npz"), seen)
    return output


def row(name: str, output: Path) -> str:
    """How closely a result follows the joints of its clip."""
    result, seen = results.open_result(output), evidence.read(output.with_suffix(".seen.npz"))
    motion, kept = result.motion, result.motion.status == 0
    followed = motion.kinematic_qpos
    if followed is None:
        raise InputError(f"{output}: found a result without its kinematic fit; valid: one that was made here")
    ours, fit = (kinematics.configurations(result.body, qpos)[1] for qpos in (motion.qpos, followed))
    off, before = distances(seen, ours)[kept], distances(seen, fit)
    frame = int(np.nanargmax(np.nanmean(off, axis=1)))
    worst = f"{1e3 * np.nanmean(off[frame]):.0f} ({motion.times_s[kept][frame]:.2f})"
    apart = 1e3 * float(np.linalg.norm(ours - fit, axis=-1)[kept].mean())
    cells = f"{result.report['plan_name']} | {kept.sum()} of {len(kept)} | {1e3 * np.nanmean(before):.1f}"
    return f"| {name} | {cells} | {1e3 * np.nanmean(off):.1f} | {worst} | {apart:.1f} |"


def distances(seen: Evidence, marks: Array) -> Array:
    """Distances (T, K) m of the body's points (T, M, 3) from the joints of a file, but for the neck."""
    points = names.resolve(seen.joint_names)
    pairs = [
        (k, point)
        for k, point in enumerate(points)
        if point != names.IGNORED and seen.joint_names[k] not in mocap.LEFT_OUT
    ]
    theirs, own = (np.array(columns) for columns in zip(*pairs, strict=True))
    apart: Array = np.linalg.norm(marks[:, own] - seen.joints_m[:, theirs], axis=-1)
    return apart


if __name__ == "__main__":
    main()
