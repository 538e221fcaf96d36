"""Where numbers come from: versions, the code itself, and the machine."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
from functools import cache
from pathlib import Path
from typing import Any

import simrecon
from simrecon import resources
from simrecon.system import memory

NO_MOTION_DEPENDS_ON = (
    "batch/",
    "bench/",
    "cli/",
    "drawing/",
    "evaluation/",
    "exports/",
    "metrics/",
    "studio/",
)
"""Rooms of the package that no motion depends on."""


PACKAGES = {"opencv": "opencv-contrib-python-headless"}
"""Libraries whose package has another name."""


def versions() -> dict[str, str | None]:
    """Versions of simrecon, Python and the libraries that decide the numbers; None where one is missing."""
    known: dict[str, str | None] = {"simrecon": simrecon.__version__, "python": platform.python_version()}
    return known | {name: _installed(name) for name in ("mujoco", "numpy", "scipy", "nlopt", "opencv")}


@cache
def _installed(library: str) -> str | None:
    """Version of a library by what its package says, which takes long to read."""
    try:
        return importlib.metadata.version(PACKAGES.get(library, library))
    except importlib.metadata.PackageNotFoundError:
        return None


@cache
def code_digest() -> str:
    """SHA-256 of the package's sources and data, less what no motion depends on."""
    digest = hashlib.sha256()
    for folder in (Path(simrecon.__file__).parent, resources.folder("models")):
        for path in sorted(folder.rglob("*")):
            inside = path.relative_to(folder).as_posix()
            if path.suffix in (".py", ".toml", ".npz") and not inside.startswith(NO_MOTION_DEPENDS_ON):
                digest.update(inside.encode() + path.read_bytes())
    return digest.hexdigest()


def digest_of(content: Any) -> str:
    """SHA-256 of plain data, as sorted JSON."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes, or of all files in a folder with their names."""
    if path.is_file():
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    inside = sorted(item for item in path.rglob("*") if item.is_file())
    return digest_of([(item.relative_to(path).as_posix(), file_digest(item)) for item in inside])


def machine() -> dict[str, Any]:
    """What the numbers were made on: processor, cores, memory and system."""
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next(
            (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), model
        )
    except OSError:  # not Linux
        pass
    gib = round(memory.total_bytes() / 2**30)
    return {
        "processor": model,
        "cores": os.cpu_count(),
        "memory_GiB": gib,
        "system": platform.system(),
    }
