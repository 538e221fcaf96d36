"""Processor time a frame and memory of following a person through a long video: a short one, to and fro.

usage: python -m tools.bench.long_video VIDEO [--minutes 20] [--model heavy]

The frames are coded anew, at the rate of the video. Prints, at twelve places of the way, the processor time
of a frame since the last place, and the memory that the process holds (Linux).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from simrecon.evidence.video import detection, frames, weights
from simrecon.evidence.video.detection import Look
from simrecon.evidence.video.networks import Networks
from tools.bench.tracking import images

PLACES = 12


def repeated(path: Path, target: Path, count: int, rate_hz: float) -> None:
    """A video of so many frames: those of another, to and fro."""
    there = [cv2.imencode(".jpg", image)[1] for image in images(path)]
    order = [*range(len(there)), *range(len(there) - 2, 0, -1)]
    first = np.asarray(cv2.imdecode(there[0], cv2.IMREAD_COLOR))
    size = (first.shape[1], first.shape[0])
    writer = cv2.VideoWriter(str(target), cv2.VideoWriter.fourcc(*"mp4v"), rate_hz, size)
    for i in range(count):
        writer.write(np.asarray(cv2.imdecode(there[order[i % len(order)]], cv2.IMREAD_COLOR)))
    writer.release()


def resident_mib() -> float:
    """Memory that the process holds now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


class Clock:
    """Notes time and memory at some of the frames."""

    def __init__(self, count: int) -> None:
        self.every = max(count // PLACES, 1)
        self.lines = ["| frame | processor time a frame, ms | memory, MiB |", "|---|---|---|"]
        self._began = time.process_time()

    def __call__(self, done: float, _total: float) -> None:
        """A frame is done."""
        if int(done) % self.every:
            return
        spent, self._began = time.process_time() - self._began, time.process_time()
        self.lines.append(f"| {done:.0f} | {1000 * spent / self.every:.1f} | {resident_mib():.0f} |")
        print(self.lines[-1], flush=True)


def main() -> None:
    """Make the video, and follow the person through it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("video", type=Path)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--model", default="heavy")
    options = parser.parse_args()
    rate = frames.probe(options.video, 0).rate_hz or 30.0
    count = round(60 * options.minutes * rate)
    network = Networks(weights.find("detector")[0], weights.find(options.model)[0])
    with tempfile.TemporaryDirectory() as scratch:
        long = Path(scratch) / "long.mp4"
        repeated(options.video, long, count, rate)
        clock = Clock(count)
        print("\n".join(clock.lines), flush=True)
        found = detection.follow(long, network, Look(), clock)
    print(f"{int(found.seen.sum())} of {count} frames seen, lost {found.losses} times")


if __name__ == "__main__":
    main()
