"""Damage files where that reaches new code (atheris), and stop at the first one that is not a line.

    pip install atheris
    python -m tools.ops.guided_fuzz TARGET [--seconds 300] [--keep DIR]

A target is a kind of file, begun from the small whole files of the tests. Each file is read as a run reads
it; what is neither evidence nor an error of the project's own ends the search, and so do 5 s and 1.5 GB. The
file is then in DIR as `crash-…`, `timeout-…` or `oom-…`, beside the files that reached new code (`corpus`),
from which the next search goes on.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import logging
import os
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

TARGETS = {
    "npz": (".npz", ("evidence", "amass", "smpl", "prompthmr")),
    "pickle": (".pkl", ("wham", "phalp", "3dpw", "phc", "sam3d")),
    "torch": (".pt", ("gvhmr", "gem")),
    "npy": (".npy", ("freemocap", "humanml3d", "array")),
    "bvh": (".bvh", ("bvh",)),
    "trc": (".trc", ("trc", "markers.trc")),
    "c3d": (".c3d", ("c3d",)),
    "json": (".json", ("mediapipe", "mmpose", "coco", "alphapose", "vitpose")),
    "toml": (
        ".toml",
        ("scene", "plan", "job", "toml camera", "toml manifest", "contacts.toml", "suite.toml"),
    ),
    "model": (".npz", ("npz body model", "pickle body model", "window", "fit", "truth")),
}
"""Ending, and the samples that it begins from (`tests.support`)."""


def seeds(target: str, folder: Path) -> list[Any]:
    """The samples of a target, written into a folder."""
    corpus, own, side = (
        importlib.import_module(f"tests.support.{name}") for name in ("corpus", "own_files", "side_files")
    )
    (folder / "b").mkdir()
    found = [*corpus.made(folder / "a"), *corpus.cases(folder / "b")]
    found += [*own.made(folder / "c"), *side.made(folder / "d")]
    suffix, names = TARGETS[target]
    return [one for one in found if one.format in names and one.path.is_file() and one.path.suffix == suffix]


def one_input(samples: list[Any], place: Path) -> Callable[[bytes], None]:
    """What the search calls: reads bytes by each reader of the samples, once each."""
    errors = importlib.import_module("simrecon.errors")
    evidence = importlib.import_module("simrecon.evidence")
    readers = {one.reader: one for one in samples}

    def read(content: bytes) -> None:
        for reader, sample in readers.items():
            path = place / f"file{sample.path.suffix}"
            path.write_bytes(content)
            with contextlib.suppress(errors.SimreconError):
                evidence.read(path, sample.options) if reader is None else reader(path)

    return read


def main() -> None:
    """Search until the time is over or something is found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=sorted(TARGETS))
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    atheris = importlib.import_module("atheris")
    warnings.simplefilter("ignore")
    logging.disable()
    with atheris.instrument_imports(include=["simrecon"]):
        importlib.import_module("simrecon.running")
        importlib.import_module("simrecon.evidence.formats")
    kept = options.keep.resolve() / options.target
    (kept / "corpus").mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as place:
        samples = seeds(options.target, Path(place))
        for i, sample in enumerate(samples):
            (kept / "corpus" / f"seed{i}").write_bytes(sample.path.read_bytes())
        words = [
            f"-max_total_time={options.seconds}", "-timeout=5", "-rss_limit_mb=1500", "-print_final_stats=1",
            f"-seed={options.seed}", f"-artifact_prefix={kept}/",
        ]  # fmt: skip
        atheris.Setup([sys.argv[0], *words, str(kept / "corpus")], one_input(samples, Path(place)))
        atheris.Fuzz()


if __name__ == "__main__":
    main()
