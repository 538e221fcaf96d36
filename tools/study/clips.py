"""What plan settings are worth over whole clean clips: error, simulation steps and time for each.

usage: python -m tools.study.clips --data DATA -o OUT.json [--clips NAME ...] [--ways NAME ...]
                                   [--seeds N ...] [--set SECTION.KEY=VALUE ...]

DATA holds `mocap/deepmimic`. Every way is plan `default` with 15 generations and with what the way changes.
The table has the mean distance of the limbs' joints by clip (as `tools.bench.sampling`), and over all clips
the simulation steps and processor seconds per second of motion. Clips are at 30 Hz, so a step is a whole part
of 1/30 s: 4.8, 8.3, 11.1 or 16.7 ms for limits of 5, 10, 12 and 17 ms.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import kinematics, plan, schedule
from simrecon.engines import warm_start
from simrecon.engines import windows as engine
from simrecon.engines.problem import Problem
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.sampler import Sampler
from simrecon.engines.sampling.task import Task
from simrecon.sim.models import compile_text
from simrecon.sim.poses import differentiate
from simrecon.sim.state import component
from simrecon.types import Array, Effort, Evidence, KinematicFit, Window, WindowResult, WindowStatus
from tools.bench import sampling as bench

BASE = {"optimiser.generations": 15}
SMOOTH_S, GROW_S = 0.02, 0.2

WAYS: dict[str, dict[str, Any]] = {
    "as the plan": {},
    "step 4.8 ms": {"simulation.timestep_max_s": 0.005},
    "step 8.3 ms": {"simulation.timestep_max_s": 0.010},
    "step 16.7 ms": {"simulation.timestep_max_s": 0.017},
    "implicitfast, 4.8 ms": {"simulation.timestep_max_s": 0.005},
    "implicitfast, 11.1 ms": {},
    "window 0.45 s": {"window.length_s": 0.45, "window.overlap_s": 0.2},
    "window 0.8 s": {"window.length_s": 0.8, "window.overlap_s": 0.55},
    "window 1.0 s": {"window.length_s": 1.0, "window.overlap_s": 0.75},
    "commit 0.15 s": {"window.overlap_s": 0.45},
    "commit 0.4 s": {"window.overlap_s": 0.2},
    "knots each 0.067 s": {"window.knot_spacing_s": 1 / 15},
    "knots each 0.15 s": {"window.knot_spacing_s": 0.15},
    "no first state": {"optimiser.start_pose": 0.0, "optimiser.start_velocity": 0.0},
    "population 32": {"optimiser.population": 32},
    "population 100": {"optimiser.population": 100},
    "low rank": {"optimiser.covariance": "low_rank"},
    "sigma by the joint's strength": {},
    "inverse dynamics first": {},
    "trained people's torques": {"simulation.strength": "trained"},
    "growing horizon, 2 steps each": {},
    "growing horizon, 4 steps each": {},
}


def main() -> None:
    """Study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--clips", nargs="+", default=["walk", "run", "kick", "roll"])
    parser.add_argument("--ways", nargs="+", default=list(WAYS), choices=list(WAYS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--set", nargs="+", default=[], metavar="SECTION.KEY=VALUE", help="change every way")
    options = parser.parse_args()
    print("| way | " + " | ".join(options.clips) + " | mean, mm | 10³ steps per s | processor s per s |")
    print("|---" * (len(options.clips) + 4) + "|")
    rows = []
    for way in options.ways:
        own = [run(options, clip, way, seed) for clip in options.clips for seed in options.seeds]
        rows += own
        print(text(way, own, options.clips), flush=True)
    options.output.write_text(json.dumps(rows, indent=1), encoding="utf-8")


def run(options: argparse.Namespace, clip: str, way: str, seed: int) -> dict[str, Any]:
    """One clip in one way."""
    settings = bench.changed(plan.read("default"), options.set)
    settings = plan.overridden(settings, BASE | WAYS[way], "way")
    fit, seen = bench.load(options.data, clip, settings, noisy=False)
    began = time.process_time()
    problem = pose(fit, seen, settings, way)
    sampler = Sampler(problem, options.threads)
    windows, start = schedule.cut(problem.clock, settings), warm_start.from_fit(problem)
    if way.startswith("growing"):
        results = grown(problem, sampler, int(way.split()[2]))
        windows = tuple(result.window for result in results)
    else:
        with by_strength(problem) if "strength" in way else contextlib.nullcontext():
            results = engine.solve(sampler, windows, start, seed)
    seconds = problem.clock.steps * problem.clock.step_s
    row = {"clip": clip, "way": way, "seed": seed, "windows": len(results), "of": len(windows)}
    row |= {"steps_per_s": sampler.simulator.steps / seconds}
    row |= {"cpu_s_per_s": (time.process_time() - began) / seconds}
    return row | {"mpjpe_g_mm": 1e3 * off(problem, fit, results) if len(results) == len(windows) else None}


def grown(problem: Problem, sampler: Sampler, descents: int) -> tuple[WindowResult, ...]:
    """One window from the start of the clip, whose end goes on by `GROW_S`: all knots so far are free."""
    clock, start = problem.clock, warm_start.from_fit(problem)
    first, by = (round(s / clock.frame_s) * clock.stride for s in (problem.plan.window.length_s, GROW_S))
    ends = [*range(first, clock.steps, by), clock.steps]
    best: Descent | None = None
    for end in ends:
        task = Task(problem, Window(0, 0, end, end), start)
        descent = Descent.begin(task, sampler.simulator, task.warm_start()[None])
        if best is not None:
            width, free = task.shape[1], len(best.x) - best.task.shape[0] * best.task.shape[1]
            knots, offsets = best.x[: len(best.x) - free].reshape(-1, width), best.x[len(best.x) - free :]
            more = np.repeat(knots[-1:], task.shape[0] - len(knots), axis=0)
            x = np.concatenate((knots.ravel(), more.ravel(), offsets))
            terms, _ = task.evaluate(sampler.simulator, x[None])
            descent.x, descent.loss = x, sum(float(value[0]) for value in terms.values())
        for _ in range(descents):
            descent.step()
        best = descent
    if best is None:
        raise SystemExit("a clip of no steps")
    committed = best.task.commit(best.x)
    return (
        WindowResult(
            window=best.task.window,
            ctrl=committed.ctrl,
            states=committed.states,
            handover=committed.handover,
            loss=best.loss,
            loss_terms=best.terms,
            trace=np.zeros(1),
            steps=np.zeros(1, np.int64),
            descent_steps=0,
            evaluations=0,
            seconds=0.0,
            stepping_s=0.0,
            status=WindowStatus.GENERATIONS,
            effort=Effort(),
        ),
    )


def off(problem: Problem, fit: KinematicFit, results: Any) -> float:
    """Mean distance of the limbs' joints from the clip, m."""
    states = np.concatenate([results[0].states[:1]] + [result.states[1:] for result in results])
    qpos = component(problem.model, states, mujoco.mjtState.mjSTATE_QPOS)
    qpos = qpos[:: problem.clock.stride, : fit.qpos.shape[1]]
    rows = [fit.body.skeleton.point_names.index(name) for name in bench.JOINTS]
    points = kinematics.configurations(fit.body, qpos)[1]
    return float(np.linalg.norm((points - problem.points_m)[:, rows], axis=-1).mean())


def pose(fit: KinematicFit, seen: Evidence, settings: plan.Plan, way: str) -> Problem:
    """The problem of a way."""
    problem = bench.laid_out(fit, seen, settings)
    if way.startswith("implicitfast"):
        text = problem.mjcf.replace('integrator="discrete"', 'integrator="implicitfast"')
        problem = replace(problem, mjcf=text, model=compile_text(text))
    if way == "inverse dynamics first":
        problem = replace(problem, targets_rad=problem.targets_rad + feed_forward(problem))
    return problem


def feed_forward(problem: Problem) -> Array:
    """Offsets of the targets (N + 1, nu) that give the torques of the clip's inverse dynamics."""
    model, frame_s = problem.model, problem.clock.frame_s
    data = mujoco.MjData(model)
    velocity = differentiate(model, problem.qpos, frame_s)
    acceleration = np.gradient(velocity, frame_s, axis=0)
    torque = np.zeros((len(problem.qpos), model.nu))
    for frame in range(len(problem.qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = problem.qpos[frame], velocity[frame], acceleration[frame]
        mujoco.mj_inverse(model, data)
        torque[frame] = data.qfrc_inverse[6:]
    torque = np.clip(torque, *model.actuator_forcerange.T)
    smooth = gaussian_filter1d(torque, SMOOTH_S / frame_s, axis=0, mode="nearest")
    frames_s = np.arange(len(smooth)) * frame_s
    steps_s = np.arange(problem.clock.steps + 1) * problem.clock.step_s
    rows = [np.interp(steps_s, frames_s, column) for column in smooth.T]
    return np.asarray(np.stack(rows, axis=1) / model.actuator_gainprm[:, 0])


@contextlib.contextmanager
def by_strength(problem: Problem) -> Iterator[None]:
    """While it is open, knots of weak joints are searched less far, those of strong ones further."""
    able = problem.model.actuator_forcerange[:, 1] / problem.model.actuator_gainprm[:, 0]  # rad, to the limit
    share, kept = able / np.exp(np.log(able).mean()), Task.deviations

    def deviations(self: Task) -> Array:
        deviation = kept(self)
        count = self.shape[0] * self.shape[1]
        deviation[:count] *= np.tile(share, self.shape[0])
        return deviation

    Task.deviations = deviations  # type: ignore[method-assign]
    try:
        yield
    finally:
        Task.deviations = kept  # type: ignore[method-assign]


def text(way: str, rows: list[dict[str, Any]], clips: list[str]) -> str:
    """A row of the table: means over seeds."""
    cells, means = [], []
    for clip in clips:
        own = [row["mpjpe_g_mm"] for row in rows if row["clip"] == clip]
        fell = any(value is None for value in own)
        cells.append("fell" if fell else f"{np.mean(own):.1f}")
        means.append(np.nan if fell else np.mean(own))
    mean = "–" if np.isnan(means).any() else f"{np.mean(means):.1f}"
    steps = np.mean([row["steps_per_s"] for row in rows]) / 1e3
    cpu = np.mean([row["cpu_s_per_s"] for row in rows])
    return f"| {way} | " + " | ".join(cells) + f" | {mean} | {steps:.0f} | {cpu:.1f} |"


if __name__ == "__main__":
    main()
