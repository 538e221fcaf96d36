"""What all panels share: edits are done one after another, and what can't be done is said."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from simrecon.errors import InputError, SimreconError
from simrecon.studio.session import Session
from simrecon.studio.stage import Stage
from simrecon.studio.tab import Tab

HALF_WRITTEN_S = 1.2
"""So long a field may hold what is not valid, before that is said."""
Event = Any
"""Of viser: its `client` is None where the studio itself has set a value."""


class Panel:
    """A part of the page at the side.

    Attributes:
        gui: viser's, where the panel is built.
        session, stage: what it is of.
    """

    def __init__(self, gui: Any, session: Session, stage: Stage) -> None:
        self.gui, self.session, self.stage = gui, session, stage

    @property
    def tab(self) -> Tab:
        """The one that is looked at.

        Raises:
            InputError: nothing is open.
        """
        if self.session.current is None:
            raise InputError("nothing is open; valid: open a result or evidence first")
        return self.session.current

    def doing(self, function: Callable[[Event], None]) -> Callable[[Event], None]:
        """A callback of viser that does something, alone, and says why if it can't."""

        def refused(event: Event, why: str) -> None:
            say(event.client, why)
            self.refresh("refused")

        return self._acting(function, refused)

    def changing(self, function: Callable[[Event], None]) -> Callable[[Event], None]:
        """As `doing`, of a field that is typed into: what is not valid yet may only be half written."""

        def refused(event: Event, why: str) -> None:
            threading.Timer(HALF_WRITTEN_S, self._refuse, (event, event.target.value, why)).start()

        return self._acting(function, refused)

    def _acting(
        self, function: Callable[[Event], None], refused: Callable[[Event, str], None]
    ) -> Callable[[Event], None]:
        def act(event: Event) -> None:
            if event.client is None:
                return
            try:
                with self.session.lock:
                    function(event)
            except SimreconError as error:
                refused(event, str(error))

        return act

    def _refuse(self, event: Event, value: Any, words: str) -> None:
        """Say what was not valid, if it still stands there."""
        if event.target.value == value:
            say(event.client, words)
            self.refresh("refused")

    def button(self, label: str, function: Callable[[Event], None], **looks: Any) -> Any:
        """A button that does something."""
        handle = self.gui.add_button(label, **looks)
        handle.on_click(self.doing(function))
        return handle

    def refresh(self, what: str) -> None:
        """Show what has changed."""


def say(client: Any, words: str, *, good: bool = False) -> None:
    """Tell one browser something."""
    client.add_notification(
        "Done" if good else "Not done",
        words,
        auto_close_seconds=6.0 if good else 15.0,
        color="green" if good else "red",
    )


def set_to(handle: Any, value: Any) -> None:
    """Give a field another value, if it has one."""
    if handle.value != value:
        handle.value = value
