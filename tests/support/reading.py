"""Evidence as the command line would read it."""

from __future__ import annotations

from pathlib import Path

from simrecon import cli
from simrecon.cli import options
from simrecon.job import Job, inputs
from simrecon.types import Evidence


def observed(path: Path | str, *words: str) -> Evidence:
    """What `simrecon run PATH -o unused WORDS` begins with."""
    parsed = cli._parser().parse_args(["run", str(path), "-o", "unused", *words])
    return inputs.observe(options.apply(parsed, Job(str(path), "unused")))
