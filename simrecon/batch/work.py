"""What a worker process does for one clip; it knows neither the scheduler nor the other clips.

All is written to disk; what is returned is small: figures, paths and messages.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrecon import results
from simrecon.batch import failures, journal, records
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Places
from simrecon.drawing import overlay, video
from simrecon.engines import checkpoint
from simrecon.errors import SimreconError
from simrecon.io import atomic, full
from simrecon.io.provenance import code_digest
from simrecon.observer import Observer
from simrecon.results import Result, placing, verdict
from simrecon.results.folder import MOTION
from simrecon.running import run
from simrecon.system import locks, memory
from simrecon.types import Window, WindowResult

FREE_MIN_BYTES = 1 << 20
"""With less left on the disk after a result was written it may not be whole: video encoders do not say."""
THUMBNAILS, THUMBNAIL_PX = 5, 80
LANDMARKS = "landmarks"
_LOCK_INTERVAL_S = 0.5
STAGE_INTERVAL_S = 10.0
"""Between two words of how far a stage is."""

Tell = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Assignment:
    """A clip, the batch's folder and id, the key that its result will have, and the code that makes it."""

    clip: Clip
    root: str
    run: str
    key: str
    code: str


def solve(
    job: Assignment,
    *,
    threads: Callable[[], int] | int = 0,
    tell: Tell = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Reconstruct a clip from its last checkpoint on and put its result in place.

    Args:
        job: what to do.
        threads: of the simulator; a function is called before each generation.
        tell: told of stages, of the beginning of the windows, and of every window.
        stop: whether to end after the next window.

    Returns:
        `name` and `figures`, or what `failure` says.
    """
    places, name = Places(Path(job.root)), job.clip.name
    try:
        with _alone(places, job):
            return {"name": name, "figures": _solve(job, places, threads, tell, stop)}
    except Exception as error:
        failed = failures.failure(name, error)
        with contextlib.suppress(OSError):
            failures.note(places, name, f"{failed['kind']}: {failed['message']}\n{failed['trace']}".rstrip())
        return failed
    finally:
        memory.release()


def _solve(
    job: Assignment, places: Places, threads: Callable[[], int] | int, tell: Tell, stop: Callable[[], bool]
) -> dict[str, Any]:
    clip, target = job.clip, places.result(job.clip.name)
    if job.code != code_digest():
        raise SimreconError("the worker has another version of simrecon than the batch; install the same")
    _tidy(places, job)
    if records.damage(places, clip.name):
        failures.set_aside(places, clip.name)
    results.check_writable(target)
    began = time.perf_counter()
    store = checkpoint.Folder(places.checkpoints(clip.name) / job.key[:16])
    watcher = _Watcher(places, job, tell, stop)
    result = run(clip.job(target), watcher, checkpoint=store, threads=threads, overwrite=True, keep=False)
    _write_strip(places.thumbnail(clip.name), result)
    if shutil.disk_usage(target).free < FREE_MIN_BYTES:
        placing.discard(target)
        raise full.DiskFullError(f"{target}: the disk is full, so the result may not be whole")
    figures = _figures(result, time.perf_counter() - began)
    records.write(places, clip.name, job.key, figures)
    shutil.rmtree(places.checkpoints(clip.name), ignore_errors=True)
    failures.note(places, clip.name, f"done: {figures['verdict']}, {figures['wall_s']:.1f} s")
    return figures


def _write_strip(target: Path, result: Result) -> None:
    """A few frames of the motion in a row, for the report of the batch."""
    target.parent.mkdir(parents=True, exist_ok=True)
    strip = overlay.sheet(result.animation(), THUMBNAILS, THUMBNAIL_PX, columns=THUMBNAILS)
    video.write_image(target, strip)


def _figures(result: Result, here_s: float) -> dict[str, Any]:
    """What the batch's report shows of a result; `here_s`: wall time since the last start."""
    report = result.report
    frames, windows, totals = report["frames"], report["windows"], report["totals"]
    quality = report["verdict"]["verdict"]
    planned = verdict.is_plan(report)
    words = [("all planned" if planned else "all simulated") if quality == verdict.GOOD else quality]
    words += [reason["reason"] for reason in report["verdict"]["reasons"][:1]]
    return {
        "verdict": ": ".join(words),
        "quality": quality,
        "seconds": Counter(second["verdict"] for second in report["by_second"]),
        "fell": report["agreement"]["fell"],
        "frames": frames["count"],
        "fallback": frames["fallback"],
        "planned": planned,
        "video_s": totals["video_s"],
        "wall_s": totals["wall_s"],
        "here_s": here_s,
        "windows": len(windows),
        "loss": sum(window["loss"] for window in windows) / len(windows) if windows else None,
        "metrics": report["metrics"],
        "replay_exact": report["audit"]["replay_exact"],
    }


class _Watcher(Observer):
    """Tells the batch how far a clip is, and ends the work when it is to end.

    Detection in a long video takes longer than all that follows: now and then it is told how far it is.
    """

    def __init__(self, places: Places, job: Assignment, tell: Tell, stop: Callable[[], bool]) -> None:
        self._places, self._job, self._tell, self._stop = places, job, tell, stop
        self._stage, self._told_s = "", 0.0

    @property
    def _name(self) -> str:
        return self._job.clip.name

    def stage(self, name: str, done: float, total: float) -> None:
        """See `Observer`; windows are told by themselves."""
        name = LANDMARKS if name.startswith(LANDMARKS) else name
        now = time.monotonic()
        if name == "simulation" or (name == self._stage and now - self._told_s < STAGE_INTERVAL_S):
            return
        self._stage, self._told_s = name, now
        part = round(done / total, 3) if total > 0 else 0.0
        self._tell({"event": "stage", "clip": self._name, "stage": name, "part": part})

    def resumed(self, known: Sequence[WindowResult], windows: Sequence[Window]) -> None:
        """Say where the work goes on."""
        if known:
            note = f"goes on after window {len(known)} of {len(windows)}"
            failures.note(self._places, self._name, note)
        content = {"window": len(known), "windows": len(windows)}
        self._tell({"event": "started", "clip": self._name, **content})

    def solved(self, result: WindowResult, windows: Sequence[Window]) -> None:
        """Tell, and end if that was asked for."""
        done, count = result.window.index + 1, len(windows)
        line = f"window {done} of {count}: loss {result.loss:.2f}, {result.seconds:.1f} s"
        failures.note(self._places, self._name, line)
        content = {"window": done, "windows": count, "loss": round(result.loss, 4)}
        self._tell({"event": "window", "clip": self._name, **content})
        if done < count and (self._stop() or not journal.check_alive(self._places, self._job.run)):
            message = f"{self._name}: stopped after window {done} of {count}, which is kept"
            raise failures.StoppedError(message)


@contextlib.contextmanager
def _alone(places: Places, job: Assignment) -> Iterator[None]:
    """Hold the clip: a worker that a lost batch left behind may still be at its last window."""
    path = places.clip_lock(job.clip.name)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as stream:
        while not locks.acquire(stream):
            if not journal.check_alive(places, job.run):
                raise failures.StoppedError(f"{job.clip.name}: the batch is gone")
            time.sleep(_LOCK_INTERVAL_S)
        yield


def _tidy(places: Places, job: Assignment) -> None:
    """Remove what a killed worker left half done, and checkpoints for another key."""
    name, target = job.clip.name, places.result(job.clip.name)
    debris = re.compile(re.escape(atomic.fitted(f".{name}")) + r"\.\d+(-\d+)?\.(partial|earlier)")
    for path in sorted(places.root.iterdir()):
        if not debris.fullmatch(path.name) or not path.is_dir():
            continue
        if (path / placing.MARK).is_file():
            placing.remove_unfinished(path)
        elif (path / MOTION).is_file():
            if path.suffix == ".earlier" and not target.exists():  # killed between two renames
                path.rename(target)
            else:
                placing.discard(path)
    kept = places.checkpoints(name)
    for path in kept.iterdir() if kept.is_dir() else ():
        if path.name != job.key[:16]:
            shutil.rmtree(path, ignore_errors=True)
