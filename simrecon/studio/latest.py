"""Work of which only the newest request counts, such as that of a drag."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Latest:
    """Calls a function as often as it can keep up with; the last request is always served.

    Requests come from any thread; one that comes while the function runs is served by the thread it runs on.
    """

    def __init__(self, function: Callable[[], None]) -> None:
        self._function = function
        self._lock = threading.Lock()
        self._runs = self._asked = False

    def ask(self) -> None:
        """Call the function, or have it called once more."""
        with self._lock:
            self._asked = True
            if self._runs:
                return
            self._runs = True
        while True:
            with self._lock:
                if not self._asked:
                    self._runs = False
                    return
                self._asked = False
            try:
                self._function()
            except BaseException:
                with self._lock:
                    self._runs = False
                raise
