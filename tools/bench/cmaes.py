"""What a generation of CMA-ES costs beside the rollouts that it asks for.

usage: python -m tools.bench.cmaes [--population N] [--variables N ...] [--repeats N] [--steps N]

Prints, by covariance, processor time of `ask` and of `tell`, the medians of many generations, and their sum
as a share of one generation's rollouts: bare `mujoco.batch` stepping of the body that ships, standing, on one
thread in the same run. Rollouts run on all cores and CMA-ES on one: with c cores the share of wall time is
c times as large. The dense root is one product of the samples with an (n, n) matrix. BLAS should have one
thread (OPENBLAS_NUM_THREADS=1).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import get_args

import mujoco
import mujoco.batch
import numpy as np

from simrecon import body as bodies
from simrecon import scene as scenes
from simrecon.optim.cmaes import CMAES
from simrecon.optim.covariance import Covariance
from simrecon.sim.state import forward, initial_state
from simrecon.types import Array, Scene

STEP_S = 1 / 90


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--population", type=int, default=64)
    parser.add_argument("--variables", type=int, nargs="+", default=[540])
    parser.add_argument("--repeats", type=int, default=100)
    parser.add_argument("--steps", type=int, default=55, help="of one rollout")
    options = parser.parse_args()
    rollouts_s = stepping(options.population, options.steps)
    print(f"{options.population} rollouts of {options.steps} steps: {1e3 * rollouts_s:.1f} ms of one core\n")
    print("| variables | covariance | ask, ms | tell, ms | of one core's rollouts |")
    print("|---|---|---|---|---|")
    for n in options.variables:
        for covariance in get_args(Covariance):
            ask_s, tell_s = generation(n, options.population, covariance, options.repeats)
            share = (ask_s + tell_s) / rollouts_s
            print(f"| {n} | {covariance} | {1e3 * ask_s:.2f} | {1e3 * tell_s:.2f} | {share:.2%} |")
        root, samples = np.eye(n), np.ones((options.population, n))
        dense_s = median(lambda root=root, samples=samples: samples @ root, options.repeats)  # type: ignore[misc]
        print(f"| {n} | a dense root | {1e3 * dense_s:.2f} | | {dense_s / rollouts_s:.2%} |", flush=True)


def generation(n: int, population: int, covariance: Covariance, repeats: int) -> tuple[float, float]:
    """Seconds of `ask` and of `tell`; of tell the mean for a full matrix, decomposed now and then."""
    run = CMAES(np.zeros(n), 1.0, population=population, covariance=covariance, rng=0)
    losses = np.random.default_rng(0).random(population)
    ask_s, tell_s = np.zeros(repeats), np.zeros(repeats)
    for repeat in range(repeats):
        began = time.process_time()
        samples = run.ask()
        sampled = time.process_time()
        run.tell(samples, losses)
        ask_s[repeat], tell_s[repeat] = sampled - began, time.process_time() - sampled
    middle = np.mean if covariance == "full" else np.median
    return float(np.median(ask_s)), float(middle(tell_s))


def stepping(population: int, steps: int, repeats: int = 5) -> float:
    """Seconds of one core for a generation of rollouts of a standing body."""
    person = bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=70.0)
    model = mujoco.MjModel.from_xml_string(scenes.build(person.mjcf, Scene(), STEP_S))
    qpos: Array = model.qpos0.copy()
    data = forward(model, initial_state(model, qpos, np.zeros(model.nv)))
    qpos[2] -= data.geom_xpos[1:, 2].min() - 0.03  # feet on the floor
    batch = mujoco.batch.Batch(model, population, 1)
    start = initial_state(model, qpos, np.zeros(model.nv))
    ctrl = np.zeros((population, steps, model.nu))

    def generation_of_rollouts() -> None:
        batch.state[:] = start
        batch.rollout(steps, ctrl)

    return median(generation_of_rollouts, repeats)


def median(work: Callable[[], object], repeats: int) -> float:
    """Median processor time in seconds."""
    seconds = []
    for _ in range(repeats):
        began = time.process_time()
        work()
        seconds.append(time.process_time() - began)
    return float(np.median(seconds))


if __name__ == "__main__":
    main()
