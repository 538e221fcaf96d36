"""A run in the background: the same `running.run` as everywhere, which may be watched and stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simrecon import running
from simrecon.engines import checkpoint
from simrecon.errors import SimreconError
from simrecon.job import Job
from simrecon.observer import Observer
from simrecon.results import Result
from simrecon.types import Window, WindowResult

RUNNING, DONE, STOPPED, FAILED = "running", "done", "stopped", "failed"
Run = Callable[..., Result]


class StopError(Exception):
    """The user wants the run to end."""


@dataclass(frozen=True)
class Progress:
    """How a run stands.

    Attributes:
        state: `running`, `done`, `stopped` or `failed`.
        stage: what is being done; share: how much of it, 0 to 1.
        windows: all there are; known: solved ones, in order.
        message: the last line of the run, or why it failed.
        seconds: since it began.
    """

    state: str = RUNNING
    stage: str = "begins"
    share: float = 0.0
    windows: int = 0
    known: tuple[WindowResult, ...] = ()
    message: str = ""
    seconds: float = 0.0

    @property
    def loss(self) -> float | None:
        """Of the last window that was solved."""
        return self.known[-1].loss if self.known else None

    @property
    def words(self) -> str:
        """For people."""
        if self.state == RUNNING:
            of = f", {len(self.known)} of {self.windows} windows" if self.windows else ""
            loss = "" if self.loss is None else f", loss {self.loss:.1f}"
            return f"{self.stage} {self.share:.0%}{of}{loss}, {self.seconds:.0f} s"
        if self.state == STOPPED:
            kept = f"{len(self.known)} of {self.windows} windows are kept"
            return f"stopped: {kept}; the same run goes on there"
        return f"{self.state} in {self.seconds:.0f} s" + (f": {self.message}" if self.message else "")


class Background(Observer):
    """A run on a thread of its own. It goes on whoever looks at it.

    Attributes:
        job: that is done.
        result: of a run that is done.
    """

    def __init__(
        self,
        job: Job,
        kept: Path,
        on_change: Callable[[], None] = lambda: None,
        run: Run = running.run,
    ) -> None:
        """Begin.

        Args:
            job: what to do.
            kept: folder of solved windows.
            on_change: is called after each step, on the thread of the run.
            run: does it.
        """
        self.job = job
        self.result: Result | None = None
        self._kept, self._on_change, self._run = kept, on_change, run
        self._progress, self._began = Progress(), time.monotonic()
        self._stop, self._lock = threading.Event(), threading.Lock()
        self._thread = threading.Thread(target=self._do, daemon=True, name="simrecon run")
        self._thread.start()

    @property
    def progress(self) -> Progress:
        """How it stands now."""
        with self._lock:
            return self._progress

    def stop(self) -> None:
        """End it before the next rollouts; what is solved stays."""
        self._stop.set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait for its end; whether it came."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def note(self, line: str) -> None:
        """See `Observer`."""
        self._tell(message=line)

    def stage(self, name: str, done: float, total: float) -> None:
        """See `Observer`."""
        self._tell(stage=name, share=min(max(done / total, 0.0), 1.0) if total > 0 else 1.0)

    def resumed(self, known: Sequence[WindowResult], windows: Sequence[Window]) -> None:
        """See `Observer`."""
        self._tell(known=tuple(known), windows=len(windows))

    def solved(self, result: WindowResult, windows: Sequence[Window]) -> None:
        """See `Observer`."""
        before = [one for one in self.progress.known if one.window.index < result.window.index]
        self._tell(known=(*before, result), windows=len(windows))

    def _threads(self) -> int:
        """The job's threads; asked before each generation."""
        self._check()
        return self.job.threads

    def _check(self) -> None:
        if self._stop.is_set():
            raise StopError

    def _tell(self, **changes: object) -> None:
        self._check()
        self._put(**changes)

    def _put(self, **changes: object) -> None:
        with self._lock:
            seconds = time.monotonic() - self._began
            self._progress = replace(self._progress, seconds=seconds, **changes)  # type: ignore[arg-type]
        self._on_change()

    def _do(self) -> None:
        try:
            store = checkpoint.Folder(self._kept)
            self.result = self._run(self.job, self, checkpoint=store, threads=self._threads, overwrite=True)
            self._put(state=DONE, stage="", share=1.0, message="")
        except StopError:
            self._put(state=STOPPED)
        except SimreconError as error:
            self._put(state=FAILED, message=str(error))
        except Exception as error:  # a defect; the studio stays
            self._put(state=FAILED, message=f"{type(error).__name__}: {error}")
