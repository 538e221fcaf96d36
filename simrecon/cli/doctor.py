"""`simrecon doctor`: what is there, what each part is for, and what to type for what is missing."""

from __future__ import annotations

import argparse
import ctypes.util
import importlib.metadata
import platform
import shutil
import tempfile
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from simrecon.cli import arguments
from simrecon.cli.commands import purpose
from simrecon.errors import printable
from simrecon.evidence.video import weights
from simrecon.io import provenance
from simrecon.system import extras, memory
from simrecon.system.processor import cores

THERE, MISSING, FAILS = "there", "missing", "FAILS"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox")
ELSEWHERE = "it is one file"
LEAST_FREE = 1 << 30
GIB = 1 << 30
EXIT_FAILS = 1
Line = tuple[str, str, str]
"""What it is about, `there`, `missing` or `FAILS`, and a text."""


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "doctor", _doctor, purpose("doctor"))
    parser.add_argument(
        "folder", nargs="?", default=".", metavar="DIR", help="where results are to be written [.]"
    )


def _doctor(options: argparse.Namespace) -> int:
    found = list(lines(Path(options.folder)))
    for about, state, text in found:
        print(f"{about:<20} {state:<8} {printable(text)}".rstrip())
    failed = [about for about, state, _ in found if state == FAILS]
    print(f"\n{_verdict(failed)}")
    return EXIT_FAILS if failed else 0


def _verdict(failed: list[str]) -> str:
    if failed:
        return f"simrecon cannot work here before this is put right: {', '.join(failed)}"
    return "simrecon can work here; what is missing is needed only for what it stands beside"


def lines(folder: Path) -> Iterator[Line]:
    """All that was looked at.

    Args:
        folder: where results are to be written.
    """
    yield from _versions()
    yield from _machine()
    yield from _extras()
    yield from _weights()
    yield from _desktop()
    yield from _writable("results", folder)
    yield from _writable("cache of weights", weights.folder())


def _versions() -> Iterator[Line]:
    for name, version in provenance.versions().items():
        yield name, THERE if version else FAILS, version or "reinstall simrecon"
    yield "system", THERE, f"{platform.system()} {platform.release()}, {platform.machine()}"


def _machine() -> Iterator[Line]:
    count = cores()
    yield "cores", THERE, f"{count}; a run uses them all unless --threads says less"
    yield "memory", THERE, f"{memory.total_bytes() / GIB:.1f} GiB"


def _extras() -> Iterator[Line]:
    for name, extra in extras.EXTRAS.items():
        if missing := extra.missing():
            yield f"extra {name}", MISSING, f"{extra.purpose} ({', '.join(missing)}): {extras.how(name)}"
        else:
            known = ", ".join(f"{package} {_version(package)}" for package in extra.packages.values())
            yield f"extra {name}", THERE, f"{extra.purpose} ({known})"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "of unknown version"


def _weights() -> Iterator[Line]:
    for one in weights.TABLE:
        state = weights.state(one)
        if state == THERE:
            yield f"weights {one.name}", THERE, one.purpose
        else:
            word = MISSING if state == MISSING else FAILS
            again = "" if word == MISSING else " --force"
            name = f" {one.name}" if one.name in weights.BY_NAME else ""
            yield f"weights {one.name}", word, f"{one.purpose}, for videos: {weights.COMMAND}{name}{again}"


def _desktop() -> Iterator[Line]:
    names = [name for name in ("EGL", "GL", "OSMesa") if ctypes.util.find_library(name)]
    text = "for MuJoCo's own viewer; simrecon draws without it"
    yield "OpenGL", THERE if names else MISSING, f"{', '.join(names)}: {text}" if names else text
    browser, shown = _browser(), "shows report.html and the studio"
    without = next((name for name in BROWSERS if shutil.which(name)), None)
    if browser is not None:
        yield "browser", THERE, f"{browser}: {shown}"
    elif without is not None:
        yield "browser", THERE, f"{without}, but no screen: {shown} elsewhere, for {ELSEWHERE}"
    else:
        yield "browser", MISSING, f"{shown}; copy report.html to a machine that has one: {ELSEWHERE}"


def _browser() -> str | None:
    """Name of the browser that opens pages here; None without one, or without a screen."""
    try:
        return str(getattr(webbrowser.get(), "name", "of the system"))
    except webbrowser.Error:
        return None


def _writable(about: str, folder: Path) -> Iterator[Line]:
    """Whether a folder, or the nearest one above it that is there, can be written, and its free space."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    try:
        with tempfile.TemporaryFile(dir=place):
            pass
        free = shutil.disk_usage(place).free
    except OSError as error:
        yield about, FAILS, f"{folder}: cannot be written ({error.strerror or error}); give another folder"
        return
    short = free < LEAST_FREE
    text = f"{folder}: can be written, {free / GIB:.1f} GiB free"
    yield about, FAILS if short else THERE, text + ("; make room for 1 GiB" if short else "")
