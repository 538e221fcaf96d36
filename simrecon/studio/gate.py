"""Who may look, and who may edit: requests are let in by a token, and one browser at a time edits.

The token stands in the address that the studio prints. The first page that is asked for with it gets a cookie
that all further requests of that browser carry. Requests for another host, or from another page, are
refused: so a page of the web can't reach the studio through a name of its own (DNS rebinding).
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")
AWAY_S = 5.0
"""A browser that was away for so long no longer holds the right to edit."""
_SESSIONS_MAX = 100


@dataclass(frozen=True)
class Answer:
    """To a request.

    Attributes:
        allowed: whether it is let in.
        session: of the browser; empty: none.
        cookie: to be set, as the value of a header; empty: none.
        reason: why it is refused, for people.
    """

    allowed: bool
    session: str = ""
    cookie: str = ""
    reason: str = ""


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(24)


@dataclass
class Gate:
    """Lets requests in, and says who edits.

    Attributes:
        token: of the studio.
        hosts: names and addresses by which it may be asked for; empty: any address, by its number.
        clock: seconds, monotonic.
    """

    token: str
    hosts: tuple[str, ...] = LOOPBACK
    clock: Callable[[], float] = time.monotonic
    _sessions: dict[str, float] = field(default_factory=dict)
    _open: dict[str, int] = field(default_factory=dict)
    _editor: str = ""
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def ask(self, path: str, headers: Mapping[str, str], port: int) -> Answer:
        """Whether a request is let in.

        Args:
            path: with its query.
            headers: by name, as `headers.get` finds them.
            port: of the studio, after which its cookie is named.
        """
        try:
            return self._answer(path, headers, port)
        except (LookupError, ValueError):  # a header that is there twice, an address that is none
            return Answer(False, reason="the request is damaged")

    def _answer(self, path: str, headers: Mapping[str, str], port: int) -> Answer:
        host = headers.get("Host", "")
        if not self._own(host):
            return Answer(False, reason="this studio is not asked for under that name")
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return Answer(False, reason="another page may not ask this studio")
        name = f"simrecon-studio-{port}"
        known = _cookie(headers.get("Cookie", ""), name)
        with self._lock:
            if known in self._sessions:
                return Answer(True, known)
            said = parse_qs(urlsplit(path).query).get("token", [""])[0]
            if not hmac.compare_digest(said.encode(), self.token.encode()):
                return Answer(False, reason="the address lacks the token that `simrecon studio` printed")
            session = secrets.token_urlsafe(24)
            self._sessions[session] = self.clock()
            while len(self._sessions) > _SESSIONS_MAX:
                self._sessions.pop(min(self._sessions, key=lambda one: self._sessions[one]))
        return Answer(True, session, f"{name}={session}; HttpOnly; SameSite=Strict; Path=/")

    def enter(self, session: str) -> None:
        """A connection of a browser begins; the first browser edits."""
        with self._lock:
            self._open[session] = self._open.get(session, 0) + 1
            self._settle()

    def leave(self, session: str) -> None:
        """A connection of a browser ends."""
        with self._lock:
            self._open[session] = max(self._open.get(session, 0) - 1, 0)
            self._sessions[session] = self.clock()

    def edits(self, session: str) -> bool:
        """Whether a browser may edit: the first one, or the next once that was away for `AWAY_S`."""
        with self._lock:
            self._settle()
            return bool(session) and session == self._editor

    def _settle(self) -> None:
        """Give the right to edit on, if whoever holds it is gone."""
        if self._open.get(self._editor, 0):
            return
        away = self.clock() - self._sessions.get(self._editor, -AWAY_S)
        if self._editor and away < AWAY_S:
            return
        self._editor = next((one for one, count in self._open.items() if count), self._editor)

    def _own(self, host: str) -> bool:
        name = urlsplit(f"//{host}").hostname or ""
        if self.hosts:
            return name in self.hosts
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return name == "localhost"
        return True


def _cookie(header: str, name: str) -> str:
    try:
        morsel = SimpleCookie(header).get(name)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value
