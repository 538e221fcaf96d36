"""How much faster a batch is than one clip after another, and what its scheduling costs.

    python -m tools.bench.batch -o OUT [--clips 8] [--seconds 1] [--plan quick] [--repeat 1]
                                [--write docs/results/batches.md]

Pieces of the example that ships inside are reconstructed twice: by one process, one after another, with a
thread per core, and by `simrecon batch`. The first does not pay for starting a program for each clip, so the
ratio is, if anything, too small. Every result must have the same bits both times. All figures are wall time,
so the machine should be quiet; the load before the start is part of the table. Of several repeats the
median of each figure counts.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from simrecon import cli, evidence, resources
from simrecon.batch import journal
from simrecon.bench.page import replaced
from simrecon.system import processor

SAME = ("motion.npz", "model.xml", "scene.toml")
RATIO_MIN, START_MAX_S, CLIP_MAX_S = 1.15, 4.0, 1.0
_IN_TURN = "--in-turn"


def cut(folder: Path, count: int, seconds: float) -> list[Path]:
    """Pieces of the example, whose beginnings are spread over it evenly."""
    folder.mkdir(parents=True)
    whole = evidence.read(resources.folder("example") / "beam.npz")
    frames = round(seconds / float(whole.times_s[1] - whole.times_s[0])) + 1
    last = len(whole.times_s) - frames
    if last < 0:
        raise SystemExit(f"--seconds: at most {float(whole.times_s[-1]):.2f}")
    paths = []
    for i in range(count):
        part = slice(i * last // max(count - 1, 1), i * last // max(count - 1, 1) + frames)
        paths.append(folder / f"clip{i:02d}.npz")
        evidence.write(paths[-1], evidence.cut(whole, part))
    return paths


def in_turn(clips: Sequence[str], output: Path, plan: str) -> int:
    """One clip after another in this process, each on all cores; prints the seconds of all."""
    began = time.perf_counter()
    for clip in clips:
        status = cli.main(["run", clip, "-o", str(output / Path(clip).stem), "--plan", plan])
        if status not in (0, 3):
            return status
    print(time.perf_counter() - began)
    return 0


def measure(clips: Sequence[Path], output: Path, plan: str) -> dict[str, float]:
    """Both ways once.

    Returns:
        `in_turn_s`; `batch_s` from the command to its end; their `ratio`; `start_s` to the first clip;
        `clip_s` a clip's time outside of its own work, on the worker that it ran on; `differ`: files.
    """
    alone, night = output / "in_turn", output / "batch"
    names = [str(clip) for clip in clips]
    first = _python("-m", "tools.bench.batch", _IN_TURN, *names, "-o", str(alone), "--plan", plan)
    began, wall = time.time(), time.perf_counter()
    _python("-m", "simrecon", "batch", *names, "-o", str(night), "--plan", plan, statuses=(0, 3))
    batch_s = time.perf_counter() - wall
    start_s, clip_s = scheduling(journal.read_events(night / "batch.jsonl"), began)
    pairs = [(alone / clip.stem / name, night / clip.stem / name) for clip in clips for name in SAME]
    differ = sum(a.read_bytes() != b.read_bytes() for a, b in pairs)
    in_turn_s = float(first.splitlines()[-1])
    return {
        "in_turn_s": in_turn_s,
        "batch_s": batch_s,
        "ratio": in_turn_s / batch_s,
        "start_s": start_s,
        "clip_s": clip_s,
        "differ": differ,
    }


def scheduling(events: Sequence[dict[str, Any]], began_s: float) -> tuple[float, float]:
    """Seconds to the first clip at work, and of each clip beside its work.

    A worker is busy from its first clip's beginning to its last clip's end. What of that is in no clip's own
    time went into reading inputs, the scheduler and the state on disk.
    """
    begins: dict[str, float] = {}
    by_worker: dict[str, list[dict[str, Any]]] = {}
    worker: dict[str, str] = {}
    for event in events:
        name = event.get("clip", "")
        if event["event"] in ("stage", "started"):
            begins.setdefault(name, event["time"])
            worker[name] = event.get("worker", worker.get(name, ""))
        elif event["event"] == "done":
            by_worker.setdefault(worker[name], []).append(event)
    outside = 0.0
    for rows in by_worker.values():
        span = max(row["time"] for row in rows) - min(begins[row["clip"]] for row in rows)
        outside += span - sum(row["figures"]["here_s"] for row in rows)
    return min(begins.values()) - began_s, outside / len(begins)


def _python(*arguments: str, statuses: Sequence[int] = (0,)) -> str:
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)
    if done.returncode not in statuses:
        raise SystemExit(f"{' '.join(arguments)} ended with {done.returncode}: {done.stderr}")
    return done.stdout


def section(rows: Sequence[dict[str, float]], settings: str, load: float) -> str:
    """The table, in Markdown."""
    median = {key: statistics.median(row[key] for row in rows) for key in rows[0]}
    lines = (
        ("one after another, a thread per core", f"{median['in_turn_s']:.1f} s", ""),
        ("batch, from the command to its end", f"{median['batch_s']:.1f} s", ""),
        ("throughput of the batch against one after another", f"{median['ratio']:.2f} ×", f"≥ {RATIO_MIN} ×"),
        ("start-up: command to first clip at work", f"{median['start_s']:.1f} s", f"≤ {START_MAX_S:g} s"),
        ("per clip, outside of its own work", f"{median['clip_s']:.2f} s", f"≤ {CLIP_MAX_S:g} s"),
        ("files that differ", f"{sum(row['differ'] for row in rows):.0f}", "0"),
    )
    head = f"## Throughput of a batch\n\n`tools/bench/batch.py`: {settings}; load before: {load:.1f}."
    table = "\n".join(f"| {' | '.join(line)} |" for line in (("what", "measured", "must"), *lines))
    first, rest = table.split("\n", 1)
    return f"{head}\n\n{first}\n|---|---|---|\n{rest}\n"


def main() -> int:
    """Measure, print, and write to the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--clips", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=1.0, help="of each clip")
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--write", type=Path, help="a page whose section is replaced")
    parser.add_argument(_IN_TURN, nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.in_turn:
        return in_turn(options.in_turn, options.output, options.plan)
    if options.output.exists():
        raise SystemExit(f"{options.output}: is there already; give a new folder")
    load = os.getloadavg()[0]
    clips = cut(options.output / "clips", options.clips, options.seconds)
    rows = []
    for i in range(options.repeat):
        rows.append(measure(clips, options.output / f"run{i}", options.plan))
        print(json.dumps(rows[-1]), flush=True)
        shutil.rmtree(options.output / f"run{i}")
    plan = Path(options.plan).stem
    settings = f"{len(clips)} clips of {options.seconds:g} s, plan `{plan}`, {processor.cores()} cores"
    text = section(rows, settings, load)
    print(text)
    if options.write is not None:
        page = options.write.read_text(encoding="utf-8")
        options.write.write_text(replaced(page, "batch", text), encoding="utf-8")
    return 1 if any(row["differ"] for row in rows) else 0


if __name__ == "__main__":
    raise SystemExit(main())
