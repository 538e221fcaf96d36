"""Fill the disk of `run`, `batch` and `bench` at a random byte, make space, and give the command again.

    python -m tools.bench.full_disk CLIP SUITE.toml -o OUT [--times 20] [--plan PLAN] [--seed 0]

CLIP is for `run` and `batch`, SUITE for `bench`, with its data beside it. First each command is done once, to
know how much it writes. Then they begin in turn in a folder of a file system of their own (Linux; needs the
right to mount one: as root, or under `unshare -rm`) with as many bytes free as a random share of that; every
second time temporary files go there too. A command that can't finish must say so in one line, without a
traceback, and end with 1, 2 or 3. Once there is space, the same command must end well, with a whole result
and nothing beside it.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from tools.bench.chaos_end import command, litter

NAMES = ("run", "batch", "bench")
SIZE = 64 << 20
RESULTS = {
    "run": "run*/motion.npz", "batch": "night/*/motion.npz", "bench": "bench/runs/*/*/*/result*/motion.npz",
}  # fmt: skip
Made = Callable[[str, Path], list[str]]
"""The words of a command of this name with its output in a folder."""


@contextlib.contextmanager
def disk(place: Path) -> Iterator[Path]:
    """A small file system at a folder, which is made."""
    place.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def empty(place: Path) -> None:
    """Remove all that is in a folder."""
    for path in place.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def fill(place: Path, free: int) -> Path:
    """Leave so many bytes; the file that takes the rest."""
    filler = place / "filler"
    with filler.open("wb") as stream:
        os.posix_fallocate(stream.fileno(), 0, max(1, shutil.disk_usage(place).free - free))
    return filler


def given(words: list[str], temporary: Path | None) -> subprocess.CompletedProcess[str]:
    """A command's end."""
    environment = dict(os.environ)
    if temporary is not None:
        temporary.mkdir(exist_ok=True)
        environment["TMPDIR"] = str(temporary)
    return subprocess.run(words, capture_output=True, text=True, check=False, env=environment)


def errors(ended: subprocess.CompletedProcess[str]) -> list[str]:
    """Lines in which a command says that it failed."""
    return [line for line in ended.stderr.splitlines() if "error" in line or ": failed: " in line]


def faults(name: str, out: Path, ends: Sequence[subprocess.CompletedProcess[str]]) -> list[str]:
    """What is wrong with a command: with its end on the full disk, or with that after it."""
    first, again = ends
    found = ["a traceback"] if "Traceback" in first.stderr + first.stdout else []
    if first.returncode not in (0, 1, 2, 3):
        found.append(f"status {first.returncode}")
    if first.returncode in (1, 2) and len(errors(first)) != 1:
        found.append(f"{len(errors(first))} lines")
    if again.returncode not in (0, 3):
        found.append(f"status {again.returncode} with space")
    results = [path.parent for path in out.glob(RESULTS[name])]
    if len(results) != 1 or "Traceback" in again.stderr:
        found.append(f"results {results}")
    return found + [f"left {path}" for path in litter(out)]


def written(place: Path, made: Made, name: str) -> int:
    """Bytes that a command writes on an empty disk."""
    before = shutil.disk_usage(place).used
    (place / "out").mkdir()
    if (ended := given(made(name, place / "out"), None)).returncode not in (0, 3):
        raise SystemExit(f"{name} failed: {ended.stderr}")
    size = shutil.disk_usage(place).used - before
    empty(place)
    print(f"{name} writes {size} bytes", flush=True)
    return size


def filled(place: Path, made: Made, times: int, seed: int) -> int:
    """The campaign; how often something was wrong."""
    numbers, bad, stopped, out = random.Random(seed), 0, 0, place / "out"
    sizes = {name: written(place, made, name) for name in NAMES}
    for i in range(times):
        name = NAMES[i % len(NAMES)]
        free, temporary = numbers.randrange(sizes[name]), place / "tmp" if i % 2 else None
        out.mkdir()
        filler = fill(place, free)
        ends = [given(made(name, out), temporary)]
        filler.unlink()
        ends.append(given(made(name, out), temporary))
        stopped += ends[0].returncode not in (0, 3)
        wrong = faults(name, out, ends)
        bad += bool(wrong)
        said = ends[0].stderr[-900:] if wrong else "".join(errors(ends[0]))[:200]
        print(f"{name} with {free} bytes: {ends[0].returncode} {said}", flush=True)
        if wrong:
            print(f"  wrong: {wrong}; then {ends[1].returncode} {ends[1].stderr[-300:]}", flush=True)
        empty(place)
    print(f"disk: {times} times, {stopped} of them ended by it", flush=True)
    return bad


def main() -> int:
    """Print what was wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clip", type=Path)
    parser.add_argument("suite", type=Path)
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    given_to = {name: options.clip.resolve() for name in NAMES} | {"bench": options.suite.resolve()}
    began = time.monotonic()

    def made(name: str, out: Path) -> list[str]:
        return command(name, given_to[name], out, options.plan)

    with disk(options.output.resolve() / "disk") as place:
        bad = filled(place, made, options.times, options.seed)
    print(f"{bad} with faults, {time.monotonic() - began:.0f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    raise SystemExit(main())
