"""Autosave: edits that nobody has saved yet, kept in the cache as they are made, and taken up after a kill.

A file for each thing that is opened, one line a change; a line that was cut short is passed over.
The cache also keeps the windows of runs, and results until they are kept elsewhere or discarded.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import IO, Any

from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.evidence.video.weights import cache_folder
from simrecon.io.atomic import cannot_write
from simrecon.studio.document import Edits
from simrecon.system import locks

SLOTS = 20
"""Studios at once on the same thing."""
_NAME, _LOCK = "edits.jsonl", "lock"


def state_folder() -> Path:
    """Where studios keep what nobody has saved yet."""
    return cache_folder() / "studio"


class Journal:
    """What one studio keeps of one opened thing; holds a lock until it is closed.

    Attributes:
        folder: of its own, in the cache.
    """

    def __init__(self, opened: Path | str, root: Path | None = None) -> None:
        """Take the first place that no other studio holds.

        Raises:
            InputError: the cache can't be written.
        """
        name = hashlib.sha256(os.fsencode(Path(opened).resolve())).hexdigest()[:16]
        base = (root or state_folder()) / name
        self._lock: IO[Any] | None = None
        try:
            self.folder, self._lock = _free(base)
        except OSError as error:
            raise cannot_write(base, error) from error
        if self._lock is None:
            raise InputError(f"{opened}: is open in {SLOTS} studios already; valid: close one of them")

    @property
    def runs(self) -> Path:
        """Folder of results that are neither kept elsewhere nor discarded."""
        return self.folder / "runs"

    @property
    def windows(self) -> Path:
        """Folder of solved windows."""
        return self.folder / "windows"

    def note(self, edits: Edits) -> str:
        """Keep a state; it is on its way to the disk when this returns, or the words say why not."""
        line = {"scene": edits.scene, "wishes": wishes.to_table(edits.wishes), "label": edits.label}
        try:
            with (self.folder / _NAME).open("ab") as stream:
                stream.write(json.dumps(line).encode() + b"\n")
        except OSError as error:
            return f"edits are lost if they are not saved: {cannot_write(self.folder, error)}"
        return ""

    def kept(self) -> tuple[Edits, ...]:
        """The states that were kept, in order; those that can't be read are left out."""
        try:
            lines = (self.folder / _NAME).read_bytes().splitlines()
        except FileNotFoundError:
            return ()
        return tuple(edits for edits in map(_read, lines) if edits is not None)

    def forget(self) -> None:
        """Remove the states: all is saved."""
        (self.folder / _NAME).unlink(missing_ok=True)

    def close(self) -> None:
        """Give the place back."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None


def _free(base: Path) -> tuple[Path, IO[Any] | None]:
    """The first folder that no other studio holds, with its lock; no lock if all are held."""
    for slot in range(1, SLOTS + 1):
        folder = base / str(slot)
        folder.mkdir(parents=True, exist_ok=True)
        stream = (folder / _LOCK).open("ab")
        if locks.acquire(stream):
            return folder, stream
        stream.close()
    return base, None


def _read(line: bytes) -> Edits | None:
    try:
        said = json.loads(line)
        return Edits(str(said["scene"]), wishes.build(said["wishes"], "journal"), str(said["label"]))
    except (ValueError, LookupError, TypeError, InputError, RecursionError):
        return None
