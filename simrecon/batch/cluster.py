"""The worker processes: a cluster of this host's, made and closed here, or one that runs already.

It knows dask, as `connection` does, and no other module. Tasks return small tables; what happens meanwhile
comes as events.
"""

from __future__ import annotations

import contextlib
import importlib
import logging
import os
import queue
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from simrecon.batch import connection, survey, work
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Event, Places, check_alive
from simrecon.batch.work import Assignment
from simrecon.errors import InputError, SimreconError
from simrecon.io.provenance import code_digest
from simrecon.system import extras, processor, signals

SETTINGS = {
    # Nothing large is kept in memory, so a worker that grows is broken: end it, and let its clip fail alone.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
    # Retries are counted by the batch, which knows whether a clip got any further.
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.admin.tick.limit": "1h",
    # Whoever may use this machine could read there what runs; nobody needs it.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}
HOST = "host"
LOST = "the connection to the scheduler was lost; the same command goes on where it stopped"

_orders: dict[str, Any] = {"threads": {}, "stop": False}
"""In a worker: threads by clip, and whether to end after the next window."""


class Crew:
    """Worker processes.

    Attributes:
        inbox: what happened: events of tasks, and futures that are done.
    """

    def __init__(self, client: Any, topic: str, *, cores: int | None) -> None:
        """Listen to a topic; `cores`: that all workers share, None if each has its own."""
        self._client, self._topic, self._cores = client, topic, cores
        self._submitted = 0
        self._told: dict[str, tuple[str, int]] = {}
        self.inbox: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        client.subscribe_topic(topic, lambda event: self.inbox.put(("event", event[1])))

    def survey(self, clip: Clip) -> Any:
        """Start to find out what there is to do for a clip; its future comes to the inbox."""
        return self._submit(survey.survey, clip)

    def solve(self, job: Assignment) -> Any:
        """Start a job; its future comes to the inbox."""
        return self._submit(_solve, job, self._topic)

    def measure(self, clip: Clip, folder: str) -> Any:
        """Start to measure what a clip costs; its future comes to the inbox."""
        return self._submit(survey.measure, clip, folder)

    def _submit(self, function: Callable[..., Any], *arguments: Any) -> Any:
        self._submitted += 1
        name = f"{function.__name__.strip('_')}-{self._topic}-{self._submitted}"
        future = self._client.submit(function, *arguments, key=name, pure=False)
        future.add_done_callback(lambda done: self.inbox.put(("done", done)))
        return future

    def share(self, running: Mapping[str, Event], waiting: int, jobs: int) -> None:
        """Share the cores out among the clips that run.

        While clips wait, every place of the crew counts as taken, for it will be in a moment.

        Args:
            running: the event `started` of each clip.
            waiting: clips that wait.
            jobs: clips at once.
        """
        places: dict[str, list[str]] = {}
        for name, event in running.items():
            places.setdefault(HOST if self._cores else event["worker"], []).append(name)
        for names in places.values():
            event = running[names[0]]
            cores = self._cores or event["cores"]
            taken = max(len(names), min(jobs, cores)) if waiting else len(names)
            each, rest = divmod(cores, taken)
            for i, name in enumerate(sorted(names)):
                self._order(running[name]["worker"], name, max(1, each + (i < rest)))

    def _order(self, worker: str, name: str, threads: int) -> None:
        if self._told.get(name) != (worker, threads):
            self._told[name] = (worker, threads)
            self._client.run(
                _take_order, {name: threads}, False, workers=[worker], wait=False, on_error="ignore"
            )

    def stop(self) -> None:
        """Tell all workers to end after their next window."""
        self._client.run(_take_order, {}, True, wait=False, on_error="ignore")

    def pids(self) -> list[int]:
        """Process ids of the workers."""
        return list(self._client.run(os.getpid, on_error="ignore").values())

    def check(self, root: Path, run: str) -> None:
        """Check that all workers have this simrecon and see the batch's folder.

        Raises:
            InputError: one does not.
        """
        answers = self._client.run(_about, str(root), run, on_error="return")
        for worker, answer in answers.items():
            if not isinstance(answer, dict) or answer["code"] != code_digest():
                raise InputError(
                    f"--scheduler: the worker {worker} has no simrecon, or another version; install the same"
                )
            if not answer["sees"]:
                raise InputError(
                    f"--scheduler: the worker {worker} does not see {root}; give a shared folder"
                )


def died(future: Any) -> bool:
    """Whether a task ended because its worker process did."""
    return future.status == "error" and type(future.exception()).__name__ == "KilledWorker"


def need() -> tuple[Any, Any]:
    """The modules of dask.

    Raises:
        InputError: it is not installed.
    """
    return extras.load("distributed", "batch", "batch"), extras.load("dask", "batch", "batch")


@contextlib.contextmanager
def crew(run: str, jobs: int, scheduler: str | None, memory_bytes: int) -> Iterator[Crew]:
    """Worker processes for one batch.

    Args:
        run: id of the batch.
        jobs: processes of a local cluster.
        scheduler: address, or scheduler file, of a cluster that runs; None: a local one.
        memory_bytes: that a local worker may use, 0 for no limit.

    Raises:
        InputError: dask is not installed, or the cluster does not answer.
    """
    distributed, dask = need()
    topic = f"simrecon-{run}"
    with contextlib.ExitStack() as stack:
        with signals.deferred():  # dask leaves processes behind, and tracebacks, if it is interrupted here
            stack.enter_context(dask.config.set(SETTINGS))
            for name in ("distributed", "distributed.nanny", "distributed.scheduler", "distributed.client"):
                logging.getLogger(name).setLevel(logging.CRITICAL)
            client = stack.enter_context(connection.client(distributed, stack, jobs, scheduler, memory_bytes))
        try:
            yield Crew(client, topic, cores=processor.cores() if scheduler is None else None)
        finally:
            with signals.deferred():
                stack.close()


def value(future: Any) -> dict[str, Any]:
    """What a task returned.

    Raises:
        SimreconError: the scheduler is gone, and the task with it.
    """
    if future.status in ("cancelled", "lost"):
        raise SimreconError(LOST)
    answer: dict[str, Any] = future.result()
    return answer


def _solve(job: Assignment, topic: str) -> dict[str, Any]:
    """In a worker: solve, with the threads that the batch allows, and tell it of every window."""
    worker = importlib.import_module("distributed").get_worker()
    _orders["threads"].pop(job.clip.name, None)
    about = {"worker": worker.address, "cores": worker.state.nthreads}

    def tell(event: Event) -> None:
        worker.log_event(topic, {**event, **(about if event["event"] == "started" else {})})

    return work.solve(
        job,
        threads=lambda: _orders["threads"].get(job.clip.name, 1),
        tell=tell,
        stop=lambda: bool(_orders["stop"]),
    )


async def _take_order(threads: dict[str, int], stop: bool) -> None:
    """In a worker: take up what the batch says; dask waits for every function that is not a coroutine."""
    _orders["threads"].update(threads)
    _orders["stop"] = stop


def _about(root: str, run: str) -> dict[str, Any]:
    """In a worker: which simrecon it has, and whether it sees the batch's folder."""
    return {"code": code_digest(), "sees": check_alive(Places(Path(root)), run)}
