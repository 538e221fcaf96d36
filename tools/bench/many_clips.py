"""Many short clips and some broken inputs in one batch: what is done, what is reported, and how memory goes.

    python -m tools.bench.many_clips -o OUT [--clips 190] [--broken 10] [--seconds 1] [--plan quick]
                                     [--jobs N]

Clips are pieces of the example that ships inside, as `tools.bench.batch` cuts them. Broken inputs are files
that are empty, cut off, of another kind, without keys, or full of NaN, in turn. Resident memory of the main
process and of its workers is read once a second from /proc; flat means that the last quarter of the batch
needs no more than the second one.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tools.bench import batch

MIB = 2**20
FLAT = 1.05


def main() -> int:
    """Run, and print what happened; status 1 if a clip or an error is missing, or if memory grew."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--clips", type=int, default=190)
    parser.add_argument("--broken", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--jobs", type=int, default=0)
    options = parser.parse_args()
    if options.output.exists():
        raise SystemExit(f"{options.output}: is there already; give a new folder")
    inputs, night = options.output / "clips", options.output / "batch"
    good = batch.cut(inputs, options.clips, options.seconds)
    for number in range(options.broken):
        BREAK[number % len(BREAK)](good[0], inputs / f"broken{number:02d}.npz")
    command = [
        sys.executable,
        "-m",
        "simrecon",
        "batch",
        str(inputs),
        "-o",
        str(night),
        "--plan",
        options.plan,
    ]
    command += ["--jobs", str(options.jobs)] if options.jobs else []
    began = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        samples = watch(process)
    wall_s = time.perf_counter() - began
    reports = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(night.glob("*/report.json"))]
    states = ["error" if "error" in report else "result" for report in reports]
    print(f"exit status {process.returncode}, {wall_s:.0f} s")
    counts = {state: states.count(state) for state in ("result", "error")}
    print(counts)
    good_end = counts == {"result": options.clips, "error": options.broken}
    for name, values in zip(("main process", "largest worker"), zip(*samples, strict=True), strict=True):
        quarter = max(len(values) // 4, 1)
        second, last = statistics.median(values[quarter : 2 * quarter]), statistics.median(values[-quarter:])
        flat = last <= FLAT * second
        good_end &= flat
        verdict = "flat" if flat else "GROWING"
        print(f"{name}: {second:.0f} MiB in the second quarter, {last:.0f} in the last: {verdict}")
    return 0 if good_end else 1


def watch(process: subprocess.Popen[str]) -> list[tuple[float, float]]:
    """MiB of the main process and of its largest descendant, once a second until it ends."""
    samples = []
    while process.poll() is None:
        own = resident_mib(process.pid)
        others = [resident_mib(pid) for pid in descendants(process.pid)]
        if own:
            samples.append((own, max(others, default=0.0)))
        try:
            process.communicate(timeout=1.0)
        except subprocess.TimeoutExpired:
            continue
    return samples


def resident_mib(pid: int) -> float:
    """Resident memory of a process; zero if it is gone."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / MIB


def descendants(pid: int) -> list[int]:
    """Ids of all processes below one."""
    parents: dict[int, int] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (
                (folder / "stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
            )
        except OSError:
            continue
        parents[int(folder.name)] = int(fields[1])
    below, waiting = [], [pid]
    while waiting:
        parent = waiting.pop()
        children = [child for child, above in parents.items() if above == parent]
        below += children
        waiting += children
    return below


def _empty(_good: Path, path: Path) -> None:
    path.write_bytes(b"")


def _cut_off(good: Path, path: Path) -> None:
    content = good.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def _other_kind(_good: Path, path: Path) -> None:
    path.write_text("a text\n", encoding="utf-8")


def _no_keys(_good: Path, path: Path) -> None:
    np.savez(path, other=np.zeros(3))


def _unseen(good: Path, path: Path) -> None:
    with np.load(good) as archive:
        content = {key: archive[key] for key in archive.files}
    content["keypoints_px"] = content["keypoints_px"] * np.nan
    np.savez(path, **content)


BREAK: tuple[Callable[[Path, Path], None], ...] = (_empty, _cut_off, _other_kind, _no_keys, _unseen)


if __name__ == "__main__":
    raise SystemExit(main())
