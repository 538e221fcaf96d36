"""Whether a result is as it was written: sizes and hashes of its files, noted when it was finished."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simrecon.io import atomic
from simrecon.io.messages import shown
from simrecon.io.provenance import file_digest
from simrecon.results.folder import FILES, MODEL, MOTION, OVERLAYS, PAGE, REPORT

NEEDED = (MOTION, MODEL, REPORT)
"""Without these there is no result; pictures may be removed by who does not need them."""

Files = Mapping[str, Any]


def note(folder: Path) -> dict[str, dict[str, Any]]:
    """Bring the files of a result to the disk; then their `bytes` and `sha256`, by name.

    Raises:
        OSError: it can't be read, or the disk fails.
    """
    atomic.flush_all(folder)
    paths = (folder / name for name in FILES if name != PAGE)  # which may be made anew
    return {
        path.name: {"bytes": path.stat().st_size, "sha256": file_digest(path)}
        for path in paths
        if path.is_file()
    }


def damage(folder: Path, files: Any, *, hashes: bool = False) -> str:
    """What is wrong with a result, in a few words; nothing is `""`.

    Args:
        folder: of the result.
        files: what `note` said of it, as it was read back.
        hashes: also compare the hashes, for which all is read.
    """
    if not isinstance(files, Mapping) or not all(name in files for name in NEEDED):
        return "nothing is noted of its files"
    for name, said in files.items():
        path = folder / name
        if not isinstance(said, Mapping) or name not in FILES:
            return "what is noted of its files is damaged"
        if not path.is_file():
            if name in OVERLAYS:
                continue
            return f"{name} is missing"
        if (size := path.stat().st_size) != said.get("bytes"):
            return f"{name} has {size} bytes, and had {shown(said.get('bytes'))}"
        if hashes and file_digest(path) != said.get("sha256"):
            return f"{name} is not what was written"
    return ""
