"""Measure scenes: what 30 boxes cost, and what a stiffer trampoline does to a jump.

    python -m tools.bench.scene boxes EVIDENCE [--plan quick] [--repeats 3]
    python -m tools.bench.scene trampoline EVIDENCE [--plan quick]

`boxes` reconstructs a clip on an empty floor and among 30 boxes that stand around the person, by turns, and
prints the fastest of each by stage. `trampoline` puts the floor of a jump at the bed of a trampoline of 1, 4
and 16 times 5 kN/m and prints how deep the bed gives way, how high the pelvis comes after it, and when.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

from simrecon import evidence, pipeline
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.drawing import overlay, video
from simrecon.sim.address import locate
from simrecon.types import Evidence, Scene

STIFFNESS_NPM, BED_M = 5e3, 0.0


def boxes() -> Scene:
    """30 boxes of different sizes, 1.5 to 4 m around the origin."""
    rng = np.random.default_rng(0)
    items = []
    for i in range(30):
        far, angle = 1.5 + 2.5 * rng.random(), 2 * math.pi * i / 30
        size = (0.2 + 0.4 * rng.random(3)).tolist()
        place = [far * math.cos(angle), far * math.sin(angle), 0.0]
        table = {"name": f"box_{i}", "kind": "box", "position_m": place, "size_m": size, "yaw_rad": angle}
        items.append(scenes.item(table, "bench"))
    return Scene(items=tuple(items))


def compare_boxes(clip: Evidence, plan: plans.Plan, repeats: int, threads: int) -> None:
    """Print seconds by stage without and with the boxes."""
    spent: dict[str, list[dict[str, float]]] = {"empty": [], "30 boxes": []}
    for _ in range(repeats):
        for name, scene in (("empty", Scene()), ("30 boxes", boxes())):
            spent[name].append(
                pipeline.reconstruct(clip, scene, plan, pipeline.Setup(threads=threads)).seconds
            )
    print(f"{'':10} {'kinematics':>11} {'simulation':>11} {'whole':>8}   seconds, fastest of {repeats}")
    best = {}
    for name, runs in spent.items():
        stages = [min(run[stage] for run in runs) for stage in ("kinematics", "simulation")]
        best[name] = min(sum(run.values()) for run in runs)
        print(f"{name:10} {stages[0]:11.2f} {stages[1]:11.2f} {best[name]:8.2f}")
    print(f"{'ratio':10} {best['30 boxes'] / best['empty']:32.2f}")


def compare_trampolines(clip: Evidence, plan: plans.Plan, threads: int, picture: Path | None) -> None:
    """Print sink and apex on three trampolines."""
    print(
        f"{'stiffness':>10} {'bed sinks':>10} {'pelvis apex':>12} {'at':>6} {'simulated':>10}   N/m, m, m, s"
    )
    for factor in (1, 4, 16):
        table = {
            "name": "trampoline",
            "kind": "trampoline",
            "position_m": [0.0, 0.0, -1.155],
            "stiffness_Npm": factor * STIFFNESS_NPM,
            "damping_Nspm": 100.0 * math.sqrt(factor),
        }
        ground = scenes.parse("[ground]\nheight_m = -1.155\n").ground
        scene = Scene(ground, (scenes.item(table, "bench"),))
        result = pipeline.reconstruct(clip, scene, plan, pipeline.Setup(threads=threads))
        motion, own = result.motion, locate(result.problem.model)
        bed = motion.qpos[:, own.nq :]  # (T, tiles)
        lowest = int(bed.min(axis=1).argmin())
        after = motion.qpos[lowest:, 2]
        when = motion.times_s[lowest + int(after.argmax())]
        whole = f"{int((motion.status == 0).sum())}/{len(motion.status)}"
        print(
            f"{factor * STIFFNESS_NPM:10.0f} {-bed.min():10.3f} {after.max():12.3f} {when:6.2f} {whole:>10}"
        )
        if picture is not None:
            still = overlay.Animation(
                model=result.problem.model,
                times_s=motion.times_s[lowest : lowest + 1],
                qpos=motion.qpos[lowest : lowest + 1],
                contact_point_m=motion.contact_point_m[lowest : lowest + 1],
                contact_force_N=motion.contact_force_N[lowest : lowest + 1],
            )
            video.write_image(picture.with_stem(f"{picture.stem}_{factor}"), overlay.sheet(still))


def main() -> None:
    """Run one of the measurements."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("boxes", "trampoline"))
    parser.add_argument("evidence", type=Path)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--picture", type=Path, help="of every trampoline at its lowest (.png)")
    options = parser.parse_args()
    clip, plan = evidence.read(options.evidence), plans.read(options.plan)
    if options.what == "boxes":
        compare_boxes(clip, plan, options.repeats, options.threads)
    else:
        compare_trampolines(clip, plan, options.threads, options.picture)


if __name__ == "__main__":
    main()
