"""What a run has solved so far, on disk after every window: a run that was killed goes on with the same bits.

A window is a function of the problem, the handover before it, the seed and its effort, so results are all
that is kept. One file per window, written aside, flushed to the disk and renamed.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import mujoco
import numpy as np

import simrecon
from simrecon import plan as plans
from simrecon.engines.problem import Problem
from simrecon.errors import InputError
from simrecon.io import atomic, npz
from simrecon.io.limits import MISFITS
from simrecon.types import Effort, Handover, Spread, Window, WindowResult, WindowStatus

SCHEMA = "simrecon.checkpoint/4"


class Store(Protocol):
    """Where solved windows are kept."""

    def restore(self, digest: str, windows: Sequence[Window]) -> list[WindowResult]:
        """The windows that are solved already."""

    def save(self, result: WindowResult) -> None:
        """Keep a window that was just solved."""


class Folder:
    """A `Store` in a folder; runs of several problems (`digest`) may share it.

    Attributes:
        path: of the folder, made with the first window.
        windows: of the problem that was restored last, and its digest.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.windows: tuple[Window, ...] = ()
        self.digest = ""

    def restore(self, digest: str, windows: Sequence[Window]) -> list[WindowResult]:
        """See `Store`.

        Files that are damaged, or that neither begin where the one before ends (it was solved again after a
        fall) nor anew after the gap that they name, are removed: those windows are redone.
        """
        self.digest, self.windows = digest, tuple(windows)
        restored: list[WindowResult] = []
        for window in windows:
            result = _read(self._file(window), digest, window)
            if result is not None and _follows(result, restored):
                restored.append(result)
            else:
                self._file(window).unlink(missing_ok=True)
        return restored

    def save(self, result: WindowResult) -> None:
        """See `Store`.

        Raises:
            OSError: it can't be written; what was kept before is still there.
        """
        target = self._file(result.window)
        target.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(target, _bytes(self.digest, result), durable=True)

    def _file(self, window: Window) -> Path:
        return self.path / self.digest[:16] / f"window_{window.index:05d}.npz"


def _follows(result: WindowResult, before: Sequence[WindowResult]) -> bool:
    """Whether a window begins the clip, begins anew after a gap, or begins where the one before it ends."""
    solved = before[-1].window.index + 1 if before else 0
    if result.begins_anew:
        return result.gap_from == solved
    if result.window.index != solved:
        return False
    return not before or np.array_equal(result.states[0], before[-1].states[-1])


def digest(problem: Problem, handover: Handover, seed: int, identity: str = "") -> str:
    """Hash of all that the windows of a run depend on.

    Args:
        problem: what is solved.
        handover: where it starts.
        seed: of all random numbers.
        identity: of the job and the code.
    """
    digester = hashlib.sha256()
    for item in dataclasses.fields(problem):
        value = getattr(problem, item.name)
        if isinstance(value, np.ndarray):
            digester.update(f"{item.name} {value.dtype} {value.shape}".encode() + value.tobytes())
    digester.update(handover.state.tobytes() + handover.knots_rad.tobytes())
    rest = {
        "mjcf": problem.mjcf,
        "plan": plans.to_dict(problem.plan),
        "clock": dataclasses.asdict(problem.clock),
        "every": problem.every,
        "seed": seed,
        "identity": identity,
        "versions": [simrecon.__version__, mujoco.__version__, version("numpy")],
    }
    digester.update(json.dumps(rest, sort_keys=True).encode())
    return digester.hexdigest()


_OWN_FORM = ("window", "loss_terms", "status", "effort", "handover", "spread")
_PLAIN = tuple(item.name for item in dataclasses.fields(WindowResult) if item.name not in _OWN_FORM)
"""Fields of a result that are arrays or numbers."""


def _bytes(digest: str, result: WindowResult) -> bytes:
    window = result.window
    arrays: dict[str, Any] = {
        "schema": SCHEMA,
        "digest": digest,
        "window": [window.index, window.start_step, window.commit_step, window.end_step],
        "term_names": np.array(list(result.loss_terms), dtype=str),
        "terms": np.array(list(result.loss_terms.values()), dtype=float),
        "status": result.status.name,
        "effort": dataclasses.astuple(result.effort),
        "state": result.handover.state,
        "knots_rad": result.handover.knots_rad,
        "first_knot": result.handover.first,
    }
    if result.spread is not None:
        arrays |= {"spread_N": result.spread.force_N, "touch": result.spread.touch}
    return atomic.npz_bytes(arrays | {name: np.asarray(getattr(result, name)) for name in _PLAIN})


def _read(path: Path, digest: str, window: Window) -> WindowResult | None:
    """A window; None where there is none, or it is not whole."""
    try:
        arrays = npz.load(path).content
        kept = Window(*(int(value) for value in arrays["window"]))
        if (str(arrays["schema"]), str(arrays["digest"]), kept) != (SCHEMA, digest, window):
            return None
        plain: dict[str, Any] = {
            name: arrays[name] if arrays[name].ndim else arrays[name].item() for name in _PLAIN
        }
        return WindowResult(
            window=window,
            loss_terms=dict(zip(arrays["term_names"].tolist(), arrays["terms"].tolist(), strict=True)),
            status=WindowStatus[str(arrays["status"])],
            effort=Effort(*(int(value) for value in arrays["effort"])),
            handover=Handover(arrays["state"], arrays["knots_rad"], int(arrays["first_knot"])),
            spread=Spread(arrays["spread_N"], arrays["touch"]) if "spread_N" in arrays else None,
            **plain,
        )
    except (InputError, *MISFITS):
        return None
