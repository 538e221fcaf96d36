"""Evidence of a video, kept beside its result to be looked at, changed and run again."""

from __future__ import annotations

import itertools
from pathlib import Path

from simrecon.io import atomic

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
    endings = itertools.chain([SUFFIX], (f".evidence-{i}.npz" for i in itertools.count(2)))
    return next(
        path
        for path in (result.with_name(atomic.fitted(result.name, ending)) for ending in endings)
        if overwrite or not path.exists() or (path.is_file() and path.read_bytes() == content)
    )
