"""End `run`, `batch` and `bench` by signals at random moments, and look at what is left.

    python -m tools.bench.chaos_end CLIP -o OUT [--moments 50] [--seed 0] [--plan PLAN]
    python -m tools.bench.chaos_end SUITE.toml -o OUT [--moments 50]

Each command is begun so often and gets SIGTERM or SIGINT, in turn; `bench` runs one clip at once or two. It
must end within a minute with 143 or 130, or have ended before; print no traceback; leave no process; and
leave nothing but a whole result or what a batch goes on from. All processes that get a signal were started
here. Moments are drawn from the processor time of an undisturbed command, so that they reach all of its parts
on a busy machine too. They count from where the command answers signals itself; before, Python ends it,
with a traceback of its own at times.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

from tools.bench.chaos_batch import children, gone

ENDS = {signal.SIGTERM: (143, 130, -signal.SIGTERM), signal.SIGINT: (130, -signal.SIGINT)}
"""What a command returns; below 0: it ended before its first line, which a shell calls 143 and 130."""
LATEST_S = 60.0
STAGES = ("kinematic fit", "plan", "simulation")
"""What a run says of its parts, in turn, when they are done or stopped."""
TICKS = os.sysconf("SC_CLK_TCK")


def command(name: str, clip: Path, output: Path, plan: str, jobs: int = 1) -> list[str]:
    """The command line of `run`, `batch` or `bench`, of the latter with so many runs at once."""
    words = {
        "run": ["run", str(clip), "-o", str(output / "run"), "--plan", plan, "--threads", "1"],
        "batch": ["batch", str(clip), "-o", str(output / "night"), "--plan", plan, "--jobs", "1"],
        "bench": [
            "bench",
            str(clip),
            "--data",
            str(clip.parent),
            "-o",
            str(output / "bench"),
            "--jobs",
            str(jobs),
        ],
    }
    return [sys.executable, "-m", "simrecon", *words[name]]


def family(pid: int) -> list[int]:
    """Processes below a process."""
    below = children(pid)
    return below + [other for child in below for other in family(child)]


def answers(pid: int) -> bool:
    """Whether a process has come so far that it answers SIGTERM itself, not Python for it (Linux)."""
    with contextlib.suppress(OSError):
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
        caught = next(line.split()[1] for line in lines if line.startswith("SigCgt:"))
        return bool(int(caught, 16) >> signal.SIGTERM - 1 & 1)
    return False


def used_s(pid: int) -> float:
    """Processor time of a process, of those below it and of those that they have waited for (Linux)."""
    ticks = 0
    for one in (pid, *family(pid)):
        with contextlib.suppress(OSError):
            after_name = Path(f"/proc/{one}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            ticks += sum(map(int, after_name[11:15]))
    return ticks / TICKS


def begun(words: list[str]) -> tuple[subprocess.Popen[str], float]:
    """Begin a command and wait until it answers signals: what it has used till then, s."""
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    while process.poll() is None and not answers(process.pid):
        time.sleep(0.01)
    return process, used_s(process.pid)


def whole_s(words: list[str]) -> float:
    """Processor time of an undisturbed command, from where it answers signals."""
    process, before = begun(words)
    latest = before
    while process.poll() is None:
        latest = max(latest, used_s(process.pid))
        time.sleep(0.02)
    said = process.communicate()[0]
    if process.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(words)} failed: {said}")
    return latest - before


def struck(words: list[str], number: signal.Signals, after_s: float) -> tuple[int, str, bool, bool]:
    """Begin a command, and end it: its status, what it said, whether it was hit, whether any is left."""
    process, before = begun(words)
    while process.poll() is None and used_s(process.pid) < before + after_s:
        time.sleep(0.01)
    hit, pids = process.poll() is None, family(process.pid)
    if hit:
        process.send_signal(number)
    try:
        said = process.communicate(timeout=LATEST_S)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        said = process.communicate()[0] + "\nit did not end"
    return process.returncode, said, hit, not gone(pids)


def litter(folder: Path) -> list[str]:
    """Names in a folder that belong to no whole result, batch or suite."""
    odd = [path for path in folder.rglob("*") if ".partial" in path.name or ".earlier" in path.name]
    odd += [path.parent for path in folder.glob("run/*") if not (folder / "run" / "motion.npz").is_file()]
    return sorted({str(path.relative_to(folder)) for path in odd})


def reached(folder: Path, said: str) -> str:
    """The last part of a command that it had come to, as far as what it said and wrote can tell."""
    if any(folder.rglob("motion.npz")):
        return "writing"
    stages = [stage for stage in STAGES if f"{stage} " in said]
    return stages[-1] if stages else "start"


def end_at_random(clip: Path, output: Path, plan: str, moments: int, seed: int) -> int:
    """The signals; how often something was wrong."""
    numbers, bad = random.Random(seed), 0
    for name in ("bench",) if clip.suffix == ".toml" else ("run", "batch"):
        hits, stages = 0, Counter[str]()
        span_s = whole_s(command(name, clip, output / f"{name}-whole", plan))
        for i in range(moments):
            place = output / f"{name}{i}"
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir(parents=True)
            number = tuple(ENDS)[i % 2]
            after_s = numbers.uniform(0.0, span_s)
            words = command(name, clip, place, plan, jobs=1 + i // 2 % 2)
            status, said, hit, left = struck(words, number, after_s)
            hits += hit
            stages[reached(place, said)] += hit
            found = litter(place)
            faults = [
                *([f"status {status}"] if hit and status not in (*ENDS[number], 0, 3) else []),
                *(["a traceback"] if "Traceback" in said else []),
                *(["a process is left"] if left else []),
                *([f"litter {found}"] if found else []),
            ]
            if faults:
                bad += 1
                print(f"{name} {number.name} after {after_s:.2f} s: {', '.join(faults)}: {said[-600:]}")
            else:
                shutil.rmtree(place)
        print(f"{name}: {moments} begun, {hits} hit within {span_s:.1f} s: {dict(stages)}", flush=True)
    return bad


def main() -> int:
    """Print what was wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clip", type=Path, help="of run and batch, or a suite beside its data, of bench")
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    clip, output = options.clip.resolve(), options.output.resolve()
    began = time.monotonic()
    bad = end_at_random(clip, output, options.plan, options.moments, options.seed)
    print(f"{bad} with faults, {time.monotonic() - began:.0f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    raise SystemExit(main())
