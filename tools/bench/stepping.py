"""What MuJoCo's solver options are worth: simulation steps per second of populations around clean clips.

usage: python -m tools.bench.stepping --data DATA [--clips NAME ...] [--plan NAME] [--scene FILE]
                                      [--threads N] [--repeats N]

DATA holds `mocap/deepmimic`. Populations start at states along the kinematic targets' own simulation, every
half second, under smooth random offsets of the targets. All ways of a clip take turns, and the fastest turn
of each counts; so the ratios do not depend on how fast the machine is.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import mujoco
import mujoco.batch
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import plan
from simrecon import scene as scenes
from simrecon.engines import warm_start
from simrecon.engines.problem import Problem
from simrecon.sim.quiet import unlogged
from simrecon.sim.state import simulate
from simrecon.types import Array, Scene
from tools.bench import sampling

POPULATION, WINDOW_S, OFFSET_RAD, SMOOTH_S = 50, 0.6, 0.07, 0.07
NO_WARM_START = int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
NO_ISLANDS = int(mujoco.mjtDisableBit.mjDSBL_ISLAND)

Way = tuple[int, mujoco.mjtJacobian, mujoco.mjtCone]
"""Flags that are off, how the constraints' Jacobian is held, and the friction cone."""
SPARSE, DENSE = mujoco.mjtJacobian.mjJAC_SPARSE, mujoco.mjtJacobian.mjJAC_DENSE
PYRAMID, ELLIPSE = mujoco.mjtCone.mjCONE_PYRAMIDAL, mujoco.mjtCone.mjCONE_ELLIPTIC
WAYS: dict[str, Way] = {
    "MuJoCo's own choice": (0, DENSE, PYRAMID),
    "no warm start": (NO_WARM_START, DENSE, PYRAMID),
    "no islands": (NO_ISLANDS, DENSE, PYRAMID),
    "sparse": (0, SPARSE, PYRAMID),
    "all three": (NO_WARM_START | NO_ISLANDS, SPARSE, PYRAMID),
    "all three, elliptic cones": (NO_WARM_START | NO_ISLANDS, SPARSE, ELLIPSE),
}


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--clips", nargs="+", default=["walk", "kick", "roll", "getup_faceup"])
    parser.add_argument("--plan", default="default")
    parser.add_argument("--scene", type=Path)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    scene = scenes.read(options.scene) if options.scene else Scene()
    settings, ratios = plan.read(options.plan), []
    for clip in options.clips:
        speeds = measured(options.data, clip, settings, scene, options.threads, options.repeats)
        ratios.append(list(speeds.values()))
        print(f"{clip}: {next(iter(speeds.values())):.0f} steps/s", flush=True)
    relative = np.array(ratios) / np.array(ratios)[:, :1]
    print("\n| way | " + " | ".join(options.clips) + " |")
    print("|---" * (len(options.clips) + 1) + "|")
    for way, row in zip(WAYS, relative.T, strict=True):
        print(f"| {way} | " + " | ".join(f"{ratio:.2f}" for ratio in row) + " |")


def measured(
    data: Path, clip: str, settings: plan.Plan, scene: Scene, threads: int, repeats: int
) -> dict[str, float]:
    """Steps per second of a clip by way."""
    fit, seen = sampling.load(data, clip, settings, noisy=False)
    fit = replace(fit, scene=scene)
    problem = sampling.laid_out(fit, seen, settings)
    model, batches = problem.model, populations(problem)
    steps = sum(ctrl.shape[0] * ctrl.shape[1] for _, ctrl in batches)
    kept, spent = model.opt.disableflags & ~(NO_WARM_START | NO_ISLANDS), dict.fromkeys(WAYS, np.inf)
    for _ in range(repeats):
        for way, (off, jacobian, cone) in WAYS.items():
            model.opt.disableflags, model.opt.jacobian, model.opt.cone = kept | off, jacobian, cone
            batch = mujoco.batch.Batch(model, POPULATION, threads)
            seconds = 0.0
            for state, ctrl in batches:
                batch.state[:], batch.warning[:] = state, 0
                began = time.perf_counter()
                with unlogged():
                    batch.rollout(ctrl.shape[1], ctrl, ids=np.arange(POPULATION))
                seconds += time.perf_counter() - began
                if batch.warning[:, :, 1].any():
                    raise SystemExit(f"{clip}, {way}: a rollout diverged, and stepped less")
            spent[way] = min(spent[way], seconds)
    return {way: steps / seconds for way, seconds in spent.items()}


def populations(problem: Problem) -> list[tuple[Array, Array]]:
    """States (nstate,) and controls (P, N, nu)."""
    rng, clock = np.random.default_rng(0), problem.clock
    window = round(WINDOW_S / clock.step_s)
    states = simulate(problem.model, warm_start.from_fit(problem).state, problem.targets_rad[:-1])
    batches = []
    for first in range(0, clock.steps - window + 1, round(0.5 / clock.step_s)):
        noise = rng.standard_normal((POPULATION, window, problem.model.nu))
        smooth = gaussian_filter1d(noise, SMOOTH_S / clock.step_s, axis=1)
        offsets = OFFSET_RAD * smooth / smooth.std()
        batches.append((states[first], problem.targets_rad[first : first + window] + offsets))
    return batches


if __name__ == "__main__":
    main()
