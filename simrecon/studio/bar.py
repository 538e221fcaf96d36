"""The bar under the view, as messages: time, plots, and the strip of contacts; its page is `page/bar.js`."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from simrecon.contact import parts
from simrecon.errors import InputError, SimreconError
from simrecon.io.limits import MISFITS
from simrecon.studio import strip
from simrecon.studio.clip import Clip
from simrecon.studio.gate import Gate
from simrecon.studio.session import Session
from simrecon.types import Array, ContactWish, Interval

Send = Callable[[str], None]
SLOW = "slow"
"""What a page says whose browser draws on the processor."""
_LONGEST = 4096
"""Of a message of the page, bytes."""


class Bar:
    """What the page shows, and what it asks for.

    Attributes:
        session: that it is of.
        on_time: is called after the cursor was moved, or set in motion.
    """

    def __init__(
        self,
        session: Session,
        gate: Gate,
        on_time: Callable[[], None] = lambda: None,
        on_slow: Callable[[], None] = lambda: None,
    ) -> None:
        self.session, self._gate, self.on_time, self._on_slow = session, gate, on_time, on_slow
        self._pages: dict[Send, str] = {}
        self._lock = threading.Lock()
        session.listeners.append(self.changed)

    def enter(self, browser: str, send: Send) -> None:
        """A page is there: it is told everything."""
        with self._lock:
            self._pages[send] = browser
        for message in (clip_message(self.session), time_message(self.session)):
            send(json.dumps(message))
        send(json.dumps(self._state(browser)))

    def leave(self, send: Send) -> None:
        """A page is gone."""
        with self._lock:
            self._pages.pop(send, None)

    def changed(self, what: str) -> None:
        """Tell all pages what changed of the current tab."""
        if what != "run":
            self._broadcast(clip_message(self.session))
        self.state()

    def moved(self) -> None:
        """Tell all pages where the cursor is."""
        self._broadcast(time_message(self.session))

    def state(self) -> None:
        """Tell each page whether it may edit, and what is unsaved."""
        with self._lock:
            pages = dict(self._pages)
        for send, browser in pages.items():
            send(json.dumps(self._state(browser)))

    def ask(self, browser: str, text: str) -> str:
        """Do what a page asks for; why it can't be done, or nothing.

        Args:
            browser: that asks.
            text: of its message.
        """
        if text == SLOW:
            self._on_slow()
            return ""
        if not self._gate.edits(browser):
            return "read only: another browser edits"
        try:
            said = json.loads(text) if len(text) <= _LONGEST else None
            if not isinstance(said, dict):
                raise InputError("a message must be a table")
            self._do(str(said.get("do")), said)
        except (SimreconError, *MISFITS) as error:
            return str(error)
        return ""

    def _do(self, what: str, said: dict[str, Any]) -> None:
        player, tab = self.session.player, self.session.current
        if what == "seek":
            player.seek(_number(said["t"]))
        elif what == "play":
            player.play(bool(said["on"]))
        elif what == "speed":
            player.speed = min(max(_number(said["v"]), 0.05), 4.0)
        elif what == "loop":
            player.set_loop(_number(said["a"]), _number(said["b"]))
        elif tab is None:
            raise InputError("nothing is open")
        elif what == "paint":
            span = self._on_frames(_number(said["a"]), _number(said["b"]))
            part, brush = str(said["part"]), str(said["brush"])
            wishes = strip.painted(tab.document.edits.wishes, part, brush, span)
            tab.document.wish(wishes, f"{part} {brush} {span[0]:g}-{span[1]:g} s")
        elif what == "mode":
            part, mode = str(said["part"]), str(said["mode"])
            tab.document.wish(strip.with_mode(tab.document.edits.wishes, part, mode), f"{part}: {mode}")
        elif what in ("undo", "redo"):
            getattr(tab.document, what)()
        else:
            raise InputError(f"do: found {what!r}; valid: seek, play, speed, loop, paint, mode, undo, redo")
        self.on_time()

    def _on_frames(self, low: float, high: float) -> Interval:
        """An interval that holds at least one frame of the clip, whole frames of it."""
        clip = self.session.current.clip if self.session.current else None
        if clip is None:
            raise InputError("there is no motion yet")
        low, high = sorted((low, high))
        half = 0.5 * float(np.median(np.diff(clip.times_s)))
        first, last = (float(clip.times_s[clip.frame_at(time)]) for time in (low, high))
        return round(max(first - half, 0.0), 3), round(last + half, 3)

    def _state(self, browser: str) -> dict[str, Any]:
        tab = self.session.current
        return {
            "type": "state",
            "edits": self._gate.edits(browser),
            "unsaved": self.session.unsaved,
            "undo": tab.document.undoes if tab else "",
            "redo": tab.document.redoes if tab else "",
            "run": tab.run.progress.words if tab and tab.run else "",
        }

    def _broadcast(self, message: dict[str, Any]) -> None:
        text = json.dumps(message)
        with self._lock:
            pages = tuple(self._pages)
        for send in pages:
            send(text)


def clip_message(session: Session) -> dict[str, Any]:
    """Plots and strip of the current tab; A is what was opened, B the last run."""
    tab = session.current
    first = None if tab is None else tab.clip
    if tab is None or first is None:
        return {"type": "clip", "times": [], "parts": [], "inside": []}
    second = tab.preview
    wishes = {wish.part: wish for wish in tab.document.edits.wishes}
    none = ContactWish("")
    return {
        "type": "clip",
        "title": tab.title,
        "times": _listed(first.times_s, 4),
        "force": _listed(first.force_N(), 1),
        "height": _listed(first.pelvis_m(), 4),
        "b": None if second is None else _curves(second),
        "parts": [_part(name, wishes.get(name, none), first, second) for name in parts.names()],
        "inside": [{"name": one.name, "words": one.words, "spans": one.spans_s} for one in tab.inside],
    }


def time_message(session: Session) -> dict[str, Any]:
    """Where the cursor is."""
    player = session.player
    return {
        "type": "time",
        "t": round(player.time_s, 4),
        "playing": player.playing,
        "speed": player.speed,
        "loop": player.loop,
    }


def _curves(clip: Clip) -> dict[str, Any]:
    return {
        "times": _listed(clip.times_s, 4),
        "force": _listed(clip.force_N(), 1),
        "height": _listed(clip.pelvis_m(), 4),
    }


def _part(name: str, wish: ContactWish, first: Clip, second: Clip | None) -> dict[str, Any]:
    return {
        "name": name,
        "mode": wish.mode,
        "found": first.touched.get(name, ()),
        "found_b": () if second is None else second.touched.get(name, ()),
        "touch": wish.touch,
        "free": wish.free,
        "auto": wish.auto,
    }


def _listed(values: Array, digits: int) -> list[float | None]:
    """Numbers for JSON; what is not finite is null."""
    return [round(value, digits) if np.isfinite(value) else None for value in values.tolist()]


def _number(value: Any) -> float:
    number = float(value)
    if not np.isfinite(number):
        raise InputError(f"found {value!r}; valid: a number")
    return number
