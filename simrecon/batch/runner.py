"""The night: finds out what there is to do, keeps the workers busy, writes down what happens.

What is on disk is the truth: a finished clip has a record with the hash of all that it was made from, so a
batch that was killed is continued by giving the same command again.
"""

from __future__ import annotations

import contextlib
import queue
import shutil
import time
import uuid
from collections.abc import Callable, Sequence
from typing import Any

from simrecon.batch import ahead, cluster, journal
from simrecon.batch.agenda import Agenda, QueuedClip
from simrecon.batch.ahead import Settings
from simrecon.batch.clips import Clip
from simrecon.batch.cluster import Crew
from simrecon.batch.journal import Event, Journal, Places, cannot_write
from simrecon.batch.ledger import Ledger, Outcome, Say
from simrecon.batch.work import Assignment
from simrecon.errors import SimreconError
from simrecon.io import full
from simrecon.io.messages import counted
from simrecon.io.provenance import code_digest
from simrecon.system import signals

GRACE_S = 60.0
"""After the time to end, running clips have so long to reach their next window."""
_TICK_S = 1.0

Progress = Callable[[float, float, str], None]


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
        InputError: the folder can't be used or holds a single result, another batch holds it, or there is no
            cluster.
        SimreconError: the disk is full, or the cluster was lost; all that was solved is kept.
    """
    cluster.need()
    places = Places(settings.output.resolve())
    ahead.refuse_result(settings.output)
    run_id = uuid.uuid4().hex[:12]
    try:
        places.root.mkdir(parents=True, exist_ok=True)
        with signals.interruptible(), journal.locked(places, run_id):
            book = Journal(places.events)
            with contextlib.closing(book), ahead.crew(settings, len(clips), run_id) as crew:
                ledger = Ledger(places, book, say)
                return _Night(crew, places, ledger, settings, run_id, progress).work(clips)
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
        ledger: Ledger,
        settings: Settings,
        run_id: str,
        progress: Progress,
    ) -> None:
        self._crew, self._places, self._ledger, self._settings = crew, places, ledger, settings
        self._run, self._progress = run_id, progress
        self._agenda = Agenda()
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
            self._ledger.outcome.reason = "interrupted"
        except SimreconError as error:
            self._ledger.outcome.reason = str(error)
            raise
        finally:
            self._ledger.outcome.left = self._agenda.left()
            self._ledger.close()
        return self._ledger.outcome

    def _prepare(self, clips: Sequence[Clip]) -> None:
        """Write down what there is to do; keep what is done."""
        ledger, agenda, force = self._ledger, self._agenda, self._settings.force
        ledger.begin(self._run, self._settings, len(clips))
        by_name = {clip.name: clip for clip in clips}
        for name, facts in ahead.survey(self._crew, clips).items():
            clip = by_name[name]
            done = ahead.is_done(self._places, facts, hashes=self._settings.verify)
            if done is not None and not force:
                ledger.kept(clip, facts, done.figures)
                continue
            ledger.waits(clip, facts)
            if "key" not in facts:
                ledger.failed(clip, facts, 0)
                continue
            if force:
                shutil.rmtree(self._places.checkpoints(name), ignore_errors=True)
            agenda.add(QueuedClip(clip, facts))
        agenda.sort()
        kept_words = f", {len(ledger.outcome.kept)} done before" if ledger.outcome.kept else ""
        ledger.say(
            f"{counted(len(agenda.waiting), 'clip')} to do, {agenda.video_s:.1f} s of video{kept_words}"
        )

    def _loop(self, jobs: int) -> None:
        until = self._settings.until_s
        while self._agenda.waiting or self._agenda.running:
            if until is not None and time.time() >= until and not self._stopping:
                self._stopping = True
                self._ledger.outcome.reason = time.strftime("stopped at %H:%M", time.localtime(until))
                self._crew.stop()
            if self._stopping and (not self._agenda.running or time.time() >= (until or 0) + GRACE_S):
                return
            while self._agenda.waiting and len(self._agenda.running) < jobs and not self._stopping:
                self._start(self._agenda.waiting.pop(0))
            try:
                kind, item = self._crew.inbox.get(timeout=_TICK_S)
            except queue.Empty:
                continue
            if kind == "event":
                self._hear(item)
            elif item in self._agenda.running:
                self._finish(self._agenda.running.pop(item), item)
                self._share(jobs)
            self._show()

    def _start(self, task: QueuedClip) -> None:
        job = Assignment(task.clip, str(self._places.root), self._run, task.facts["key"], code_digest())
        task.future, task.started, task.window = self._crew.solve(job), None, 0
        self._agenda.running[task.future] = task

    def _hear(self, event: Event) -> None:
        """An event of a clip that runs."""
        task = self._agenda.running_clip(event["clip"])
        if task is None:
            return
        content = {key: value for key, value in event.items() if key != "event"}
        if event["event"] == "started":
            task.started = event
            content["attempt"] = task.attempts + 1
            self._share(ahead.at_once(self._settings, len(self._agenda.running) + len(self._agenda.waiting)))
        task.window = event.get("window", task.window)
        self._ledger.book.append(event["event"], **content)

    def _share(self, jobs: int) -> None:
        self._crew.share(self._agenda.started(), 0 if self._stopping else len(self._agenda.waiting), jobs)

    def _finish(self, task: QueuedClip, future: Any) -> None:
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
            self._ledger.done(task.clip, answer["figures"])
            self._agenda.video_done_s += task.facts["video_s"]
        elif answer["kind"] == "stopped" and self._stopping:
            self._ledger.book.append("stopped", clip=name)
            self._agenda.waiting.append(task)
        elif answer["kind"] == "disk":
            self._agenda.waiting.append(task)
            raise full.stopped(self._places.root)
        else:
            self._again(task, answer)

    def _again(self, task: QueuedClip, answer: dict[str, Any]) -> None:
        """Another attempt, if there is one left; one that got further than those before does not count."""
        kept = self._places.checkpoints(task.clip.name)
        solved = len(list(kept.glob("*/*/window_*.npz"))) if kept.is_dir() else 0
        task.attempts = 1 if solved > task.reached else task.attempts + 1
        task.reached = max(task.reached, solved)
        if answer["kind"] == "input" or task.attempts > self._settings.retry:
            self._ledger.failed(task.clip, answer, task.attempts)
            return
        self._ledger.again(task.clip, answer, task.attempts)
        self._agenda.waiting.insert(0, task)

    def _show(self) -> None:
        done, failed = self._ledger.outcome.done, self._ledger.outcome.failed
        failed_words = f", {len(failed)} failed" if failed else ""
        note = f"{len(done)} done{failed_words}, {len(self._agenda.waiting)} wait"
        self._progress(self._agenda.reached_s(), self._agenda.video_s, note)
