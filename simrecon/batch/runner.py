"""The night: finds out what there is to do, keeps the workers busy, writes down what happens.

What is on disk is the truth: a finished clip has a record with the hash of all that it was made from, so a
batch that was killed is continued by giving the same command again.
"""

from __future__ import annotations

import contextlib
import os
import platform
import queue
import shutil
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from simrecon.batch import ahead, cluster, failures, journal, page
from simrecon.batch.ahead import Settings
from simrecon.batch.clips import Clip
from simrecon.batch.cluster import Crew
from simrecon.batch.journal import Event, Journal, Places, cannot_write
from simrecon.batch.work import Assignment
from simrecon.errors import SimreconError
from simrecon.io import provenance
from simrecon.io.provenance import code_digest
from simrecon.system import signals

GRACE_S = 60.0
"""After the time to end, running clips have so long to reach their next window."""
_TICK_S = 1.0

Say = Callable[[str], None]
Progress = Callable[[float, float, str], None]


@dataclass
class Outcome:
    """How a batch ended: names of clips, messages of those that failed, why it ended early if it did."""

    done: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)
    fallback: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    left: list[str] = field(default_factory=list)
    reason: str = ""


@dataclass
class _Entry:
    """A clip that waits or runs."""

    clip: Clip
    facts: dict[str, Any]
    attempts: int = 0
    window: int = 0
    reached: int = 0
    started: Event | None = None
    future: Any = None


def run(
    clips: Sequence[Clip], settings: Settings, say: Say = lambda _: None, progress: Progress = lambda *_: None
) -> Outcome:
    """Run a batch, or go on with it.

    Args:
        clips: what to do.
        settings: how.
        say: told what happens, in lines.
        progress: told seconds of video done and in all, and a few words.

    Raises:
        InputError: the folder can't be used, another batch holds it, or there is no cluster.
        SimreconError: the disk is full, or the cluster was lost; all that was solved is kept.
    """
    cluster.need()
    places = Places(settings.output.resolve())
    run_id = uuid.uuid4().hex[:12]
    try:
        places.root.mkdir(parents=True, exist_ok=True)
        with signals.interruptible(), journal.locked(places, run_id):
            book = Journal(places.events)
            with contextlib.closing(book), ahead.crew(settings, len(clips), run_id) as crew:
                return _Night(crew, places, book, settings, run_id, say, progress).work(clips)
    except OSError as error:
        if error.errno is None:  # of the network
            raise SimreconError(f"{cluster.LOST} ({type(error).__name__})") from error
        raise cannot_write(settings.output, error) from error


class _Night:
    """One batch at work."""

    def __init__(
        self,
        crew: Crew,
        places: Places,
        book: Journal,
        settings: Settings,
        run_id: str,
        say: Say,
        progress: Progress,
    ) -> None:
        self._crew, self._places, self._book, self._settings = crew, places, book, settings
        self._run, self._say, self._progress = run_id, say, progress
        self._outcome = Outcome()
        self._waiting: list[_Entry] = []
        self._running: dict[Any, _Entry] = {}  # by future
        self._video_s = self._video_done_s = 0.0
        self._stopping = False

    def work(self, clips: Sequence[Clip]) -> Outcome:
        """From the first clip to the report."""
        if self._settings.scheduler is not None:
            self._crew.check(self._places.root, self._run)
        self._prepare(clips)
        jobs = ahead.at_once(self._settings, len(clips))
        try:
            self._loop(jobs)
        except KeyboardInterrupt:
            self._outcome.reason = "interrupted"
        except SimreconError as error:
            self._outcome.reason = str(error)
            raise
        finally:
            running = [task.clip.name for task in self._running.values()]
            self._outcome.left = [*running, *(task.clip.name for task in self._waiting)]
            self._close()
        return self._outcome

    def _prepare(self, clips: Sequence[Clip]) -> None:
        """Write down what there is to do; keep what is done."""
        self._book.append(
            "begin",
            schema=journal.SCHEMA,
            run=self._run,
            pid=os.getpid(),
            host=platform.node(),
            versions=provenance.versions(),
            settings=_plain(self._settings),
            clips=len(clips),
        )
        by_name = {clip.name: clip for clip in clips}
        for name, facts in ahead.survey(self._crew, clips).items():
            clip = by_name[name]
            about: dict[str, Any] = {"clip": name, "input": clip.input, "plan": clip.plan}
            if "key" not in facts:
                self._book.append("clip", state="waiting", **about)
                self._fail(_Entry(clip, facts), facts)
                continue
            about |= {key: facts[key] for key in ("video_s", "windows", "key")}
            kept = not self._settings.force and ahead.is_done(self._places, facts)
            self._book.append("clip", state="kept" if kept else "waiting", **about)
            if kept:
                self._outcome.kept.append(name)
                if (ahead.record(self._places, name) or {})["figures"]["fallback"]:
                    self._outcome.fallback.append(name)
                continue
            if self._settings.force:
                shutil.rmtree(self._places.checkpoints(name), ignore_errors=True)
            self._waiting.append(_Entry(clip, facts))
            self._video_s += facts["video_s"]
        # the longest first, so that none is left alone at the end
        self._waiting.sort(key=lambda task: (-task.facts["video_s"], task.clip.name))
        kept_words = f", {len(self._outcome.kept)} done before" if self._outcome.kept else ""
        self._say(f"{len(self._waiting)} clips to do, {self._video_s:.1f} s of video{kept_words}")

    def _loop(self, jobs: int) -> None:
        until = self._settings.until_s
        while self._waiting or self._running:
            if until is not None and time.time() >= until and not self._stopping:
                self._stopping = True
                self._outcome.reason = time.strftime("stopped at %H:%M", time.localtime(until))
                self._crew.stop()
            if self._stopping and (not self._running or time.time() >= (until or 0) + GRACE_S):
                return
            while self._waiting and len(self._running) < jobs and not self._stopping:
                self._start(self._waiting.pop(0))
            try:
                kind, item = self._crew.inbox.get(timeout=_TICK_S)
            except queue.Empty:
                continue
            if kind == "event":
                self._hear(item)
            elif item in self._running:
                self._finish(self._running.pop(item), item)
                self._share(jobs)
            self._show()

    def _start(self, task: _Entry) -> None:
        job = Assignment(task.clip, str(self._places.root), self._run, task.facts["key"], code_digest())
        task.future, task.started, task.window = self._crew.solve(job), None, 0
        self._running[task.future] = task

    def _hear(self, event: Event) -> None:
        """An event of a clip that runs."""
        task = next((task for task in self._running.values() if task.clip.name == event["clip"]), None)
        if task is None:
            return
        content = {key: value for key, value in event.items() if key != "event"}
        if event["event"] == "started":
            task.started = event
            content["attempt"] = task.attempts + 1
            self._share(ahead.at_once(self._settings, len(self._running) + len(self._waiting)))
        task.window = event.get("window", task.window)
        self._book.append(event["event"], **content)

    def _share(self, jobs: int) -> None:
        running = {task.clip.name: task.started for task in self._running.values() if task.started}
        self._crew.share(running, 0 if self._stopping else len(self._waiting), jobs)

    def _finish(self, task: _Entry, future: Any) -> None:
        """A task ended: in a result, an error, or with its worker."""
        name = task.clip.name
        if cluster.died(future):
            limit = self._settings.memory_bytes
            memory = f", or above its memory limit of {limit / 2**30:.1f} GiB" if limit else ""
            message = f"the worker process died: killed{memory}"
            answer: dict[str, Any] = {"kind": "error", "message": message, "trace": ""}
        else:
            answer = cluster.value(future)
        if "figures" in answer:
            figures = answer["figures"]
            self._book.append("done", clip=name, figures=figures)
            self._outcome.done.append(name)
            self._video_done_s += task.facts["video_s"]
            if figures["fallback"]:
                self._outcome.fallback.append(name)
            self._say(f"{name}: {figures['verdict']}, {figures['wall_s']:.1f} s")
        elif answer["kind"] == "stopped" and self._stopping:
            self._book.append("stopped", clip=name)
            self._waiting.append(task)
        elif answer["kind"] == "disk":
            self._waiting.append(task)
            raise journal.DiskFullError(
                f"{self._places.root}: the disk is full; nothing is lost: make space, then give the same "
                f"command again"
            )
        else:
            self._again(task, answer)

    def _again(self, task: _Entry, answer: dict[str, Any]) -> None:
        """Another attempt, if there is one left; one that got further than those before does not count."""
        kept = self._places.checkpoints(task.clip.name)
        solved = len(list(kept.glob("*/*/window_*.npz"))) if kept.is_dir() else 0
        task.attempts = 1 if solved > task.reached else task.attempts + 1
        task.reached = max(task.reached, solved)
        if answer["kind"] == "input" or task.attempts > self._settings.retry:
            self._fail(task, answer)
            return
        self._book.append("retry", clip=task.clip.name, message=answer["message"], attempt=task.attempts)
        self._say(f"{task.clip.name}: tried again: {answer['message']}")
        self._waiting.insert(0, task)

    def _fail(self, task: _Entry, answer: dict[str, Any]) -> None:
        name = task.clip.name
        self._outcome.failed[name] = answer["message"]
        self._book.append(
            "failed", clip=name, cause=answer["kind"], message=answer["message"], attempts=task.attempts
        )
        self._say(f"{name}: failed: {answer['message']}")
        failures.write(self._places, task.clip, answer)

    def _show(self) -> None:
        part = sum(
            task.facts["video_s"] * task.window / max(task.facts["windows"], 1)
            for task in self._running.values()
        )
        failed = f", {len(self._outcome.failed)} failed" if self._outcome.failed else ""
        note = f"{len(self._outcome.done)} done{failed}, {len(self._waiting)} wait"
        self._progress(self._video_done_s + part, self._video_s, note)

    def _close(self) -> None:
        """The last event and the report; a full disk may take both, and must not hide why the batch ended."""
        outcome = self._outcome
        with contextlib.suppress(OSError):
            self._book.append(
                "end",
                done=len(outcome.done),
                kept=len(outcome.kept),
                failed=len(outcome.failed),
                left=len(outcome.left),
                reason=outcome.reason,
            )
            page.write(self._places)


def _plain(settings: Settings) -> dict[str, Any]:
    return {key: str(value) if isinstance(value, Path) else value for key, value in asdict(settings).items()}
