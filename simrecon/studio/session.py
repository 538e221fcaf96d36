"""A studio: the tabs that are open, the one that is looked at, time, and the list of a batch."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from simrecon import scene as scenes
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.io.reading import read_bytes
from simrecon.job import Job
from simrecon.results.folder import holds_result
from simrecon.studio import opening
from simrecon.studio.player import Player
from simrecon.studio.tab import Tab

TABS_MAX = 8
_PATIENCE_S = 5.0
TAB = "tab"
"""Listeners are told that another tab is looked at."""


class Session:
    """What one studio holds.

    Attributes:
        tabs: that are open; current: the one that is looked at, None: none is open.
        listed: results of a batch folder, which can be opened.
        player: of the current tab.
        listeners: told what changed of the current tab: `tab`, `scene`, `clip` or `run`.
    """

    def __init__(self) -> None:
        self.tabs: list[Tab] = []
        self.current: Tab | None = None
        self.listed: tuple[Path, ...] = ()
        self.player = Player()
        self.listeners: list[Callable[[str], None]] = []
        self.lock = threading.RLock()
        self._loading: list[threading.Thread] = []

    def open(
        self,
        path: Path,
        reading: Job | None = None,
        scene: Path | None = None,
        contacts: Path | None = None,
        *,
        load: bool = True,
    ) -> None:
        """Open a result, evidence, a video, or the list of a batch.

        Args:
            path: of it.
            reading: how evidence is to be read.
            scene: file to begin with, whose comments are kept; None: that of the result, or a floor.
            contacts: file with wishes to begin with.
            load: read the evidence too, on another thread.

        Raises:
            InputError: it can't be opened.
        """
        opening.check(path)
        if path.is_dir() and not holds_result(path):
            self.listed = opening.results_in(path)
            self._tell(TAB)
            return
        if len(self.tabs) >= TABS_MAX:
            raise InputError(f"{path}: {TABS_MAX} tabs are open; valid: close one first")
        known = next((tab for tab in self.tabs if tab.path.resolve() == path.resolve()), None)
        if known is not None:
            self.show(known)
            return
        text = None if scene is None else _text(scene)
        asked = None if contacts is None else wishes.read(contacts)
        where = "scene.toml" if scene is None else str(scene)
        tab = Tab(path, opening.base_of(path, reading), text, asked, where)
        tab.listeners.append(lambda what: self._changed(tab, what))
        with self.lock:
            self.tabs.append(tab)
        self.show(tab)
        if load:
            loading = threading.Thread(target=tab.load, daemon=True, name="simrecon evidence")
            self._loading.append(loading)
            loading.start()

    def show(self, tab: Tab) -> None:
        """Look at another tab."""
        with self.lock:
            self.current = tab
            self._open_player()
        self._tell(TAB)

    def close(self, tab: Tab) -> None:
        """Close a tab; its unsaved edits are kept in the cache, and are there when it is opened again."""
        with self.lock:
            tab.close()
            self.tabs.remove(tab)
            self.current = self.tabs[-1] if self.tabs else None
            self._open_player()
        self._tell(TAB)

    @property
    def unsaved(self) -> bool:
        """Whether any tab has something unsaved."""
        return any(tab.unsaved for tab in self.tabs)

    def end(self) -> None:
        """Close all, and wait a while for what is being read: libraries do not like to be cut off."""
        for tab in self.tabs:
            tab.close()
        for loading in self._loading:
            loading.join(_PATIENCE_S)

    def _open_player(self) -> None:
        clip = None if self.current is None else self.current.clip
        if clip is not None:
            self.player.open(float(clip.times_s[0]), float(clip.times_s[-1]))

    def _changed(self, tab: Tab, what: str) -> None:
        if tab is self.current:
            if what == "clip":
                self._open_player()
            self._tell(what)

    def _tell(self, what: str) -> None:
        for listener in tuple(self.listeners):
            listener(what)


def _text(path: Path) -> str:
    """The text of a scene file that is valid."""
    scenes.read(path)
    return read_bytes(path).decode("utf-8", "surrogateescape")
