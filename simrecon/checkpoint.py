"""What a run has solved so far, on disk after every window: a run that was killed goes on with the same bits.

A window is a function of the problem, the handover before it and the random generator's state, so these are
what is kept. One file per window, written aside, flushed to the disk and renamed.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import os
import zipfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import mujoco
import numpy as np

import simrecon
from simrecon import plan as plans
from simrecon.engines.problem import Problem
from simrecon.types import Handover, Window, WindowResult, WindowStatus

SCHEMA = "simrecon.checkpoint/1"


class Store(Protocol):
    """Where solved windows are kept."""

    def restore(self, digest: str, windows: Sequence[Window], rng: np.random.Generator) -> list[WindowResult]:
        """The windows that are solved already, with the generator put where the last one left it."""

    def save(self, result: WindowResult, rng: np.random.Generator) -> None:
        """Keep a window that was just solved, and the generator's state after it."""


class Folder:
    """A `Store` in a folder; runs of several problems (`digest`) may share it.

    Attributes:
        path: of the folder, made with the first window.
        windows: of the problem that was restored last.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.windows: tuple[Window, ...] = ()
        self._digest = ""

    def restore(self, digest: str, windows: Sequence[Window], rng: np.random.Generator) -> list[WindowResult]:
        """See `Store`. Files that are damaged, and all after them, are removed: those windows are redone."""
        self._digest, self.windows = digest, tuple(windows)
        found: list[WindowResult] = []
        for window in windows:
            read = _read(self._file(window), digest, window)
            if read is None:
                break
            result, state = read
            found.append(result)
            rng.bit_generator.state = state
        for window in windows[len(found) :]:
            self._file(window).unlink(missing_ok=True)
        return found

    def save(self, result: WindowResult, rng: np.random.Generator) -> None:
        """See `Store`.

        Raises:
            OSError: it can't be written; what was kept before is still there.
        """
        target = self._file(result.window)
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = target.with_suffix(".partial")
        try:
            with partial.open("wb") as stream:
                stream.write(_bytes(self._digest, result, rng))
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(partial, target)
            _flush_folder(target.parent)
        except OSError:
            partial.unlink(missing_ok=True)
            raise

    def _file(self, window: Window) -> Path:
        return self.path / self._digest[:16] / f"window_{window.index:05d}.npz"


def digest(problem: Problem, handover: Handover, seed: int) -> str:
    """Hash of all that the windows of a run depend on: the problem, where it starts, seed and versions."""
    found = hashlib.sha256()
    for item in dataclasses.fields(problem):
        value = getattr(problem, item.name)
        if isinstance(value, np.ndarray):
            found.update(f"{item.name} {value.dtype} {value.shape}".encode() + value.tobytes())
    found.update(handover.state.tobytes() + handover.knots_rad.tobytes())
    rest = {
        "mjcf": problem.mjcf,
        "plan": plans.to_dict(problem.plan),
        "clock": dataclasses.asdict(problem.clock),
        "every": problem.every,
        "seed": seed,
        "versions": [simrecon.__version__, mujoco.__version__, version("numpy")],
    }
    found.update(json.dumps(rest, sort_keys=True).encode())
    return found.hexdigest()


_OWN_FORM = ("window", "loss_terms", "status", "handover")
_PLAIN = tuple(item.name for item in dataclasses.fields(WindowResult) if item.name not in _OWN_FORM)
"""Fields of a result that are arrays or numbers."""


def _bytes(digest: str, result: WindowResult, rng: np.random.Generator) -> bytes:
    window = result.window
    buffer = io.BytesIO()
    plain: dict[str, Any] = {name: np.asarray(getattr(result, name)) for name in _PLAIN}
    np.savez_compressed(
        buffer,
        allow_pickle=False,
        schema=SCHEMA,
        digest=digest,
        window=[window.index, window.start_step, window.commit_step, window.end_step],
        term_names=np.array(list(result.loss_terms), dtype=str),
        terms=np.array(list(result.loss_terms.values()), dtype=float),
        status=result.status.name,
        state=result.handover.state,
        knots_rad=result.handover.knots_rad,
        rng=json.dumps(_plain(rng.bit_generator.state)),
        **plain,
    )
    return buffer.getvalue()


def _read(path: Path, digest: str, window: Window) -> tuple[WindowResult, dict[str, Any]] | None:
    """A window and the generator's state after it; None where there is none, or it is not whole."""
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
        kept = Window(*(int(value) for value in found["window"]))
        if (str(found["schema"]), str(found["digest"]), kept) != (SCHEMA, digest, window):
            return None
        plain: dict[str, Any] = {
            name: found[name] if found[name].ndim else found[name].item() for name in _PLAIN
        }
        result = WindowResult(
            window=window,
            loss_terms=dict(zip(found["term_names"].tolist(), found["terms"].tolist(), strict=True)),
            status=WindowStatus[str(found["status"])],
            handover=Handover(found["state"], found["knots_rad"]),
            **plain,
        )
        return result, json.loads(str(found["rng"]))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _plain(value: Any) -> Any:
    """A generator's state as JSON knows it: whole numbers may come as numpy's."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    return int(value) if isinstance(value, np.integer) else value


def _flush_folder(folder: Path) -> None:
    """A rename survives a power cut only once the folder itself is on the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
