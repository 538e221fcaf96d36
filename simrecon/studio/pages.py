"""What the studio answers to requests for pages: viser's, with the bar in it, and the files of the bar."""

from __future__ import annotations

import http
from typing import Any

from simrecon import resources
from simrecon.studio.gate import Answer

_TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8"}
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_INSIDE = '<link rel="stylesheet" href="studio/bar.css"><script src="studio/bar.js"></script>'


def response(status: http.HTTPStatus, body: bytes, kind: str) -> Any:
    """A response of websockets, with headers of caution."""
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body)), **_HEADERS})
    return Response(int(status), status.phrase, headers, body)


def missing() -> Any:
    """A response where there is no such file."""
    return response(http.HTTPStatus.NOT_FOUND, b"404\n", "text/plain")


def page(name: str) -> Any:
    """A file of the bar."""
    files = {path.name: path for path in (resources.folder("studio") / "page").iterdir()}
    path = files.get(name)
    if path is None or path.suffix not in _TYPES:
        return missing()
    return response(http.HTTPStatus.OK, path.read_bytes(), _TYPES[path.suffix])


def with_bar(plain: Any) -> Any:
    """The page of viser, not compressed, with the bar in it."""
    text = bytes(plain.body)
    at = text.index(b"</head>")
    text = text[:at] + _INSIDE.encode() + text[at:]
    return response(http.HTTPStatus.OK, text, "text/html; charset=utf-8")


def marked(plain: Any, answer: Answer) -> Any:
    """A response with the cookie, and headers of caution."""
    if plain is None:
        return None
    for name, value in _HEADERS.items():
        if name not in plain.headers:
            plain.headers[name] = value
    if answer.cookie:
        plain.headers["Set-Cookie"] = answer.cookie
    return plain
