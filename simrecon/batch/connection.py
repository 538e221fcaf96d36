"""The connection to the worker processes of dask, which are started here or run already."""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path
from typing import Any

from simrecon.errors import InputError, SimreconError

CONNECT_S = 15.0
STARTS = 3
"""Of a local cluster, at most."""
ENVIRONMENT = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), 1)
"""Of local workers, in place of dask's own, which also has the allocator give memory back at once: what a
search frees it asks for again, and a third of its time went by in page faults."""


def client(
    distributed: Any, stack: contextlib.ExitStack, jobs: int, scheduler: str | None, memory_bytes: int
) -> Any:
    """The connection to a cluster that runs, or to a local one that is made.

    Args:
        distributed: the module.
        stack: closes the local cluster.
        jobs: processes of a local cluster.
        scheduler: address, or scheduler file, of a cluster that runs; None: a local one.
        memory_bytes: that a local worker may use, 0 for no limit.

    Raises:
        InputError: the cluster does not answer.
        SimreconError: the processes of a local one do not start.
    """
    if scheduler is None:
        cluster = stack.enter_context(_local(distributed, jobs, memory_bytes))
        return distributed.Client(cluster, set_as_default=False)
    file = Path(scheduler)
    where: dict[str, Any] = {"scheduler_file": scheduler} if file.is_file() else {"address": scheduler}
    try:
        return distributed.Client(**where, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--scheduler: {scheduler} does not answer ({type(error).__name__}); "
            f"valid: an address such as tcp://host:8786, or a scheduler file"
        ) from error


def _local(distributed: Any, jobs: int, memory_bytes: int) -> Any:
    """A cluster of this host; begun again if a process of it is killed before it has started."""
    from dask import config

    for left in reversed(range(STARTS)):
        try:
            with config.set({"distributed.nanny.pre-spawn-environ": ENVIRONMENT}):
                return distributed.LocalCluster(
                    n_workers=jobs,
                    threads_per_worker=1,
                    processes=True,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False},
                    memory_limit=memory_bytes,
                    silence_logs=logging.CRITICAL,
                )
        except RuntimeError as error:
            if not left:
                message = f"the worker processes do not start ({error}); the same command goes on"
                raise SimreconError(message) from error
    raise AssertionError
