"""One opened thing: what is seen of it, its edits, its runs, and A/B."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from simrecon import running
from simrecon import scene as scenes
from simrecon.errors import InputError, SimreconError
from simrecon.job import Job
from simrecon.results import Result, open_result
from simrecon.results.folder import holds_result
from simrecon.studio import asking, camera, clip, comparing, keeping, opening, penetration, preview, runs
from simrecon.studio.asking import Wanted
from simrecon.studio.camera import Seen
from simrecon.studio.clip import Clip
from simrecon.studio.comparing import Row
from simrecon.studio.document import Document
from simrecon.studio.journal import Journal
from simrecon.studio.penetration import Inside
from simrecon.studio.runs import Background, Run
from simrecon.types import ContactWish, Report, Scene, WindowResult

SCENE, CLIP, RUN = "scene", "clip", "run"
"""What changed, as listeners are told."""


@dataclass(frozen=True, eq=False)
class Shown:
    """A result as it is seen."""

    result: Result
    clip: Clip

    @property
    def report(self) -> Report:
        """Its report."""
        return self.result.report


class Tab:
    """A result or evidence that is open.

    Attributes:
        path: that was opened; title: for people.
        base: the result, or the job of reading evidence, that runs go on from.
        document: what is edited.
        before, after: A and B: what the last run is compared with, and the run.
        fit: of evidence that has not been run yet.
        inside: what the motion goes through in the edited scene.
        run: the last one; begun: the scene that it is in.
        restored: how many edits of an earlier studio were taken up.
        failure: why evidence could not be read or fitted, or edits not kept; empty: they could.
    """

    def __init__(
        self,
        path: Path,
        base: Result | Job,
        scene: str | None = None,
        wishes: tuple[ContactWish, ...] | None = None,
        where: str = "scene.toml",
    ) -> None:
        """Open; evidence is fitted by `load`.

        Raises:
            InputError: a file of a result can't be read.
        """
        self.path, self.base, self.lock = path, base, threading.RLock()
        self.title = path.resolve().name
        self.listeners: list[Callable[[str], None]] = []
        self.before: Shown | None = None
        self.after: Shown | None = None
        self.fit: Clip | None = None
        self.inside: tuple[Inside, ...] = ()
        self.run: Background | None = None
        self.begun: Scene | None = None
        self._solved: tuple[tuple[WindowResult, ...], Clip | None] = ((), None)
        self.failure = ""
        self.seen: Seen | None = None
        self.journal = Journal(path)
        if isinstance(base, Result):
            self.before = Shown(base, clip.of_result(base, self.title))
            scene = scenes.dumps(base.scene) if scene is None else scene
            wishes = base.job.contacts if wishes is None else wishes
        self.document = Document(scenes.dumps(Scene()) if scene is None else scene, wishes or (), where)
        self.restored = self.document.take_up(self.journal.kept())
        self.document.on_change = self._edited
        self.check()

    @property
    def job_of_base(self) -> Job:
        """The job by which the evidence is read."""
        return self.base.job if isinstance(self.base, Result) else self.base

    @property
    def clip(self) -> Clip | None:
        """What A shows: the result, or the fit to evidence."""
        return self.fit if self.before is None else self.before.clip

    @property
    def preview(self) -> Clip | None:
        """What B shows: the last run, or what it has solved so far."""
        if self.after is not None:
            return self.after.clip
        if self.run is None or self.clip is None or self.begun is None:
            return None
        known = self.run.progress.known
        if known != self._solved[0]:
            self._solved = (known, preview.of_windows(self.clip, self.begun, known))
        return self._solved[1]

    @property
    def unsaved(self) -> bool:
        """Whether leaving loses sight of something: edits, or a run that was neither kept nor discarded."""
        return self.document.unsaved or self.after is not None

    def tell(self, what: str) -> None:
        """Tell the listeners what changed."""
        for listener in tuple(self.listeners):
            listener(what)

    def load(self) -> None:
        """Read the evidence: the camera of a result, or the kinematic fit of what was not run yet."""
        try:
            evidence = opening.evidence_of(self.base)
            if self.before is not None:
                self.seen = camera.of(self.job_of_base, self.before.clip, evidence)
            elif not isinstance(self.base, Result):
                fit = opening.fitted(self.base, evidence, self.document.scene)
                self.fit = clip.of_fit(fit, self.title)
                self.seen = camera.of(self.base, self.fit, evidence, fit)
                self.check()
        except SimreconError as error:
            self.failure = str(error)
        self.tell(CLIP)

    def check(self) -> None:
        """See anew what the motion goes through."""
        seen = self.clip
        if seen is None:
            return
        try:
            self.inside = penetration.find(seen.body, self.document.scene, seen.times_s, seen.asked_qpos)
        except InputError as error:
            self.inside, self.failure = (), str(error)

    @cached_property
    def _numbers(self) -> itertools.count[int]:
        there = [int(path.name) for path in self.journal.runs.glob("*") if path.name.isdigit()]
        return itertools.count(max(there, default=0) + 1)

    def job(self, wanted: Wanted, output: Path | str = "") -> Job:
        """The job of a run as it would be now."""
        return asking.job_of(self.base, self.document, wanted, output)

    def start(self, wanted: Wanted, run: Run | None = None) -> Background:
        """Run in the background; the result is B.

        Raises:
            InputError: one is running already, or there is no such plan.
        """
        with self.lock:
            if self.run is not None and self.run.progress.state == runs.RUNNING:
                raise InputError("a run goes on already; valid: wait for it, or stop it")
            job = self.job(wanted, self.journal.runs / f"{next(self._numbers)}")
            self.discard()
            self.begun = self.document.scene
            self.run = Background(job, self.journal.windows, self._progressed, run or running.run)
            return self.run

    def table(self) -> tuple[Row, ...]:
        """A against B, or B alone where evidence has no A yet; empty without B."""
        if self.after is None:
            return ()
        before = None if self.before is None else (self.before.clip, self.before.report)
        return comparing.table(before, (self.after.clip, self.after.report))

    def keep(self, folder: Path | str) -> Result:
        """Put B where the user says; it is A then, from which further runs go on.

        Raises:
            InputError: there is no B, or the folder can't be written.
        """
        with self.lock:
            if self.after is None:
                raise InputError("there is no result to keep; valid: run first")
            made = self.after.result
            kept = keeping.result(made, folder)
            keeping.discard(made)
            self.before, self.base = Shown(kept, clip.of_result(kept, kept.folder.name)), kept
            self.after, self.run = None, None
            self.check()
        self.tell(CLIP)
        return kept

    def discard(self) -> None:
        """Remove B."""
        with self.lock:
            if self.after is not None:
                keeping.discard(self.after.result)
            self.after = self.run = None
        self.tell(CLIP)

    def left(self) -> tuple[Path, ...]:
        """Results of an earlier studio that were neither kept nor discarded, the last one first."""
        there = [path for path in self.journal.runs.glob("*") if holds_result(path)]
        own = None if self.after is None else self.after.result.folder
        return tuple(path for path in sorted(there, key=_number, reverse=True) if path != own)

    def take_up(self, folder: Path) -> None:
        """Show a result that was left as B."""
        result = open_result(folder)
        with self.lock:
            self.after = Shown(result, clip.of_result(result, "B"))
        self.tell(CLIP)

    def settle(self, saved: Callable[[], None]) -> None:
        """Note what is saved; where that is all, nothing is kept for another studio."""
        saved()
        if not self.document.unsaved:
            self.journal.forget()
        self.tell(SCENE)

    def close(self) -> None:
        """Stop what runs, and give the place of the journal back."""
        if self.run is not None:
            self.run.stop()
        self.journal.close()

    def _edited(self) -> None:
        self.check()
        self.failure = self.journal.note(self.document.edits) or self.failure
        self.tell(SCENE)

    def _progressed(self) -> None:
        run = self.run
        if run is not None and run.progress.state == runs.DONE and run.result is not None:
            with self.lock:
                self.after = Shown(run.result, clip.of_result(run.result, "B"))
        self.tell(RUN)


def _number(folder: Path) -> int:
    return int(folder.name) if folder.name.isdigit() else 0
