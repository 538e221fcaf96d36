"""Serves the studio: viser behind the gate, with the bar beside it on the same port."""

from __future__ import annotations

import asyncio
import contextlib
import contextvars
import http
import importlib.util
import io
import json
import socket
import threading
from collections.abc import Iterator
from typing import Any

from simrecon.errors import InputError
from simrecon.studio import pages
from simrecon.studio.bar import Bar
from simrecon.studio.gate import Gate
from simrecon.system import extras

BAR, PAGE = "/studio/bar", "/studio/"
_browser: contextvars.ContextVar[str] = contextvars.ContextVar("browser", default="")
_starting = threading.Lock()
_LOOKING = ("ViewerCameraMessage", "FileTransferPartAck", "GetRenderResponseMessage")
"""Messages of viser's page that change nothing, which any browser may send."""
_NEVER = ("ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload")
"""Messages that are passed over: they would publish the studio elsewhere, or fill its memory."""


def check_installed() -> None:
    """Refuse to go on without the extra.

    Raises:
        InputError: viser is not installed.
    """
    if importlib.util.find_spec("viser") is None:
        raise InputError(f"the studio needs viser: {extras.how('studio')}")


class Server:
    """A viser server that lets nobody in without the token, and lets one browser edit.

    Attributes:
        viser: the server, for scene and panels.
    """

    def __init__(self, host: str, port: int, gate: Gate) -> None:
        """Listen.

        Args:
            host: address to listen on.
            port: 0: any that is free.
            gate: lets requests in.

        Raises:
            InputError: the port is taken, or there is no such address.
        """
        import viser

        self._gate = gate
        self.bar: Bar | None = None
        _check_free(host, port)
        with _starting, self._guarded(), contextlib.redirect_stdout(io.StringIO()):
            self.viser = viser.ViserServer(host=host, port=port, verbose=False)
        self._filter()

    @property
    def port(self) -> int:
        """That it listens on."""
        return int(self.viser.get_port())

    def stop(self) -> None:
        """Close all connections."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser.stop()

    @contextlib.contextmanager
    def _guarded(self) -> Iterator[None]:
        """What viser asks websockets for goes through the gate.

        viser has no way to look at requests, and takes `serve` from its module when it starts.
        """
        from websockets.asyncio import server as websockets

        plain = websockets.serve

        def serve(handler: Any, *places: Any, process_request: Any, **settings: Any) -> Any:
            async def connected(connection: Any) -> None:
                await self._connected(connection, handler)

            def asked(connection: Any, request: Any) -> Any:
                return self._asked(connection, request, process_request)

            return plain(connected, *places, process_request=asked, **settings)

        websockets.serve = serve
        try:
            yield
        finally:
            websockets.serve = plain

    def _asked(self, connection: Any, request: Any, process_request: Any) -> Any:
        """A response, or None: a websocket is opened."""
        port = connection.local_address[1]
        answer = self._gate.ask(request.path, request.headers, port)
        connection.simrecon_browser = answer.session
        if not answer.allowed:
            return pages.response(http.HTTPStatus.FORBIDDEN, f"403: {answer.reason}\n".encode(), "text/plain")
        if "websocket" in map(str.lower, request.headers.get_all("Upgrade")):
            return None
        path = request.path.partition("?")[0]
        if path.startswith(PAGE):
            return pages.page(path.removeprefix(PAGE))
        if "Accept-Encoding" in request.headers:  # to compress the page takes longer than to send it
            del request.headers["Accept-Encoding"]
        try:
            response = process_request(connection, request)
        except (OSError, ValueError):  # a name that no file can have
            response = pages.missing()
        if path in ("/", "/index.html") and response is not None:
            response = pages.with_bar(response)
        return pages.marked(response, answer)

    async def _connected(self, connection: Any, handler: Any) -> None:
        browser = connection.simrecon_browser
        self._gate.enter(browser)
        _browser.set(browser)
        try:
            if connection.request.path.partition("?")[0] == BAR:
                await self._talk(connection, browser)
            else:
                await handler(connection)
        finally:
            self._gate.leave(browser)
            if self.bar is not None:
                asyncio.get_running_loop().call_later(0.1, self.bar.state)

    async def _talk(self, connection: Any, browser: str) -> None:
        """The bar's own connection, as long as it lasts."""
        from websockets.exceptions import ConnectionClosed

        if self.bar is None:
            return
        loop, queue = asyncio.get_running_loop(), asyncio.Queue[str]()

        def send(text: str) -> None:
            with contextlib.suppress(RuntimeError):  # the server has stopped
                loop.call_soon_threadsafe(queue.put_nowait, text)

        async def speak() -> None:
            while True:
                await connection.send(await queue.get())

        speaking = loop.create_task(speak())
        self.bar.enter(browser, send)
        self.bar.state()
        try:
            async for text in connection:
                refused = await loop.run_in_executor(None, self.bar.ask, browser, str(text))
                if refused:
                    send(json.dumps({"type": "refused", "words": refused}))
        except ConnectionClosed:
            pass
        finally:
            self.bar.leave(send)
            speaking.cancel()

    def _filter(self) -> None:
        """Messages of browsers that may not edit are passed over, before viser sees them."""
        inner = self.viser._websock_server
        browsers: dict[int, str] = {}

        def passes(client: int, message: Any) -> bool:
            kind = type(message).__name__
            if kind in _NEVER:
                return False
            return kind in _LOOKING or self._gate.edits(browsers.get(client, ""))

        def guarded(handle: Any) -> Any:
            async def filtered(client: int, message: Any) -> None:
                if passes(client, message):
                    await handle(client, message)

            return filtered

        def connected(connection: Any) -> None:
            browsers[connection.client_id] = _browser.get()
            connection._handle_incoming_message = guarded(connection._handle_incoming_message)

        inner._handle_incoming_message = guarded(inner._handle_incoming_message)
        inner.on_client_connect(connected)
        inner.on_client_disconnect(lambda connection: browsers.pop(connection.client_id, None))


def _check_free(host: str, port: int) -> None:
    """Refuse a port that is taken: viser would look for another one."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as error:
        where = f"--host {host} --port {port}"
        raise InputError(
            f"{where}: cannot be listened on ({error.strerror or error}); valid: a free port"
        ) from error
