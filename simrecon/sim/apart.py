"""Derivatives of steps in processes of their own, where threads of one Python would wait for each other.

Reading a step takes a hundred short calls, and only one thread of a Python can make them at a time. A
colleague is a second Python that gets the model once, and then stretches of a trajectory. It ends with the
pipe that it is asked through. What is computed does not depend on where.

    python -m simrecon.sim.apart        the process
"""

from __future__ import annotations

import contextlib
import signal
import subprocess  # nosec B404  # runs this Python alone
import sys
import weakref
from collections.abc import Sequence
from dataclasses import fields
from threading import Thread
from typing import IO, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.io import packing
from simrecon.sim.derivatives import Transitions, transitions
from simrecon.sim.inverse import Inverse
from simrecon.sim.quiet import unlogged
from simrecon.system import child
from simrecon.types import Array

Arrays = dict[str, NDArray[Any]]
WAIT_S = 5.0
"""For a process to end by itself."""


class Colleague:
    """A process that differentiates steps of one model; one thread may ask it at a time.

    Attributes:
        process: that it is.
        ready: whether it knows the model, and owes no answer. One whose answer was not fetched, because
            something else failed meanwhile, is not asked again.
    """

    def __init__(self, inverse: Inverse) -> None:
        """Start it, without waiting for it."""
        self.ready = False
        command = [sys.executable, "-P", "-m", __name__]
        self.process = subprocess.Popen(  # nosec B603  # no shell, words of our own
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=child.environment(),
        )
        self.close = weakref.finalize(self, _end, self.process)
        told = {"model": _binary(inverse.model), "felt": np.array(inverse.felt, np.int64)}
        Thread(target=_introduce, args=(weakref.ref(self), self.process, told), daemon=True).start()

    def ask(self, states: Array, ctrl: Array, parts: Sequence[slice]) -> bool:
        """Whether it was asked for parts of a trajectory, as `derivatives.transitions` has it."""
        asked: Arrays = {}
        for part in parts:
            asked[f"states {part.start}"] = states[part.start : part.stop + 1]
            asked[f"ctrl {part.start}"] = ctrl[part]
        self.ready = False
        try:
            packing.send(self.process.stdin, asked)
        except OSError:
            return False
        return True

    def answer(self) -> dict[int, Transitions]:
        """What it was asked for, by the first step of each part; nothing if the process has ended."""
        try:
            found = packing.receive(self.process.stdout)
        except (OSError, EOFError, ValueError):
            return {}
        self.ready = True
        starts = (int(name.split()[1]) for name in found if name.startswith("state "))
        return {
            start: Transitions(*(found[f"{field.name} {start}"] for field in fields(Transitions)))
            for start in starts
        }


def _introduce(colleague: weakref.ref[Colleague], process: subprocess.Popen[bytes], told: Arrays) -> None:
    """Tell a process its model, and that it is ready who asks it, if anybody does any more."""
    with contextlib.suppress(OSError, EOFError, ValueError):
        packing.send(process.stdin, told)
        packing.receive(process.stdout)
        if (found := colleague()) is not None:
            found.ready = True


def _end(process: subprocess.Popen[bytes]) -> None:
    """Close the pipes of a process, which ends it."""
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.close()
    try:
        process.wait(WAIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _binary(model: mujoco.MjModel) -> Array:
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content


def serve(requests: IO[bytes], answers: IO[bytes]) -> None:
    """Answer one request after another, until there are no more."""
    told = packing.receive(requests)
    model = mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": told["model"].tobytes()})
    inverse = Inverse(model, told["felt"].tolist())
    packing.send(answers, {"ready": np.ones(1)})
    while True:
        try:
            asked = packing.receive(requests)
        except EOFError:
            return
        found: Arrays = {}
        with unlogged():
            for start in (name.split()[1] for name in asked if name.startswith("ctrl ")):
                own = transitions(inverse, asked[f"states {start}"], asked[f"ctrl {start}"])
                found |= {f"{field.name} {start}": getattr(own, field.name) for field in fields(own)}
        packing.send(answers, found)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one who asks decides
    serve(sys.stdin.buffer, sys.stdout.buffer)
