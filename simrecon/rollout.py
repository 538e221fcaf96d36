"""Parallel MuJoCo rollouts, and the plain loop that commits and replays them bit for bit."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import mujoco.batch
import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array, IntArray

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)

Threads = int | Callable[[], int]
"""Number of threads, 0 for one per core; or what says it, asked before every rollout."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """What P rollouts did at F steps each, in the order of the controls.

    Attributes:
        qpos: (P, F, nq) of the person; points_m: (P, F, M, 3) sites; com_m: (P, F, 3).
        finite: (P,) False where a rollout diverged; its arrays then mean nothing.
    """

    qpos: Array
    points_m: Array
    com_m: Array
    finite: NDArray[np.bool_]


@dataclass(frozen=True)
class Person:
    """Where the person lies in a model: the first tree of bodies, before all things that move.

    Attributes:
        body: id of the pelvis.
        nq, nv: qpos[:nq] and qvel[:nv] are the person's.
    """

    body: int
    nq: int
    nv: int


def person(model: mujoco.MjModel) -> Person:
    """The person's share of the coordinates: that of the first joint's tree."""
    root = int(model.body_rootid[model.jnt_bodyid[0]])
    own = model.body_rootid[model.jnt_bodyid] == root  # (njnt,)
    count = int(own.sum())
    if count == model.njnt:
        return Person(root, model.nq, model.nv)
    return Person(root, int(model.jnt_qposadr[count]), int(model.jnt_dofadr[count]))


def with_things(model: mujoco.MjModel, qpos: Array) -> Array:
    """Configurations (T, nq) of the model: the person's (T, person nq), and all that moves at rest."""
    rest = model.qpos0[person(model).nq :]
    return np.concatenate((qpos, np.broadcast_to(rest, (len(qpos), len(rest)))), axis=1)


class Simulator:
    """Rolls a population out from one state, on a pool of threads.

    Results don't depend on the number of threads. `seconds` and `steps` add up what was spent in MuJoCo.
    """

    def __init__(self, model: mujoco.MjModel, population: int, threads: Threads = 0) -> None:
        """Make room for `population` rollouts on `threads` threads (0: one for each core)."""
        self.model, self.person, self.population = model, person(model), population
        self._wanted = threads
        self._threads = threads() if callable(threads) else threads
        self.batch = mujoco.batch.Batch(model, population, self._threads)
        self.seconds = 0.0
        self.steps = 0
        self._out: dict[int, dict[str | int, NDArray[np.float64]]] = {}

    def run(self, state: Array, ctrl: Array, at_steps: IntArray) -> Rollouts:
        """Roll out.

        Args:
            state: (nstate,) where all rollouts start, or (P, nstate).
            ctrl: (P, N, nu); P may be below the population, N at least max(at_steps) + 1.
            at_steps: (F,) steps to read; step s is the state after s controls, step 0 the start.

        Returns:
            The rollouts at those steps.
        """
        self._follow()
        count, steps = ctrl.shape[:2]
        ids = np.arange(count)
        self.batch.state[:count] = state
        # A rollout that diverges is reset, and its counter is one again: it would not rise above an old one.
        self.batch.warning[:count] = 0
        # Reuse of the buffers is safe: what is read at `at_steps` is a copy.
        out = self._out.setdefault(steps, {}) if count == self.batch.nsim else {}
        started = time.perf_counter()
        record = ("qpos", "site_xpos", "subtree_com")
        with unlogged():
            out.update(self.batch.rollout(steps, ctrl, record=record, ids=ids, out=out))
        self.seconds += time.perf_counter() - started
        self.steps += count * steps
        # A recorded derived field describes the state before its step, a recorded state the one after it.
        first = component(self.model, np.atleast_2d(state), mujoco.mjtState.mjSTATE_QPOS)
        started_at = (at_steps == 0)[None, :, None]
        qpos = np.where(started_at, first[:, None], out["qpos"][:, np.maximum(at_steps - 1, 0)])
        points, com = out["site_xpos"][:, at_steps], out["subtree_com"][:, at_steps, self.person.body]
        warned = self.batch.warning[:count, :, 1].any(axis=1)
        finite = ~warned & np.isfinite(self.batch.state[:count]).all(axis=1)
        return Rollouts(qpos[..., : self.person.nq], points, com, finite)

    def _follow(self) -> None:
        """Take up another number of threads, if it is another now."""
        threads = self._wanted() if callable(self._wanted) else self._threads
        if threads != self._threads:
            self._threads = threads
            self.batch = mujoco.batch.Batch(self.model, self.population, threads)
            self._out.clear()


def initial_state(model: mujoco.MjModel, qpos: Array, qvel: Array) -> Array:
    """Full integration state (nstate,) at rest of everything but qpos (nq,) and qvel (nv,)."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    return get_state(model, data)


def get_state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """The full integration state (nstate,) of `data`."""
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def set_state(model: mujoco.MjModel, data: mujoco.MjData, state: Array) -> None:
    """Put `data` into a full integration state (nstate,)."""
    mujoco.mj_setState(model, data, state, STATE)


def forward(model: mujoco.MjModel, state: Array) -> mujoco.MjData:
    """Data with all position- and velocity-dependent fields of a full state computed."""
    data = mujoco.MjData(model)
    set_state(model, data, state)
    mujoco.mj_forward(model, data)
    return data


def replay(model: mujoco.MjModel, state: Array, ctrl: Array) -> Array:
    """States (N + 1, nstate) of a plain mj_step loop under ctrl (N, nu), the first included."""
    data = mujoco.MjData(model)
    set_state(model, data, state)
    states = [get_state(model, data)]
    with unlogged():
        for row in ctrl:
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
            states.append(get_state(model, data))
    return np.stack(states)


@contextlib.contextmanager
def unlogged() -> Iterator[None]:
    """Keep MuJoCo from writing a line to stderr and MUJOCO_LOG.TXT for every rollout that diverges.

    The setting is the process's: who rolls out on several threads of Python's does so within one of these.
    """
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_console = quiet.logto_file = False
    quiet.set()
    try:
        yield
    finally:
        before.set()


def component(model: mujoco.MjModel, states: Array, which: mujoco.mjtState) -> Array:
    """One component, such as `mjSTATE_QPOS`, of full states (..., nstate)."""
    bit = int(which)
    start = mujoco.mj_stateSize(model, STATE & (bit - 1))
    return states[..., start : start + mujoco.mj_stateSize(model, bit)]


def velocities(model: mujoco.MjModel, qpos: Array, interval_s: float) -> Array:
    """Velocities (T, nv) of configurations (T, nq) by finite differences: central, one-sided at the ends."""
    count = len(qpos)
    found = np.empty((count, model.nv))
    for frame in range(count):
        first, last = max(frame - 1, 0), min(frame + 1, count - 1)
        mujoco.mj_differentiatePos(model, found[frame], (last - first) * interval_s, qpos[first], qpos[last])
    return found
