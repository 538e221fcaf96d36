"""A studio in a real browser without a screen: Chromium, driven by selenium. Both are optional."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tools import CHECKOUT

FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--window-size=1440,900",
)
COUNTERS = """
window.__draws = 0; window.__frames = 0; window.__times = 0; window.__clip = null; window.__clipAt = 0;
for (const name of ["drawElements", "drawArrays", "drawElementsInstanced"]) {
  const plain = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...all) {
    window.__draws++;
    return plain.apply(this, all);
  };
}
let before = 0;
const tick = () => {
  if (window.__draws !== before) { window.__frames++; before = window.__draws; }
  requestAnimationFrame(tick);
};
requestAnimationFrame(tick);
const Plain = window.WebSocket;
window.WebSocket = class extends Plain {
  constructor(...all) {
    super(...all);
    if (!String(all[0]).includes("/studio/bar")) return;
    this.addEventListener("message", (event) => {
      const said = JSON.parse(event.data);
      if (said.type === "time") window.__times++;
      if (said.type === "clip") { window.__clip = said; window.__clipAt = performance.now(); }
      if (said.type === "state") window.__state = said;
    });
  }
};
"""
"""Counts what is drawn and heard; put into the page before anything else."""
SCRUB = """
const [seconds, done] = arguments, strip = document.querySelector("#studio-canvas");
const box = strip.getBoundingClientRect();
strip.setPointerCapture = () => {};
const send = (kind, x) => strip.dispatchEvent(new PointerEvent(kind, {
  clientX: x, clientY: box.top + 6, pointerId: 1, bubbles: true, isPrimary: true, button: 0 }));
const begun = performance.now(), frames = window.__frames, times = window.__times;
send("pointerdown", box.left + 110);
const go = () => {
  const spent = (performance.now() - begun) / 1000;
  if (spent > seconds) {
    send("pointerup", box.left + 110);
    done([(window.__frames - frames) / spent, (window.__times - times) / spent]);
    return;
  }
  send("pointermove", box.left + 110 + (box.width - 130) * Math.abs(((spent / 2) % 2) - 1));
  requestAnimationFrame(go);
};
requestAnimationFrame(go);
"""


def needed() -> tuple[Any, str, str]:
    """Selenium, and where Chromium and its driver are; skips the test where one is missing."""
    pytest.importorskip("viser", reason="the studio needs the extra studio")
    driver = pytest.importorskip("selenium.webdriver", reason="browsers are driven by selenium")
    places = [shutil.which(name) for name in ("chromium", "chromedriver")]
    if None in places:
        pytest.skip("needs chromium and chromedriver")
    return driver, str(places[0]), str(places[1])


class Page:
    """A studio's page in a browser of its own."""

    def __init__(self, profile: Path) -> None:
        driver, chromium, chromedriver = needed()
        options = driver.ChromeOptions()
        options.binary_location = chromium
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        service = driver.ChromeService(chromedriver)
        self.driver = driver.Chrome(options=options, service=service)
        self.driver.set_script_timeout(120)
        self.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": COUNTERS})

    def script(self, text: str, *values: Any) -> Any:
        """Run a script in the page."""
        return self.driver.execute_script(text, *values)

    def open(self, address: str, seconds: float = 60.0) -> None:
        """Open a studio, and wait until it can be used."""
        self.driver.get(address)
        self.until(self.is_usable, "a page that can be used", seconds)

    def is_usable(self) -> bool:
        """Whether panels, bar and view are there."""
        return bool(
            self.script(
                "return window.__clip && window.__clip.times.length > 0 && window.__frames > 1 "
                "&& document.body.innerText.includes('Add at the person')"
            )
        )

    def until(self, holds: Callable[[], Any], what: str, seconds: float = 60.0) -> Any:
        """Wait until something holds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = holds()
            if found:
                return found
            time.sleep(0.02)
        raise AssertionError(f"waited {seconds:g} s in vain for {what}")

    def press(self, label: str) -> None:
        """Press a button of the panel, once it is there."""
        press = (
            "const found = [...document.querySelectorAll('button')]"
            ".find((b) => b.offsetParent && b.textContent.trim() === arguments[0]);"
            "if (found) found.click(); return !!found;"
        )
        self.until(lambda: self.script(press, label), f"a button {label}")

    def show(self, label: str) -> None:
        """Scroll the panel to a button, once it is there."""
        scroll = (
            "const found = [...document.querySelectorAll('button')]"
            ".find((b) => b.offsetParent && b.textContent.trim() === arguments[0]);"
            "if (found) found.scrollIntoView({block: 'end'}); return !!found;"
        )
        self.until(lambda: self.script(scroll, label), f"a button {label}")

    def turn_to(self, label: str) -> None:
        """Turn to a tab of the panel."""
        find = (
            "return [...document.querySelectorAll('[role=tab]')]"
            ".find((b) => b.textContent.trim() === arguments[0]);"
        )
        self.until(lambda: self.script(find, label), f"a tab {label}").click()

    def unfold(self, label: str) -> None:
        """Open a folder of the panel."""
        find = (
            "return [...document.querySelectorAll('div')]"
            ".find((one) => one.offsetParent && !one.querySelector('div') && "
            "one.textContent.trim() === arguments[0]);"
        )
        self.until(lambda: self.script(find, label), f"a folder {label}").click()

    def fill(self, label: str, text: str, which: int = 0) -> None:
        """Write into a field; `which` of a vector's three."""
        from selenium.webdriver.common.keys import Keys

        find = (
            "const label = [...document.querySelectorAll('label')]"
            ".find((one) => one.offsetParent && one.textContent.trim() === arguments[0]);"
            "if (!label) return null;"
            "let around = label; while (!around.querySelector('input')) around = around.parentElement;"
            "const found = around.querySelectorAll('input')[arguments[1]];"
            "found.scrollIntoView({block: 'center'}); return found;"
        )
        field = self.until(lambda: self.script(find, label, which), f"a field {label}")
        field.click()
        field.send_keys(Keys.CONTROL, "a")
        field.send_keys(text + Keys.ENTER)

    def inside(self) -> dict[str, str]:
        """What the motion goes through, as the bar says it."""
        return {one["name"]: one["words"] for one in self.script("return window.__clip.inside")}

    def state(self) -> dict[str, Any]:
        """What the bar was told last of edits and runs."""
        return dict(self.script("return window.__state"))

    def says(self, words: str) -> bool:
        """Whether the page shows some words."""
        return bool(self.script("return document.body.innerText.includes(arguments[0])", words))

    def drag(self, *places: tuple[float, float]) -> None:
        """Drag with the mouse along places in the page, slowly."""
        from selenium.webdriver.common.actions.action_builder import ActionBuilder

        builder = ActionBuilder(self.driver, duration=150)
        mouse = builder.pointer_action
        (x, y), *others = places
        mouse.move_to_location(round(x) - 3, round(y) - 3).pause(0.5).move_to_location(round(x), round(y))
        mouse.pause(0.7).pointer_down().pause(0.3)
        for x, y in others:
            mouse.move_to_location(round(x), round(y)).pause(0.15)
        mouse.pause(0.4).pointer_up()
        builder.perform()

    def dismiss(self) -> None:
        """Close what the page says at its corner."""
        self.script(
            "document.querySelectorAll('.mantine-Notification-closeButton').forEach((one) => one.click())"
        )

    def scrub(self, seconds: float) -> tuple[float, float]:
        """Drag over the bar: frames drawn, and places answered, per second."""
        drawn, answered = self.driver.execute_async_script(SCRUB, seconds)
        return float(drawn), float(answered)

    def shot(self, path: Path) -> None:
        """A picture of the page."""
        self.driver.save_screenshot(str(path))

    def close(self) -> None:
        """End the browser."""
        self.driver.quit()


@contextlib.contextmanager
def page(profile: Path) -> Iterator[Page]:
    """A browser, as long as it is needed."""
    shown = Page(profile)
    try:
        yield shown
    finally:
        shown.close()


class Served:
    """A studio as a process of its own."""

    def __init__(self, *words: str | Path, cache: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(CHECKOUT), "SIMRECON_CACHE": str(cache)}
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "simrecon", "studio", *map(str, words)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=environment,
            cwd=cache,
        )
        assert self.process.stdout is not None
        found = re.search(r"http\S+", self.process.stdout.readline())
        assert found is not None
        self.address = found[0]

    def kill(self) -> None:
        """End it as a power cut would."""
        self.process.kill()
        self.end()

    def end(self) -> None:
        """End it."""
        self.process.terminate()
        self.process.communicate(timeout=30)


@contextlib.contextmanager
def served(*words: str | Path, cache: Path) -> Iterator[Served]:
    """A studio, as long as it is needed."""
    cache.mkdir(parents=True, exist_ok=True)
    studio = Served(*words, cache=cache)
    try:
        yield studio
    finally:
        studio.end()


def wait_for(path: Path, seconds: float = 20.0) -> bytes:
    """The content of a file that is being written."""
    end = time.monotonic() + seconds
    while not path.is_file() and time.monotonic() < end:
        time.sleep(0.05)
    return path.read_bytes()
