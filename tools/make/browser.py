"""Chromium without a screen, told what to do over its debugging protocol: pictures and speeds of pages."""

from __future__ import annotations

import base64
import contextlib
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from websockets.sync import client

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--hide-scrollbars",
    "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--remote-debugging-port=0",
)  # fmt: skip
STARTS_S, READY_S, LARGEST = 30.0, 120.0, 1 << 28


class Page:
    """The one page of a browser."""

    def __init__(self, socket: client.ClientConnection) -> None:
        self._socket, self._count = socket, 0

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, and wait for what it returns.

        Raises:
            RuntimeError: the browser refuses it.
        """
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": parameters}))
        while True:
            said = json.loads(self._socket.recv(timeout=READY_S))
            if said.get("id") != self._count:
                continue
            if "error" in said:
                raise RuntimeError(f"{method}: {said['error']['message']}")
            return dict(said["result"])

    def run(self, script: str) -> Any:
        """Value of a script, awaited if it is a promise.

        Raises:
            RuntimeError: the script fails.
        """
        said = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in said:
            raise RuntimeError(f"a script failed: {said['exceptionDetails']}")
        return said["result"].get("value")

    def size(self, width: int, height: int, *, dark: bool = False) -> None:
        """Size of the window, px, and whether it wishes dark pages."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        wish = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.ask("Emulation.setEmulatedMedia", features=wish)

    def open(self, address: str, ready: str) -> None:
        """Open an address, and wait until an expression of the page is true.

        Raises:
            TimeoutError: it did not become true.
        """
        self.ask("Page.navigate", url=address)
        end = time.monotonic() + READY_S
        while not self.run(f"Boolean({ready})"):
            if time.monotonic() > end:
                raise TimeoutError(f"{address}: waited {READY_S:g} s in vain for {ready}")
            time.sleep(0.1)

    def picture(self, *, whole: bool = False) -> bytes:
        """PNG of the window, or of the whole page."""
        told = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        return base64.b64decode(told["data"])


@contextlib.contextmanager
def page() -> Iterator[Page]:
    """A browser with one page, as long as it is needed.

    Raises:
        FileNotFoundError: there is no Chromium.
    """
    found = next((path for path in map(shutil.which, NAMES) if path), None)
    if found is None:
        raise FileNotFoundError(f"needs a browser: {', '.join(NAMES)}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [found, *FLAGS, f"--user-data-dir={profile}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            port, path = _told(Path(profile) / "DevToolsActivePort")
            address = f"ws://127.0.0.1:{port}{path}"
            with client.connect(address, max_size=LARGEST, proxy=None) as browser:
                root = Page(browser)
                targets = root.ask("Target.getTargets")["targetInfos"]
            target = next(one["targetId"] for one in targets if one["type"] == "page")
            address = f"ws://127.0.0.1:{port}/devtools/page/{target}"
            with client.connect(address, max_size=LARGEST, proxy=None) as socket:
                yield Page(socket)
        finally:
            process.terminate()
            process.wait(timeout=30)


def _told(path: Path) -> list[str]:
    """The lines of the file in which a browser says where it listens: port and path."""
    end = time.monotonic() + STARTS_S
    while time.monotonic() < end:
        if path.is_file() and len(lines := path.read_text(encoding="utf-8").split()) == 2:
            return lines
        time.sleep(0.05)
    raise TimeoutError(f"the browser did not start within {STARTS_S:g} s")
