"""How the loss of a window falls with simulation steps, for several ways to search.

usage: python -m tools.study.sampling --data DATA -o OUT [--clips NAME ...] [--ways NAME ...] [--paper]
       python -m tools.study.sampling --plot OUT.json FILE.png

Every way starts from the same state and knots: those that plan `default` hands over to the window that begins
half a second into the clip. --paper gives the windows the loss of plan `paper` and adds its search, 2,000
generations of 100 with a full covariance. The plot needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import plan, schedule
from simrecon.engines import warm_start
from simrecon.engines.problem import Problem
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.sampler import Sampler
from simrecon.engines.sampling.search import PATIENCE, Search
from simrecon.engines.sampling.task import Task
from simrecon.plan import Plan
from simrecon.types import Array, Handover, Window
from tools.bench import sampling as bench

START_S = 0.5
RACE_KEPT = 0.6
"""Share of a generation that is rolled out to the end of the window, by its loss over the first half."""

BASE = {"spread": 1.0, "tol_loss": 0.0, "tol_sigma": 0.0}

WAYS: dict[str, dict[str, Any]] = {
    "2 descent steps, 30 generations": {"descent_steps": 2, "generations": 30, "tol_loss": 5e-3},
    "CMA-ES alone, diagonal": {"descent_steps": 0, "generations": 200},
    "CMA-ES alone, full": {"descent_steps": 0, "generations": 200, "covariance": "full"},
    "CMA-ES alone, low rank": {"descent_steps": 0, "generations": 200, "covariance": "low_rank"},
    "CMA-ES alone, sigma 0.2": {"descent_steps": 0, "generations": 200, "sigma_rad": 0.2},
    "CMA-ES alone, population 25": {"descent_steps": 0, "generations": 400, "population": 25},
    "CMA-ES alone, population 200": {"descent_steps": 0, "generations": 50, "population": 200},
    "descent alone": {"descent_steps": 12, "generations": 0},
    "1 descent step": {"descent_steps": 1, "generations": 100},
    "2 descent steps": {"descent_steps": 2, "generations": 100},
    "4 descent steps": {"descent_steps": 4, "generations": 100},
    "4 descent steps, low rank": {"descent_steps": 4, "generations": 100, "covariance": "low_rank"},
    "4 descent steps, full": {"descent_steps": 4, "generations": 100, "covariance": "full"},
    "4 descent steps, spread 0.1": {"descent_steps": 4, "generations": 100, "spread": 0.1},
    "4 descent steps, spread 0.02": {"descent_steps": 4, "generations": 100, "spread": 0.02},
    "4 descent steps, racing": {"descent_steps": 4, "generations": 100},
    "4 descent steps, restarts": {"descent_steps": 4, "generations": 100},
    "4 descent steps, knots from zero": {"descent_steps": 4, "generations": 100},
}
PAPER = {"descent_steps": 0, "generations": 2000, "population": 100, "covariance": "full", "sigma_rad": 0.1}


def main() -> None:
    """Study, or plot a study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path)
    parser.add_argument("-o", dest="output", type=Path)
    parser.add_argument("--clips", nargs="+", default=["walk", "kick", "roll"])
    parser.add_argument("--ways", nargs="+", default=list(WAYS), choices=list(WAYS))
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--paper", action="store_true")
    parser.add_argument("--plot", nargs=2, type=Path, metavar=("JSON", "PNG"))
    options = parser.parse_args()
    if options.plot:
        plot(json.loads(options.plot[0].read_text(encoding="utf-8")), options.plot[1])
        return
    if options.data is None or options.output is None:
        parser.error("--data and -o are needed")
    ways = {name: WAYS[name] for name in options.ways}
    if options.paper:
        ways |= {"paper": PAPER}
    rows = []
    for clip in options.clips:
        problem, window, handover = task(options.data, clip, options.threads, options.paper)
        for name, changes in ways.items():
            began = time.perf_counter()
            steps, losses = search(problem, window, handover, name, changes, options.threads)
            rows.append({"clip": clip, "way": name, "steps": steps.tolist(), "loss": losses.tolist()})
            progress = f"{losses[0]:9.1f} → {losses[-1]:8.2f}  {steps[-1] / 1e3:7.0f} k steps"
            print(f"{clip:10} {name:34} {progress}  {time.perf_counter() - began:5.1f} s", flush=True)
    print(table(rows))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(
        json.dumps({"rows": rows, "plan": asdict(plan.read("default"))}), encoding="utf-8"
    )


def task(data: Path, clip: str, threads: int, paper: bool) -> tuple[Problem, Window, Handover]:
    """The window that begins at `START_S`, and what plan `default` hands over to it."""
    settings = plan.read("default")
    settings = replace(settings, loss=replace(settings.loss, landmark_velocity=0.0))
    fit, seen = bench.load(data, clip, settings, noisy=False)
    problem = bench.laid_out(fit, seen, settings)
    clock = problem.clock
    handover, sampler = warm_start.from_fit(problem), Sampler(problem, threads)
    for window in schedule.cut(clock, settings):
        if window.start_step * clock.step_s >= START_S:
            break
        handover = sampler.solve(window, handover, np.random.default_rng([0, window.index])).handover
    if paper:
        problem = bench.laid_out(fit, seen, replace(settings, loss=plan.read("paper").loss))
    return problem, window, handover


def search(
    problem: Problem, window: Window, handover: Handover, name: str, changes: dict[str, Any], threads: int
) -> tuple[Array, Array]:
    """Simulation steps and best loss so far, from the warm start on."""
    optimiser = replace(problem.plan.optimiser, **(BASE | changes))
    settings: Plan = replace(problem.plan, optimiser=optimiser)
    problem = replace(problem, plan=settings)
    if "from zero" in name:
        handover = replace(handover, knots_rad=0.0 * handover.knots_rad)
    if "racing" in name:
        return _by_hand(problem, window, handover, threads, _race)
    if "restarts" in name:
        return _by_hand(problem, window, handover, threads, _restart)
    result = Sampler(problem, threads).solve(window, handover, np.random.default_rng(0))
    return result.steps.astype(float), result.trace


Generation = Callable[[Search, Task, Descent, list[float]], tuple[Search, float]]


def _by_hand(
    problem: Problem, window: Window, handover: Handover, threads: int, generation: Generation
) -> tuple[Array, Array]:
    """As the engine, but with another kind of generation, which says how many steps it took."""
    simulator, work = Sampler(problem, threads).simulator, Task(problem, window, handover)
    descent = Descent.begin(work, simulator, work.warm_start()[None])
    steps, losses = [float(simulator.steps)], [descent.loss]
    for _ in range(problem.plan.optimiser.descent_steps):
        descent.step()
        steps.append(float(simulator.steps))
        losses.append(descent.loss)
    state = Search(descent, np.random.default_rng(0))
    since = [state.loss]
    optimiser, length = problem.plan.optimiser, window.end_step - window.start_step + 1
    most = steps[-1] + optimiser.generations * optimiser.population * length
    while steps[-1] < most:
        state, spent = generation(state, work, descent, since)
        since.append(state.loss)
        steps.append(steps[-1] + spent)
        losses.append(state.loss)
    return np.array(steps), np.array(losses)


def _race(state: Search, work: Task, _descent: Descent, _since: list[float]) -> tuple[Search, float]:
    """All samples over the first half of the window, the better ones over the second."""
    clock = work.problem.clock
    middle = (work.window.start_step + work.window.end_step) // (2 * clock.stride) * clock.stride
    half = Task(work.problem, replace(work.window, end_step=middle), work.handover)
    samples = state.es.ask()
    rows, count = half.shape[0] * half.shape[1], len(samples)
    terms, finite = half.evaluate(state.simulator, state.unknowns(samples)[:, :rows])
    first = np.where(finite, sum(terms.values()), np.inf)
    order = np.argsort(first)
    kept, lost = np.split(order, [int(RACE_KEPT * count)])
    total = np.empty(count)
    total[kept] = state.consider(samples[kept])
    worst = np.max(total[kept][np.isfinite(total[kept])], initial=0.0)
    total[lost] = worst + 1.0 + np.arange(len(lost))
    state.es.tell(samples, total)
    length = work.window.end_step - work.window.start_step + 1
    ahead = middle - work.window.start_step
    return state, float(count * ahead + len(kept) * (length - ahead))


def _restart(state: Search, work: Task, descent: Descent, since: list[float]) -> tuple[Search, float]:
    """A plain generation; at rest, begin again from the best point with twice the population (IPOP)."""
    recent = since[-PATIENCE - 1 :]
    if len(recent) > PATIENCE and recent[0] - recent[-1] <= 5e-3 * recent[-1]:
        optimiser = replace(work.problem.plan.optimiser, population=2 * state.es.population)
        doubled = replace(work.problem, plan=replace(work.problem.plan, optimiser=optimiser))
        task = Task(doubled, work.window, work.handover)
        best = replace(descent, task=task, x=state.x, loss=state.loss, terms=state.terms)
        state = Search(best, np.random.default_rng(state.es.population))
        since.clear()
    before = state.simulator.steps
    state.generation()
    return state, float(state.simulator.steps - before)


def table(rows: list[dict[str, Any]]) -> str:
    """Loss over that of the first way, by clip and in the geometric mean, and where each way crosses it."""
    clips = list(dict.fromkeys(row["clip"] for row in rows))
    ends = {clip: next(row for row in rows if row["clip"] == clip)["loss"][-1] for clip in clips}
    lines = ["| way | " + " | ".join(clips) + " | mean | 10³ steps | 10³ steps to the first way's loss |"]
    lines.append("|---" * (len(clips) + 4) + "|")
    for way in dict.fromkeys(row["way"] for row in rows):
        own = [row for row in rows if row["way"] == way]
        ratios = [row["loss"][-1] / ends[row["clip"]] for row in own]
        reached = [_reached(row, ends[row["clip"]]) for row in own]
        cells = " | ".join(f"{ratio:.2f}" for ratio in ratios)
        mean = float(np.exp(np.mean(np.log(ratios))))
        spent = np.mean([row["steps"][-1] for row in own]) / 1e3
        when = ", ".join("–" if value is None else f"{value / 1e3:.0f}" for value in reached)
        lines.append(f"| {way} | {cells} | {mean:.2f} | {spent:.0f} | {when} |")
    return "\n".join(lines)


def _reached(row: dict[str, Any], loss: float) -> float | None:
    below = np.flatnonzero(np.array(row["loss"]) <= loss)
    return float(row["steps"][below[0]]) if below.size else None


def plot(study: dict[str, Any], path: Path) -> None:
    """Loss against steps, one panel per clip."""
    from matplotlib import pyplot

    clips = list(dict.fromkeys(row["clip"] for row in study["rows"]))
    figure, axes = pyplot.subplots(1, len(clips), figsize=(5 * len(clips), 4.2), squeeze=False)
    for axis, clip in zip(axes[0], clips, strict=True):
        for number, row in enumerate(row for row in study["rows"] if row["clip"] == clip):
            style = ("-", "--", ":")[number // 10 % 3]
            axis.loglog(np.array(row["steps"]) / 1e3, row["loss"], style, label=row["way"], lw=1.2)
        axis.set(title=clip, xlabel="simulation steps, thousands", ylabel="best loss")
        axis.grid(alpha=0.3, which="both")
    axes[0, -1].legend(fontsize=6)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
