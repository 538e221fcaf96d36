"""A task of a suite that is at work until it is ended, and then tidies up."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Waiting:
    """In the place of `BenchmarkTask`.

    Attributes:
        file: is there while the task is at work, and holds the number of its process.
    """

    file: Path

    @property
    def clip(self) -> Any:
        """What is looked at first of all."""
        self.file.write_text(str(os.getpid()), encoding="utf-8")
        try:
            time.sleep(600)
        finally:
            self.file.unlink()
