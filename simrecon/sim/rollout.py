"""Parallel MuJoCo rollouts of a population, on a pool of threads."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from queue import SimpleQueue
from threading import Lock
from typing import TypeVar

import mujoco
import mujoco.batch
import numpy as np
from numpy.typing import NDArray

from simrecon.sim.address import locate
from simrecon.sim.apart import Colleague
from simrecon.sim.derivatives import Transitions, transitions
from simrecon.sim.felt import Felt, means
from simrecon.sim.inverse import Inverse
from simrecon.sim.quiet import unlogged
from simrecon.sim.state import component
from simrecon.system import processor
from simrecon.types import Array, IntArray

PIECES = 4
"""Parts into which samples are cut: more would cost more calls, fewer would leave threads to wait."""

Item = TypeVar("Item")
Found = TypeVar("Found")

Threads = int | Callable[[], int]
"""Number of threads, 0 for one per core; or a function that says it, called before each generation."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """What P rollouts did at F steps each, in the order of the controls.

    Attributes:
        qpos: (P, F, nq) of the person; points_m: (P, F, M, 3) sites; com_m: (P, F, 3).
        finite: (P,) False where a rollout diverged; its arrays then mean nothing.
        wrenches: (P, F, K, 6) moment about the world's origin, and force, of the scene on K bodies that are
            felt, mean since the step before in F; zero at the first.
    """

    qpos: Array
    points_m: Array
    com_m: Array
    finite: NDArray[np.bool_]
    wrenches: Array


class Simulator:
    """Rolls populations out, on a pool of threads.

    Work comes in pieces (`each`), so that one thread takes losses while another one steps. Results don't
    depend on the number of threads. `seconds` and `steps` add up what was spent in MuJoCo: seconds of all
    threads over their number.

    Attributes:
        colleagues: processes that help with derivatives, made when they are first asked for.
    """

    def __init__(
        self, model: mujoco.MjModel, population: int, threads: Threads = 0, felt: Felt | None = None
    ) -> None:
        """Make room for `population` rollouts on `threads` threads (0: one for each core)."""
        self.model, self.person, self.population = model, locate(model), population
        self.felt = felt or Felt(model, ())
        self.inverse = Inverse(model, self.felt.bodies)
        self.seconds = 0.0
        self.steps = 0
        self._wanted, self._threads = threads, 0
        self._counting = Lock()
        self.colleagues = list[Colleague]()
        self._follow()

    @property
    def threads(self) -> int:
        """How many there are now."""
        return self._threads

    def each(self, work: Callable[[Item], Found], items: Iterable[Item]) -> list[Found]:
        """What `work` gives for each item, in their order.

        `work` is called by several threads at a time, and may call `run` but not `each`. An exception of one
        call is raised when no other one goes on.
        """
        self._follow()
        with unlogged():
            if self._pool is None:
                return [work(item) for item in items]
            futures = [self._pool.submit(work, item) for item in items]
            try:
                return [one.result() for one in futures]
            finally:
                for one in futures:
                    one.cancel()
                wait(futures)

    def run(self, state: Array, ctrl: Array, at_steps: IntArray) -> Rollouts:
        """Roll out; outside of `each` on the threads of one worker only.

        Args:
            state: (nstate,) where all rollouts start, or (P, nstate).
            ctrl: (P, N, nu); P may be below the population, N at least max(at_steps) + 1.
            at_steps: (F,) steps to read; step s is the state after s controls, step 0 the start.

        Returns:
            The rollouts at those steps.
        """
        free = self._free
        worker = free.get()
        try:
            began = time.perf_counter()
            with unlogged():
                out, finite = worker.run(state, ctrl)
            spent = (time.perf_counter() - began) * worker.batch.nthread / self._threads
            points, com = out["site_xpos"][:, at_steps], out["subtree_com"][:, at_steps, self.person.body]
            qpos = out["qpos"][:, np.maximum(at_steps - 1, 0), : self.person.nq]
            wrenches = self._felt(out, at_steps)
        finally:
            free.put(worker)
        with self._counting:
            self.seconds += spent
            self.steps += ctrl.shape[0] * ctrl.shape[1]
        # A recorded derived field describes the state before its step, a recorded state the one after it.
        first = component(self.model, np.atleast_2d(state), mujoco.mjtState.mjSTATE_QPOS)
        qpos[:, at_steps == 0] = first[:, None, : self.person.nq]
        return Rollouts(qpos, points, com, finite, wrenches)

    def _felt(self, out: dict[str, Array], at_steps: IntArray) -> Array:
        """`Rollouts.wrenches`."""
        if not self.felt.bodies:
            return np.zeros((len(out["qpos"]), len(at_steps), 0, 6))
        return means(self.felt.wrenches(out["sensordata"]), at_steps)

    def transitions(self, states: Array, ctrl: Array) -> list[Transitions]:
        """Derivatives of consecutive steps, in pieces; processes of their own help with them (`apart`).

        Args:
            states: (N + 1, nstate) full states of a trajectory.
            ctrl: (N, nu) the control that led from each to the next.
        """
        self._follow()
        parts = pieces(len(ctrl), len(ctrl))
        helping = self._help(min(self._threads, len(parts)) - 1)
        shares = [parts[place :: 1 + len(helping)] for place in range(1 + len(helping))]

        def own(part: slice) -> Transitions:
            return transitions(self.inverse, states[part.start : part.stop + 1], ctrl[part])

        found = dict[int, Transitions]()
        with unlogged():  # threads of one Python would wait for each other
            asked = [
                one for one, share in zip(helping, shares[1:], strict=True) if one.ask(states, ctrl, share)
            ]
            for part in shares[0]:
                found[part.start] = own(part)
            for one in asked:
                found |= one.answer()
            return [found.get(part.start) or own(part) for part in parts]

    def _help(self, count: int) -> list[Colleague]:
        """So many colleagues, less those that have not started yet."""
        while len(self.colleagues) < count:
            self.colleagues.append(Colleague(self.inverse))
        return [one for one in self.colleagues[:count] if one.ready]

    def _follow(self) -> None:
        """Take up the number of threads that is wanted now: workers, each with its share."""
        number = self._wanted() if callable(self._wanted) else self._wanted
        threads = number or processor.cores()
        if threads == self._threads:
            return
        count, free = min(threads, PIECES), SimpleQueue[_Worker]()
        for worker in range(count):
            own = threads // count + (worker < threads % count)
            free.put(_Worker(mujoco.batch.Batch(self.felt.model, self.population, own)))
        self._free, self._pool = free, ThreadPoolExecutor(count) if count > 1 else None
        self._threads = threads


class _Worker:
    """What one thread of Python's rolls out with: a batch, and room to record into."""

    def __init__(self, batch: mujoco.batch.Batch) -> None:
        model, self.batch = batch.model, batch
        self._shapes = {"qpos": (model.nq,), "site_xpos": (model.nsite, 3), "subtree_com": (model.nbody, 3)}
        if model.nsensordata:
            self._shapes["sensordata"] = (model.nsensordata,)
        self._room = {name: np.empty(0) for name in self._shapes}

    def run(self, state: Array, ctrl: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        """Fields (P, N, ...), which the next call overwrites, and which rollouts stayed finite (P,)."""
        count, steps = ctrl.shape[:2]
        self.batch.state[:count] = state
        # A rollout that diverges is reset, and its counter is one again: it would not rise above an old one.
        self.batch.warning[:count] = 0
        out = {name: self._record(name, (count, steps, *shape)) for name, shape in self._shapes.items()}
        self.batch.rollout(steps, ctrl, record=tuple(out), ids=np.arange(count), out=out)
        warned = self.batch.warning[:count, :, 1].any(axis=1)
        return out, ~warned & np.isfinite(self.batch.state[:count]).all(axis=1)

    def _record(self, name: str, shape: tuple[int, ...]) -> Array:
        size = math.prod(shape)
        if len(self._room[name]) < size:
            self._room[name] = np.empty(size)
        return self._room[name][:size].reshape(shape)


def pieces(count: int, most: int) -> list[slice]:
    """So many samples in `PIECES` parts, or more of at most `most`: the same for any number of threads."""
    parts = min(max(PIECES, -(-count // most)), count)
    ends = [count * part // parts for part in range(parts + 1)]
    return [slice(*part) for part in itertools.pairwise(ends)]
