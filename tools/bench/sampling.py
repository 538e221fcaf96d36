"""How well and how fast the sampling engine tracks clean references and noisy evidence.

usage: python -m tools.bench.sampling --data DATA -o OUT [--plan NAME] [--clips NAME ...]
                                      [--noisy | --feasible | --halfway] [--seeds N ...] [--threads N]
                                      [--set SECTION.KEY=VALUE ...]
       python -m tools.bench.sampling --compare A.json B.json

DATA holds `mocap/deepmimic`, and `evidence` for --noisy. Writes OUT/PLAN-WHEN.json and prints the same as a
table. Bare stepping is `mujoco.batch` alone: the same model, states and controls, one piece in so many of the
engine's own, those of one length in one batch, right after the clip; so the ratio of the two speeds does not
depend on how fast the machine is.

--feasible tracks what the engine did when it tracked the clip: a motion that this body can do, so that the
error is the engine's alone. `tools/study/feasibility.py` tells what the clips ask for beyond that.

--halfway tracks what lies half way between the clip and what the engine did of it. If that is the nearest
motion to the clip that the body can do, it is the nearest to what lies half way too: the error halves, and
the distance from the clip stays.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
import tomllib
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import mujoco.batch
import numpy as np

import simrecon
from simrecon import evidence, kinematics, plan, planners, schedule
from simrecon.engines import problem as problems
from simrecon.engines import warm_start
from simrecon.engines import windows as engine
from simrecon.engines.problem import Problem
from simrecon.engines.sampling.sampler import Sampler
from simrecon.evidence import resample
from simrecon.geometry import rotations
from simrecon.plan import Plan, overridden
from simrecon.sim import rollout
from simrecon.sim.quiet import unlogged
from simrecon.sim.state import component
from simrecon.types import Array, Evidence, IntArray, KinematicFit, Scene, WindowResult
from tools.bench import references

COLUMNS = {
    "mpjpe_g_mm": "MPJPE-G, mm",
    "from_clip_mm": "from the clip",
    "loss": "loss",
    "generations": "generations",
    "rollouts": "rollouts",
    "steps": "steps",
    "s_per_s": "s per s",
    "stepping_share": "in MuJoCo",
    "steps_per_s": "steps/s",
    "bare_ratio": "of bare",
}

Batch = tuple[Array, Array]
"""States (P, nstate) and controls (P, N, nu)."""
EVERY = 20
JOINTS = tuple(
    f"{side}_{joint}"
    for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    for side in ("left", "right")
)


@dataclass(frozen=True)
class Row:
    """One clip with one seed.

    Attributes:
        mpjpe_g_mm: mean distance of hips, knees, ankles, shoulders, elbows and wrists from what was to be
            tracked, not root-aligned. from_clip_mm: from the clip, where that was not what was tracked.
        loss: mean over windows. generations, rollouts, steps: sums, without those of a draft.
        s_per_s: wall time per second of motion. stepping_share: of it, within MuJoCo.
        steps_per_s: simulation steps by wall time; bare_ratio: as a share of bare stepping.
        ended: windows by the rule that ended them.
    """

    clip: str
    seed: int
    mpjpe_g_mm: float
    from_clip_mm: float
    loss: float
    generations: int
    rollouts: int
    steps: int
    s_per_s: float
    stepping_share: float
    steps_per_s: float
    bare_ratio: float
    ended: dict[str, int]


def main() -> None:
    """Run, or compare two runs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path)
    parser.add_argument("-o", dest="output", type=Path)
    parser.add_argument("--plan", default="default")
    parser.add_argument("--clips", nargs="+", default=references.CLIPS)
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--noisy", action="store_true", help="track fits of evidence/synth_*.npz instead")
    kind.add_argument("--feasible", action="store_true", help="track what the engine did of the clip instead")
    kind.add_argument("--halfway", action="store_true", help="track the middle of that and the clip instead")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--set", nargs="+", default=[], metavar="SECTION.KEY=VALUE", help="change the plan")
    parser.add_argument("--compare", nargs=2, type=Path)
    options = parser.parse_args()
    if options.compare:
        compare(*(json.loads(path.read_text(encoding="utf-8")) for path in options.compare))
        return
    if options.data is None or options.output is None:
        parser.error("--data and -o are needed")
    settings = changed(plan.read(options.plan), options.set)
    print("| clip | seed | " + " | ".join(COLUMNS.values()) + " |")
    print("|---" * (len(COLUMNS) + 2) + "|")
    rows = []
    for clip in options.clips:
        fit, seen = load(options.data, clip, settings, options.noisy)
        tracked = fit
        if options.feasible or options.halfway:
            tracked = feasible(fit, seen, settings, options.threads)
        if options.halfway:
            tracked = middle(fit, tracked)
        for seed in options.seeds:
            rows.append(run(fit, tracked, seen, settings, clip, seed, options.threads))
            print(text(rows[-1]), flush=True)
    options.output.mkdir(parents=True, exist_ok=True)
    header = {
        "simrecon": simrecon.__version__,
        "mujoco": mujoco.__version__,
        "plan": asdict(settings),
        "noisy": options.noisy,
        "feasible": options.feasible,
        "halfway": options.halfway,
    }
    path = options.output / f"{Path(options.plan).stem}-{time.strftime('%Y%m%dT%H%M%S')}.json"
    path.write_text(json.dumps(header | {"rows": [asdict(row) for row in rows]}, indent=1), encoding="utf-8")
    print(f"\n{path}")


def load(data: Path, clip: str, settings: Plan, noisy: bool) -> tuple[KinematicFit, Evidence]:
    """What is to be tracked: a clean reference, or the fit of noisy evidence."""
    if noisy:
        uniform, _ = resample(evidence.read(data / "evidence" / f"synth_{clip}.npz"))
        return kinematics.fit(uniform, Scene(), settings.kinematics), uniform
    fit = references.read(data / "mocap" / "deepmimic", clip)
    count = len(fit.times_s)
    unseen = Evidence(
        times_s=fit.times_s,
        keypoint_names=(),
        keypoints_px=np.zeros((count, 0, 2)),
        scores=np.zeros((count, 0)),
        joint_names=(),
        joints_m=np.zeros((count, 0, 3)),
        joints_frame="world",
    )
    return fit, unseen


def laid_out(fit: KinematicFit, seen: Evidence, settings: Plan) -> Problem:
    """The problem of tracking a fit as it is."""
    clock = schedule.clock(fit.times_s, settings.simulation.timestep_max_s)
    return problems.pose(fit, planners.plan("none", fit, seen, settings), seen, clock, settings)


def track(
    fit: KinematicFit, seen: Evidence, settings: Plan, seed: int, threads: int
) -> tuple[Sampler, tuple[WindowResult, ...], Array, list[Batch]]:
    """Solve a clip: the engine, its windows, the person's configurations (T, nq), and some of its batches."""
    problem = laid_out(fit, seen, settings)
    windows, handover = schedule.cut(problem.clock, settings), warm_start.from_fit(problem)
    sampler = Sampler(problem, threads)
    sampler.prepare(windows, handover)
    batches = record(sampler.simulator)
    results = engine.solve(sampler, windows, handover, seed)
    if not results:
        raise SystemExit("the first window fell, whatever was tried")
    states = np.concatenate([results[0].states[:1]] + [result.states[1:] for result in results])
    qpos = component(problem.model, states, mujoco.mjtState.mjSTATE_QPOS)
    return sampler, results, qpos[:: problem.clock.stride, : fit.qpos.shape[1]], batches


def feasible(fit: KinematicFit, seen: Evidence, settings: Plan, threads: int) -> KinematicFit:
    """What the engine does of a clip, as the next thing to be tracked."""
    _, _, qpos, _ = track(fit, seen, settings, 0, threads)
    count = len(qpos)
    return replace(
        fit,
        qpos=qpos,
        com_m=kinematics.configurations(fit.body, qpos)[0],
        times_s=fit.times_s[:count],
        reprojection_px=fit.reprojection_px[:count],
        interpolated=fit.interpolated[:count],
    )


def middle(clip: KinematicFit, done: KinematicFit) -> KinematicFit:
    """Half way from a clip to what was done of it."""
    a, b = clip.qpos[: len(done.qpos)], done.qpos
    turned = rotations.slerp(a[:, 3:].reshape(len(b), -1, 4), b[:, 3:].reshape(len(b), -1, 4), 0.5)
    qpos = np.concatenate(((a[:, :3] + b[:, :3]) / 2, turned.reshape(len(b), -1)), axis=1)
    return replace(done, qpos=qpos, com_m=kinematics.configurations(clip.body, qpos)[0])


def distance_mm(fit: KinematicFit, qpos: Array) -> float:
    """Mean distance of the limbs' joints from what was to be done."""
    rows = [fit.body.skeleton.point_names.index(name) for name in JOINTS]
    done, target = (kinematics.configurations(fit.body, q)[1][:, rows] for q in (qpos, fit.qpos[: len(qpos)]))
    return 1e3 * float(np.linalg.norm(done - target, axis=-1).mean())


def run(
    clip_fit: KinematicFit,
    fit: KinematicFit,
    seen: Evidence,
    settings: Plan,
    clip: str,
    seed: int,
    threads: int,
) -> Row:
    """Track `fit`, which is the clip or has come of it."""
    began = time.perf_counter()
    sampler, results, qpos, batches = track(fit, seen, settings, seed, threads)
    wall_s = time.perf_counter() - began
    problem, simulator = sampler.problem, sampler.simulator
    speed = simulator.steps / wall_s
    endings = [result.status.name.lower() for result in results]
    return Row(
        clip=clip,
        seed=seed,
        mpjpe_g_mm=distance_mm(fit, qpos),
        from_clip_mm=distance_mm(clip_fit, qpos),
        loss=float(np.mean([result.loss for result in results])),
        generations=sum(len(result.trace) - 1 - result.descent_steps for result in results),
        rollouts=sum(result.evaluations for result in results),
        steps=simulator.steps,
        s_per_s=wall_s / (problem.clock.steps * problem.clock.step_s),
        stepping_share=simulator.seconds / wall_s,
        steps_per_s=speed,
        bare_ratio=speed / bare_speed(problem, batches, threads),
        ended={ending: endings.count(ending) for ending in sorted(set(endings))},
    )


def record(simulator: rollout.Simulator) -> list[Batch]:
    """A list that grows with states and controls of every `EVERY`-th piece that a simulator rolls out."""
    run, kept, calls = simulator.run, list[Batch](), itertools.count(1)

    def recorded(state: Array, ctrl: Array, at_steps: IntArray) -> rollout.Rollouts:
        if next(calls) % EVERY == 0:
            kept.append((np.broadcast_to(state, (len(ctrl), state.shape[-1])).copy(), ctrl.copy()))
        return run(state, ctrl, at_steps)

    simulator.run = recorded  # type: ignore[method-assign]
    return kept


def bare_speed(problem: Problem, batches: Iterable[Batch], threads: int) -> float:
    """Steps per second of `mujoco.batch` alone, all recorded rollouts of one length at a time."""
    by_length: dict[int, list[Batch]] = {}
    for state, ctrl in batches:
        by_length.setdefault(ctrl.shape[1], []).append((state, ctrl))
    seconds, steps = 0.0, 0
    for length, own in by_length.items():
        states, ctrls = (np.concatenate(part) for part in zip(*own, strict=True))
        batch = mujoco.batch.Batch(problem.model, len(ctrls), threads)
        batch.state[:] = states
        began = time.perf_counter()
        with unlogged():
            batch.rollout(length, ctrls)
        seconds += time.perf_counter() - began
        steps += ctrls.shape[0] * length
    return steps / seconds


def changed(settings: Plan, changes: list[str]) -> Plan:
    """The plan with `section.key=value` changed."""
    pairs = (change.split("=", 1) for change in changes)
    return overridden(settings, {place: _toml(value) for place, value in pairs}, "--set")


def _toml(value: str) -> Any:
    """A value as TOML has it; bare words are texts."""
    try:
        return tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return value


def text(row: Row) -> str:
    """A row of the table."""
    numbers = (getattr(row, key) for key in COLUMNS)
    cells = (
        f"{value:.2f}" if 0 < value < 1 else f"{value:.1f}" if isinstance(value, float) else f"{value}"
        for value in numbers
    )
    return f"| {row.clip} | {row.seed} | " + " | ".join(cells) + " |"


def compare(first: dict[str, Any], second: dict[str, Any]) -> None:
    """Print ratios second / first of the means over seeds, by clip."""
    keys = ("mpjpe_g_mm", "loss", "steps", "s_per_s", "bare_ratio")
    print("| clip | " + " | ".join(COLUMNS[key] for key in keys) + " |")
    print("|---" * (len(keys) + 1) + "|")
    clips = list(dict.fromkeys(row["clip"] for row in first["rows"]))
    for clip in clips:
        before, after = (means(side["rows"], clip, keys) for side in (first, second))
        if after.size:
            cells = (f"{a:.3g} → {b:.3g} ({b / a:.2f})" for a, b in zip(before, after, strict=True))
            print(f"| {clip} | " + " | ".join(cells) + " |")


def means(rows: list[dict[str, Any]], clip: str, keys: Iterable[str]) -> Array:
    """Means over seeds, empty if the clip is not there."""
    own = [[row[key] for key in keys] for row in rows if row["clip"] == clip]
    return np.mean(own, axis=0) if own else np.zeros(0)


if __name__ == "__main__":
    main()
