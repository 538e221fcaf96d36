"""The panel of runs: plan and range, progress, and A/B with keep or discard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from simrecon import plan
from simrecon.errors import InputError
from simrecon.studio import comparing, runs, saving
from simrecon.studio.asking import Wanted
from simrecon.studio.markdown import plain
from simrecon.studio.panel import Event, Panel, say
from simrecon.studio.session import Session
from simrecon.studio.stage import Stage


class RunPanel(Panel):
    """Runs again, and compares."""

    def __init__(self, gui: Any, session: Session, stage: Stage) -> None:
        super().__init__(gui, session, stage)
        self._plan = gui.add_dropdown("plan", plan.names(), initial_value="quick")
        self._onwards = gui.add_checkbox("go on from the finished motion", True)
        self._range = gui.add_checkbox("the loop's range alone", False, hint="choose it in the bar below")
        self.button("Run", self._run, color="blue")
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._says = gui.add_markdown("")
        self._stop = self.button("Stop", self._end, visible=False, hint="what is solved is kept")
        self._table = gui.add_markdown("")
        self._folder = gui.add_text("keep in folder", "", hint="where B is to be written")
        self._keep = self.button("Keep B", self._keep_it, visible=False, color="green")
        self._discard = self.button("Discard B", lambda _: self.tab.discard(), visible=False)
        self._left = self.button("Show the last run that was left", self._take_up, visible=False)
        self.refresh("tab")

    @property
    def wanted(self) -> Wanted:
        """How the next run is to be done."""
        low, high = self.session.player.span if self._range.value else (None, None)
        if self._range.value and self.session.player.loop is None:
            low = high = None
        return Wanted(self._plan.value, low, high, bool(self._onwards.value))

    def refresh(self, what: str) -> None:
        """See `Panel`."""
        tab = self.session.current
        if tab is None or what == "choice":
            return
        progress = None if tab.run is None else tab.run.progress
        going = progress is not None and progress.state == runs.RUNNING
        self._bar.visible = self._stop.visible = going
        if progress is not None:
            share = progress.share if not progress.windows else len(progress.known) / progress.windows
            self._bar.value = round(100 * share, 1)
        words = "" if progress is None else plain(progress.words)
        if self._says.content != words:
            self._says.content = words
        rows = tab.table()
        table = comparing.markdown(rows) + f"\n\n{comparing.verdict(rows)}" if rows else ""
        if self._table.content != table:
            self._table.content = table
        there = tab.after is not None
        self._keep.visible = self._discard.visible = self._folder.visible = there
        self._left.visible = not there and not going and bool(tab.left())

    def _run(self, _: Event) -> None:
        if self._range.value and self.session.player.loop is None:
            raise InputError("no range is chosen; valid: choose 'loop' in the bar, and drag over a range")
        self.tab.start(self.wanted)
        self.refresh("run")

    def _end(self, _: Event) -> None:
        if self.tab.run is not None:
            self.tab.run.stop()

    def _keep_it(self, event: Event) -> None:
        folder = self._folder.value.strip()
        if not folder:
            raise InputError("keep in folder: found nothing; valid: the folder that B is to be written to")
        kept = self.tab.keep(Path(folder).expanduser())
        say(event.client, f"written: {kept.folder}", good=True)

    def _take_up(self, _: Event) -> None:
        left = self.tab.left()
        if left:
            self.tab.take_up(left[0])


class SavePanel(Panel):
    """Writes files where the user says."""

    def __init__(self, gui: Any, session: Session, stage: Stage, run: RunPanel) -> None:
        super().__init__(gui, session, stage)
        self._run = run
        self._scene = gui.add_text("scene", "")
        self._contacts = gui.add_text("contacts", "")
        self._job = gui.add_text("job", "")
        self._replaces = gui.add_checkbox("replace what is there", False)
        self.button("Save scene", self._save_scene, color="green")
        self.button("Save contacts", self._save_contacts, color="green")
        self.button("Save job", self._save_job, color="green", hint="what Run would do, for the shell")
        gui.add_markdown("`simrecon run --job job.toml` repeats the run of the studio to the same bits.")
        self.refresh("tab")

    def refresh(self, what: str) -> None:
        """See `Panel`."""
        tab = self.session.current
        if tab is None or what != "tab":
            return
        own = tab.document.where
        self._scene.value = own if Path(own).is_file() else ""
        self._contacts.value = self._job.value = ""

    def _path(self, field: Any, name: str) -> Path:
        if not field.value.strip():
            raise InputError(f"{name}: found nothing; valid: the path of the file to write")
        return Path(field.value.strip()).expanduser()

    def _save_scene(self, event: Event) -> None:
        path = self._path(self._scene, "scene")
        saving.scene(self.tab, path, replaces=self._replaces.value)
        say(event.client, f"written: {path}", good=True)

    def _save_contacts(self, event: Event) -> None:
        path = self._path(self._contacts, "contacts")
        saving.contacts(self.tab, path, replaces=self._replaces.value)
        say(event.client, f"written: {path}", good=True)

    def _save_job(self, event: Event) -> None:
        path = self._path(self._job, "job")
        saving.job(self.tab, path, self._run.wanted, replaces=self._replaces.value)
        say(event.client, f"written: {path}", good=True)
