"""Silence for a simulator whose rollouts are expected to diverge now and then."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import mujoco


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


@contextlib.contextmanager
def unwarned() -> Iterator[None]:
    """Keep MuJoCo from printing the warnings of this process, and from logging them in a file here."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
