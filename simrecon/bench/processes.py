"""Processes that do the tasks of a suite, and end when it ends, however it does."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Generator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import Any, NoReturn

from simrecon.bench.execution import execute, failed
from simrecon.bench.task import BenchmarkTask
from simrecon.system import signals

ENDING_S = 20.0
"""How long a process may take to tidy up once it is told to end; a call of the simulator takes a second."""

LOST = "its worker ended early; run the suite again, which goes on"

Row = dict[str, Any]


def finished(work: list[BenchmarkTask], jobs: int) -> Generator[tuple[int, Row], None, None]:
    """Rows of the tasks by their index, as they finish, so many at once."""
    if jobs == 1:
        for index, task in enumerate(work):
            yield index, execute(task)
        return
    others = set(multiprocessing.active_children())
    with workers(jobs) as pool:
        try:
            waiting = {pool.submit(_execute, task): index for index, task in enumerate(work)}
            for future in as_completed(waiting):
                index = waiting[future]
                try:
                    yield index, future.result()
                except BrokenProcessPool:
                    yield index, failed(work[index], LOST)
        except BaseException:
            with signals.deferred():
                pool.shutdown(wait=False, cancel_futures=True)
                end([one for one in multiprocessing.active_children() if one not in others])
            raise


def workers(jobs: int) -> ProcessPoolExecutor:
    """Processes for tasks, which end with this one, even if it is killed."""
    # a fresh interpreter for each: a forked one would inherit the simulator's threads
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin)


def end(processes: list[BaseProcess]) -> None:
    """End processes: they are asked to, and killed if they don't in time."""
    for one in processes:
        one.terminate()
    latest = time.monotonic() + ENDING_S
    for one in processes:
        one.join(max(latest - time.monotonic(), 0.0))
        if one.is_alive():
            one.kill()


def _begin() -> None:
    """Of a process: it ends at once by a signal between tasks, and with its parent."""
    for number in (*signals.ENDING, signal.SIGINT):
        signal.signal(number, _end_now)
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _execute(task: BenchmarkTask) -> Row:
    """A task, which a signal ends with nothing left behind."""
    try:
        with signals.interruptible():
            return execute(task)
    except KeyboardInterrupt as error:
        os._exit(signals.exit_status(error))


def _end_now(number: int, _: object) -> NoReturn:
    os._exit(128 + number)


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
