"""The panel of what is seen: which result, and what of it."""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from simrecon.errors import InputError, SimreconError
from simrecon.job import Job
from simrecon.studio.markdown import plain
from simrecon.studio.panel import Event, Panel, say
from simrecon.studio.session import Session
from simrecon.studio.stage import Looks, Stage

_NONE = "(nothing)"
_TICKS = {
    "before": "A: as opened (blue)",
    "after": "B: last run (orange)",
    "ghost": "kinematic fit (ghost)",
    "forces": "forces",
    "skin": "skin instead of primitives",
    "frustum": "camera with its video",
    "underlay": "video behind all",
}


class OpenPanel(Panel):
    """Which of what is open is looked at; opens more."""

    def __init__(self, gui: Any, session: Session, stage: Stage, reading: Job | None) -> None:
        super().__init__(gui, session, stage)
        self._reading = reading
        self._tabs = gui.add_dropdown("open", [_NONE], initial_value=_NONE)
        self._tabs.on_update(self.doing(self._look))
        self._says = gui.add_markdown("")
        self._folder = gui.add_folder("Open and close", expand_by_default=False)
        with self._folder:
            self._path = gui.add_text("path", "", hint="a result folder, evidence, a video, or a batch")
            self.button("Open", self._open)
            self._list = gui.add_dropdown("of the batch", [_NONE], initial_value=_NONE, visible=False)
            self._list.on_update(self.doing(self._open_listed))
            self.button("Close this one", self._close)
        self.refresh("tab")

    def refresh(self, what: str) -> None:
        """See `Panel`."""
        if what not in ("tab", "clip", "refused"):
            return
        titles = self._titles()
        self._tabs.options = tuple(titles) or (_NONE,)
        current = self.session.current
        shown = next((title for title, tab in titles.items() if tab is current), _NONE)
        if self._tabs.value != shown:
            self._tabs.value = shown
        listed = self.session.listed
        self._list.visible = bool(listed)
        if listed:
            self._list.options = (_NONE, *(str(path) for path in listed))
        if not titles and listed:
            self._says.content = f"A batch with {len(listed)} results: choose one under *Open and close*."
        else:
            self._says.content = self._words()

    def _words(self) -> str:
        tab = self.session.current
        if tab is None:
            return "Nothing is open yet."
        lines = [plain(tab.path)]
        if tab.failure:
            lines.append(f"**{plain(tab.failure)}**")
        elif tab.clip is None:
            lines.append("The evidence is read and fitted …")
        if tab.restored:
            lines.append(
                f"*{tab.restored} edits of an earlier studio were taken up again; undo takes them back.*"
            )
        if tab.seen is not None and tab.seen.found:
            lines.append("*Where the camera stood was found again from the poses.*")
        return "\n\n".join(lines)

    def _titles(self) -> dict[str, Any]:
        titles: dict[str, Any] = {}
        for tab in self.session.tabs:
            title, count = tab.title, 2
            while title in titles:
                title, count = f"{tab.title} ({count})", count + 1
            titles[title] = tab
        return titles

    def _look(self, _: Event) -> None:
        tab = self._titles().get(self._tabs.value)
        if tab is not None and tab is not self.session.current:
            self.session.show(tab)

    def _open(self, event: Event) -> None:
        if not self._path.value.strip():
            raise InputError("path: found nothing; valid: the path of a result, evidence, a video or a batch")
        self._begin(Path(self._path.value.strip()).expanduser(), event)

    def _open_listed(self, event: Event) -> None:
        if self._list.value != _NONE:
            self._begin(Path(self._list.value), event)

    def _begin(self, path: Path, event: Event) -> None:
        reading = None if self._reading is None else replace(self._reading, video=None)

        def work() -> None:
            try:
                self.session.open(path, reading)
            except SimreconError as error:
                say(event.client, str(error))

        threading.Thread(target=work, daemon=True, name="simrecon open").start()

    def _close(self, event: Event) -> None:
        tab = self.tab
        if tab.unsaved:
            say(
                event.client,
                "what is unsaved stays in the cache, and is there when it is opened again",
                good=True,
            )
        self.session.close(tab)


class ViewPanel(Panel):
    """What of a motion is drawn."""

    def __init__(self, gui: Any, session: Session, stage: Stage) -> None:
        super().__init__(gui, session, stage)
        for name, words in _TICKS.items():
            tick = gui.add_checkbox(words, getattr(stage.looks, name))
            tick.on_update(self.doing(partial(self._tick, name)))
        self.button("Look through the camera", lambda event: stage.look_through(event.client))
        gui.add_markdown(
            "The bar below: drag over it to scrub; *space* plays; *, .* step by frames; choose *loop* and "
            "drag for a range; choose *touch*, *free*, *auto* or *clear* and drag on a part's row to say "
            "what it does there."
        )

    def _tick(self, name: str, event: Event) -> None:
        looks: Looks = self.stage.looks
        self.stage.looks = replace(looks, **{name: bool(event.target.value)})
        self.stage.draw()
