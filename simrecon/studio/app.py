"""A studio that runs: session, server, view, panels, and the clock that moves the cursor."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import Any

from simrecon.errors import SimreconError
from simrecon.job import Job
from simrecon.studio.bar import Bar
from simrecon.studio.gate import LOOPBACK, Gate, new_token
from simrecon.studio.latest import Latest
from simrecon.studio.panel import Panel
from simrecon.studio.panel_run import RunPanel, SavePanel
from simrecon.studio.panel_scene import FloorPanel, ScenePanel
from simrecon.studio.panel_view import OpenPanel, ViewPanel
from simrecon.studio.serving import Server
from simrecon.studio.session import Session
from simrecon.studio.stage import Stage

RATE_HZ = 30.0
_REFRESH_S = 0.25
"""Progress of a run is shown so often."""


class Studio:
    """All of it.

    Attributes:
        session: what is open.
        address: with the token.
    """

    def __init__(
        self, session: Session, host: str = "127.0.0.1", port: int = 0, reading: Job | None = None
    ) -> None:
        """Serve a session.

        Raises:
            InputError: the port is taken, or there is no such address.
        """
        self.session = session
        local = host in LOOPBACK
        gate = Gate(new_token(), LOOPBACK if local else ())
        self._server = Server(host, port, gate)
        shown = host if local or host not in ("0.0.0.0", "::") else "127.0.0.1"  # nosec B104  # a comparison
        self.address = (
            f"http://{f'[{shown}]' if ':' in shown else shown}:{self._server.port}/?token={gate.token}"
        )
        self._stage = Stage(self._server.viser, session)
        self._bar = Bar(session, gate, self._wake, self._stage.spare)
        self._server.bar = self._bar
        self._panels = self._build(reading)
        self._ended, self._moved = threading.Event(), threading.Event()
        self._redraw, self._told = Latest(self._draw), 0.0
        self._what: set[str] = {"tab"}
        self._lock = threading.Lock()
        session.listeners.append(self._changed)
        threading.Thread(target=self._tick, daemon=True, name="simrecon clock").start()
        self._redraw.ask()

    def wait(self) -> None:
        """Go on until the program is interrupted."""
        while True:
            time.sleep(3600.0)

    def stop(self) -> None:
        """End it; runs that go on keep what they have solved."""
        self._ended.set()
        self._moved.set()
        self.session.end()
        self._server.stop()

    def _build(self, reading: Job | None) -> tuple[Panel, ...]:
        gui: Any = self._server.viser.gui
        self._server.viser.scene.configure_default_lights(True, cast_shadow=False)
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        gui.set_panel_label("simrecon studio")
        first = OpenPanel(gui, self.session, self._stage, reading)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Scene") as home:
            scene = ScenePanel(gui, self.session, self._stage, home)
        with tabs.add_tab("Floor"):
            floor = FloorPanel(gui, self.session, self._stage)
        with tabs.add_tab("Run"):
            run = RunPanel(gui, self.session, self._stage)
        with tabs.add_tab("Save"):
            save = SavePanel(gui, self.session, self._stage, run)
        with tabs.add_tab("View"):
            view = ViewPanel(gui, self.session, self._stage)
        return first, scene, floor, run, save, view

    def _changed(self, what: str) -> None:
        """Something of the current tab has changed."""
        with self._lock:
            self._what.add(what)
        if what == "run" and time.monotonic() - self._told < _REFRESH_S:
            self._moved.set()  # the clock shows it later
            return
        self._redraw.ask()

    def _draw(self) -> None:
        with self._lock:
            what, self._what = self._what, set()
        if not what:
            return
        self._told = time.monotonic()
        if what != {"choice"}:
            self._stage.draw()
        for panel in self._panels:
            for each in sorted(what):
                with contextlib.suppress(SimreconError):
                    panel.refresh(each)
        if "run" in what:
            self._bar.changed("clip")
        self._bar.moved()

    def _wake(self) -> None:
        self._moved.set()

    def _tick(self) -> None:
        """The clock: moves the cursor while it plays, and shows where it is."""
        player, before = self.session.player, time.monotonic()
        shown: tuple[Any, ...] = ()
        while not self._ended.is_set():
            self._moved.wait(1 / RATE_HZ if player.playing else 0.5)
            self._moved.clear()
            now = time.monotonic()
            player.advance(now - before)
            before = now
            state = (player.time_s, player.playing, player.loop, player.speed)
            if state != shown:
                shown = state
                self._stage.show()
                self._bar.moved()
            elif not player.playing:
                self._stage.catch_up()
            if self._what and now - self._told >= _REFRESH_S:
                self._redraw.ask()
            if player.playing:
                time.sleep(max(0.0, 1 / RATE_HZ - (time.monotonic() - now)))
