"""Fingerprints of what simrecon computes: a change that should change no bit leaves them equal.

Runs a fixed set of jobs by the command line and prints, for each result, SHA-256 digests of the arrays of
`motion.npz`, of `model.xml`, and of the kinematic fit (its poses, losses and iterations):

    python -m tools.ops.fingerprint --data DIR -o before.json
    python -m tools.ops.fingerprint --data DIR -o after.json --compare before.json

The bits depend on the processor and on the versions of the libraries, so compare digests of one machine only.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tools import CHECKOUT

FRAMES = 31
"""Frames of one second of a clip at 30 Hz, the first included."""

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
"""Commands run the code of this checkout, whatever is installed."""

Digests = dict[str, str]
Case = Callable[["Runner"], dict[str, Path]]


class Runner:
    """Runs simrecon's commands in a folder of its own."""

    def __init__(self, data: Path, work: Path, command: list[str]) -> None:
        self.data, self.work, self.command = data, work, command

    def evidence(self, name: str) -> Path:
        """Path of a clip's evidence."""
        return self.data / "evidence" / f"{name}.npz"

    def __call__(self, *arguments: str | Path) -> None:
        """Run one command; an exit status other than success or fallback ends the program."""
        words = [*self.command, *map(str, arguments)]
        done = subprocess.run(
            words, cwd=self.work, env=ENVIRONMENT, capture_output=True, text=True, check=False
        )
        if done.returncode not in (0, 3):
            raise SystemExit(f"{' '.join(words)}: exit status {done.returncode}\n{done.stderr}")


def demo(run: Runner) -> dict[str, Path]:
    """The example that ships."""
    run("demo", "--plan", "quick", "-o", run.work / "demo")
    return {"demo": run.work / "demo"}


def walk(run: Runner) -> dict[str, Path]:
    """A clean walk, then the same again from its result, and on a smaller body."""
    out, again, small = (run.work / name for name in ("walk", "walk_rerun", "walk_retarget"))
    run("run", run.evidence("synth_walk"), "--plan", "quick", "-o", out)
    run("rerun", out, "-o", again)
    run("retarget", out, "--height-m", "1.2", "-o", small)
    return {"walk": out, "rerun": again, "retarget": small}


def kick(run: Runner) -> dict[str, Path]:
    """A kick."""
    run("run", run.evidence("synth_kick"), "--plan", "quick", "-o", run.work / "kick")
    return {"kick": run.work / "kick"}


def seat(run: Runner) -> dict[str, Path]:
    """A person who sits down and stands up, with the bench that the motion suggests."""
    scene, clip = run.work / "bench.toml", run.evidence("opencap_STS_wham")
    run("scene", "suggest", clip, "-o", scene)
    run("run", clip, "--scene", scene, "--plan", "quick", "-o", run.work / "seat")
    return {"seat": run.work / "seat"}


def roll(run: Runner) -> dict[str, Path]:
    """One second of a roll, with the plan of flips."""
    cut = run.work / "roll_1s.npz"
    shorten(run.evidence("synth_roll"), cut, FRAMES)
    run("run", cut, "--plan", "flips", "-o", run.work / "roll")
    return {"roll": run.work / "roll"}


def batch(run: Runner) -> dict[str, Path]:
    """A batch of two short clips."""
    clips, out = run.work / "clips", run.work / "night"
    clips.mkdir()
    for name in ("synth_punch", "synth_jump"):
        shorten(run.evidence(name), clips / f"{name}.npz", FRAMES)
    run("batch", clips, "-o", out, "--plan", "quick")
    return {f"batch {folder.parent.name}": folder.parent for folder in sorted(out.rglob("motion.npz"))}


CASES: dict[str, Case] = {
    "demo": demo,
    "walk": walk,
    "kick": kick,
    "seat": seat,
    "roll": roll,
    "batch": batch,
}


def shorten(source: Path, target: Path, frames: int) -> None:
    """Write the first frames of an evidence file."""
    with np.load(source, allow_pickle=False) as archive:
        arrays = {key: archive[key] for key in archive.files}
    count = len(arrays["times_s"])
    for key in ("times_s", "keypoints_px", "keypoint_scores", "joints_m", "rotations"):
        if key in arrays and len(arrays[key]) == count:
            arrays[key] = arrays[key][:frames]
    np.savez(target, allow_pickle=False, **arrays)


def digests(folder: Path) -> Digests:
    """SHA-256 of a result folder by part."""
    with np.load(folder / "motion.npz", allow_pickle=False) as archive:
        arrays = {key: archive[key] for key in sorted(archive.files)}
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    fit = {"kinematic_qpos": arrays["kinematic_qpos"]}
    summary = [report["kinematics"][key] for key in ("iterations", "loss_terms", "reprojection_median_px")]
    windows = [[window["loss"], window["loss_terms"]] for window in report["windows"]]
    return {
        "motion": _of_arrays(PUBLISHED, arrays),
        "model": hashlib.sha256((folder / "model.xml").read_bytes()).hexdigest(),
        "fit": _of_arrays(
            tuple(fit), fit, json.dumps([summary, report["person"]["height_m"]], sort_keys=True)
        ),
        "losses": hashlib.sha256(json.dumps(windows, sort_keys=True).encode()).hexdigest(),
    }


PUBLISHED = (
    "times_s",
    "frame_step",
    "status",
    "qpos",
    "qvel",
    "state0",
    "ctrl",
    "joint_names",
    "joints_m",
    "com_m",
    "torque_Nm",
    "contact_body",
    "contact_force_N",
    "contact_point_m",
    "contact_slip_mps",
    "grf_N",
    "kinematic_qpos",
)
"""Arrays of `motion.npz` that are compared; keys that later versions add are not."""


def _of_arrays(keys: tuple[str, ...], arrays: dict[str, Any], text: str = "") -> str:
    digest = hashlib.sha256(text.encode())
    for key in keys:
        array = np.ascontiguousarray(arrays[key])
        digest.update(f"{key} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def main() -> int:
    """Run the cases, print and write the digests, and compare them; 1 if any differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, metavar="DIR", help="holds evidence/*.npz")
    parser.add_argument("-o", dest="output", type=Path, metavar="FILE", help="JSON of the digests")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="digests of before")
    parser.add_argument("--only", nargs="+", choices=tuple(CASES), default=tuple(CASES), metavar="CASE")
    parser.add_argument("--command", nargs="+", default=[sys.executable, "-m", "simrecon"], metavar="WORD")
    options = parser.parse_args()
    before = json.loads(options.compare.read_text(encoding="utf-8")) if options.compare else {}
    after: dict[str, Digests] = {}
    differ = 0
    with tempfile.TemporaryDirectory(prefix="simrecon-fingerprint-") as folder:
        run = Runner(options.data.resolve(), Path(folder), options.command)
        for name in options.only:
            for case, result in CASES[name](run).items():
                after[case] = digests(result)
                known = before.get(case, {})
                changed = [part for part, value in known.items() if after[case].get(part) != value]
                differ += len(changed)
                mark = "" if not known else f"  DIFFERS: {', '.join(changed)}" if changed else "  equal"
                short = "  ".join(f"{part} {value[:12]}" for part, value in after[case].items())
                print(f"{case:<20} {short}{mark}", flush=True)
    if options.output:
        options.output.write_text(json.dumps(after, indent=1) + "\n", encoding="utf-8")
    return 1 if differ else 0


if __name__ == "__main__":
    raise SystemExit(main())
