"""Threads of numpy's linear algebra: one, so that they leave the cores to the simulator."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Linear algebra on one thread, in a `with` or as a decorator.

    Its own threads wait for work by spinning: with them the rollouts of a kick were 19 per cent slower on two
    cores. Sums don't depend on how many of them there are, either.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
