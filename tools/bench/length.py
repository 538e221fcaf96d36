"""Time per second of video and peak memory, from a short clip to a long one: the clip over and over again.

usage: python -m tools.bench.length EVIDENCE.npz [--seconds 10 60 600] [--plan NAME] [--threads N]
                                    [--planner NAME] [--engine NAME] [--set SECTION.KEY=VALUE ...]

The planner is that of the plan, if none is named. Every length is a process of its own. The clip runs to and
fro, so nothing jumps.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np

from simrecon import engines, evidence, plan, planners
from simrecon.pipeline import Setup, reconstruct
from simrecon.types import Array, Evidence, Scene
from tools.bench import sampling


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("evidence")
    parser.add_argument("--seconds", nargs="+", type=float, default=[10.0, 60.0, 600.0])
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--planner", choices=planners.names())
    parser.add_argument("--engine", choices=engines.names(), default="sampling")
    parser.add_argument("--set", nargs="+", default=[], metavar="SECTION.KEY=VALUE", help="change the plan")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        print(json.dumps(one(options)))
        return
    stages = "kinematics, s per s | simulation, s per s | record, s per s"
    print(f"| video, s | frames | {stages} | processor, s per s | peak, MiB |")
    print("|---" * 7 + "|")
    for seconds in options.seconds:
        same = ["--plan", options.plan, "--threads", str(options.threads), "--engine", options.engine]
        same += ["--planner", options.planner] if options.planner else []
        same += ["--set", *options.set] if options.set else []
        command = [
            sys.executable,
            "-m",
            "tools.bench.length",
            options.evidence,
            "--inside",
            "--seconds",
            str(seconds),
            *same,
        ]
        figures = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        numbers = [f"{value:.3f}" for value in (*figures["stages"], figures["cpu"])]
        cells = [f"{figures['seconds']:.0f}", str(figures["frames"]), *numbers, f"{figures['peak_mib']:.0f}"]
        print(f"| {' | '.join(cells)} |", flush=True)


def one(options: argparse.Namespace) -> dict[str, object]:
    """Reconstruct one length in this process."""
    long = repeated(evidence.read(options.evidence), options.seconds[0])
    settings = sampling.changed(plan.read(options.plan), options.set)
    began = time.process_time()
    planner = options.planner or settings.planner
    setup = Setup(planner=planner, engine=options.engine, threads=options.threads)
    result = reconstruct(long, Scene(), settings, setup)
    seconds = float(long.times_s[-1] - long.times_s[0])
    return {
        "seconds": seconds,
        "frames": len(long.times_s),
        "cpu": (time.process_time() - began) / seconds,
        "stages": [value / seconds for value in result.seconds.values()],
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def repeated(short: Evidence, seconds: float) -> Evidence:
    """The clip to and fro until it is at least `seconds` long."""
    count = len(short.times_s)
    interval_s = float(short.times_s[1] - short.times_s[0])
    frames = int(np.ceil(seconds / interval_s)) + 1
    there_and_back = np.concatenate((np.arange(count), np.arange(count - 2, 0, -1)))
    rows = np.resize(there_and_back, frames)

    def taken(values: Array) -> Array:
        return values[rows]

    return replace(
        short,
        times_s=np.arange(frames, dtype=float) * interval_s,
        keypoints_px=taken(short.keypoints_px),
        scores=taken(short.scores),
        joints_m=taken(short.joints_m),
    )


if __name__ == "__main__":
    main()
