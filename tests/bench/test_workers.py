"""Workers of a suite end with the process that started them, and leave nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tools import CHECKOUT

PARENT = """
import os, time
from simrecon.bench import processes
pool = processes.workers(1)
print(pool.submit(os.getpid).result(), flush=True)
pool.submit(time.sleep, 600)
time.sleep(600)
"""
SUITE = """
import sys
from pathlib import Path
from simrecon.bench import processes
from simrecon.system import signals
from tests.support.waiting import Waiting
try:
    with signals.interruptible():
        list(processes.finished([Waiting(Path(sys.argv[1]) / str(i)) for i in range(20)], 2))
except KeyboardInterrupt as error:
    sys.exit(signals.exit_status(error))
"""


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def within(seconds: float, holds: Callable[[], bool]) -> bool:
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:
        time.sleep(0.1)
    return holds()


def test_workers_end_when_their_parent_is_killed() -> None:
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    with parent:
        worker = int(parent.stdout.readline())
        assert _runs(worker)
        parent.kill()
        parent.wait()
        gone = within(30, lambda: not _runs(worker))
        if not gone:
            os.kill(worker, 9)
    assert gone


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_a_suite_with_what_is_at_work(
    tmp_path: Path, number: signal.Signals, status: int
) -> None:
    environment = os.environ | {"PYTHONPATH": str(CHECKOUT)}
    words = [sys.executable, "-c", SUITE, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment) as suite:
        begun = within(60, lambda: len([one for one in tmp_path.iterdir() if one.stat().st_size]) == 2)
        pids = [int(one.read_text(encoding="utf-8")) for one in tmp_path.iterdir()]
        suite.send_signal(number)
        try:
            said = suite.communicate(timeout=60)[0]
        except subprocess.TimeoutExpired:
            suite.kill()
            raise
    assert begun
    assert (suite.returncode, said) == (status, b"")
    assert not any(_runs(pid) for pid in pids)
    assert not list(tmp_path.iterdir())
