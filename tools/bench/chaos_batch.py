"""Kill a batch at random moments, give the same command again, and compare every result bit by bit.

    python -m tools.bench.chaos_batch CLIPS -o OUT [--kills 20] [--plan quick] [--seed 0]

First an undisturbed batch of all clips in the folder CLIPS is made in OUT/calm. Then OUT/chaos is made by the
same command, which is killed (`kill -9`: a worker, the main process, or both, in turn) at random moments and
started again until everything is done; if kills are left then, the rest hits OUT/chaos1, and so on. All
processes that are killed were started here, and are killed by their id. Results are equal if motion.npz,
model.xml and scene.toml have the same bytes.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

SAME = ("motion.npz", "model.xml", "scene.toml")
WAYS = ("worker", "main", "both")


def children(pid: int) -> list[int]:
    """Process ids of a process's children, of all its threads."""
    pids: list[int] = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            pids += [int(word) for word in path.read_text(encoding="utf-8").split()]
    return pids


def workers(pid: int) -> list[int]:
    """The worker processes among them: not multiprocessing's resource tracker."""
    pids = []
    for child in children(pid):
        try:
            command = Path(f"/proc/{child}/cmdline").read_bytes()
        except OSError:
            continue
        if b"spawn_main" in command:
            pids.append(child)
    return pids


def kill(pid: int) -> bool:
    """Kill -9; whether it was there."""
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


def gone(pids: list[int], within_s: float = 10.0) -> bool:
    """Whether processes end of themselves in time."""
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        if not any(Path(f"/proc/{pid}").exists() for pid in pids):
            return True
        time.sleep(0.05)
    return False


def batch(clips: Path, output: Path, plan: str, jobs: int) -> list[str]:
    """The command."""
    where = [str(clips), "-o", str(output), "--plan", plan, "--jobs", str(jobs)]
    return [sys.executable, "-m", "simrecon", "batch", *where]


def undisturbed(command: list[str]) -> float:
    """Run to the end; seconds."""
    began = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        raise SystemExit(f"the undisturbed batch failed: {done.stderr}")
    return time.monotonic() - began


def chaos(command: list[str], kills: int, span_s: float, numbers: random.Random) -> list[dict[str, object]]:
    """Run to the end, killed up to `kills` times.

    Args:
        command: of the batch.
        kills: how often at most.
        span_s: the longest time between a start or kill and the next kill.
        numbers: for the moments.
    """
    log: list[dict[str, object]] = []
    while True:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while len(log) < kills and process.poll() is None:
            wait_s = numbers.uniform(0.2, span_s)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(wait_s)
            if process.poll() is None:
                log += strike(process, WAYS[len(log) % len(WAYS)], wait_s, numbers)
        process.wait()
        if process.returncode in (0, 3):
            return log
        if process.returncode != -signal.SIGKILL:
            raise SystemExit(f"the batch ended with {process.returncode}: {' '.join(command)}")


def strike(
    process: subprocess.Popen[bytes], way: str, wait_s: float, numbers: random.Random
) -> list[dict[str, object]]:
    """Kill in one way; what was killed, if anything was."""
    crew = workers(process.pid)
    chosen = [numbers.choice(crew)] if crew and way != "main" else []
    killed = [pid for pid in (*chosen, *([process.pid] if way != "worker" else [])) if kill(pid)]
    if not killed:
        return []
    row: dict[str, object] = {"way": way, "after_s": round(wait_s, 2), "processes": len(killed)}
    if way != "worker":
        process.wait()
        row["orphans_left"] = not gone(crew)
    return [row]


def differing(calm: Path, wild: Path) -> list[str]:
    """Files that differ, or are missing."""
    names = sorted(path.parent.name for path in calm.glob("*/motion.npz"))
    pairs = [(calm / name / file, wild / name / file) for name in names for file in SAME]
    return [str(b) for a, b in pairs if not b.is_file() or a.read_bytes() != b.read_bytes()]


def main() -> int:
    """Run both, compare, print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", type=Path)
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--span", type=float, default=12.0, help="s, the longest time to a kill")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    calm, numbers = options.output / "calm", random.Random(options.seed)
    calm_s = undisturbed(batch(options.clips, calm, options.plan, options.jobs))
    print(f"undisturbed: {calm_s:.0f} s, {len(list(calm.glob('*/motion.npz')))} results", flush=True)
    log: list[dict[str, object]] = []
    bad: list[str] = []
    for turn in range(1000):
        wild, began = options.output / f"chaos{turn or ''}", time.monotonic()
        command = batch(options.clips, wild, options.plan, options.jobs)
        rows = chaos(command, options.kills - len(log), options.span, numbers)
        lines = (wild / "batch.jsonl").read_text(encoding="utf-8").splitlines()
        resumed = sum('"started"' in line and '"window": 0,' not in line for line in lines)
        bad += differing(calm, wild)
        spent_s = time.monotonic() - began
        print(
            f"{wild.name}: {len(rows)} kills, {resumed} starts from a checkpoint, {spent_s:.0f} s", flush=True
        )
        log += rows
        if len(log) >= options.kills:
            break
    for row in log:
        print(json.dumps(row))
    orphans = sum(bool(row.get("orphans_left")) for row in log)
    print(f"{len(log)} kills, {orphans} with processes left over, {len(bad)} files that differ {bad}")
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
