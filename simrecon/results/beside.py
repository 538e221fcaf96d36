"""Evidence of a video, kept beside its result to be looked at, changed and run again."""

from __future__ import annotations

import itertools
from pathlib import Path

SUFFIX = ".evidence.npz"


def place(source: Path, result: Path, *, overwrite: bool) -> Path:
    """Where an evidence file is put beside a result; a file there that holds something else stays.

    Args:
        source: where the file is now.
        result: folder of the result.
        overwrite: also replace what holds something else, perhaps by a user's hand.

    Returns:
        `OUT.evidence.npz`, or the first free of `OUT.evidence-2.npz`, …
    """
    content = source.read_bytes()
    plain = result.with_name(result.name + SUFFIX)
    others = (result.with_name(f"{result.name}.evidence-{i}.npz") for i in itertools.count(2))
    return next(
        path
        for path in itertools.chain([plain], others)
        if overwrite or not path.exists() or (path.is_file() and path.read_bytes() == content)
    )
