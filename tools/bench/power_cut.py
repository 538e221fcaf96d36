"""Cut the power of a batch's clip at random moments, as far as a disk can tell, and give the clip again.

    python -m tools.bench.power_cut CLIP -o OUT [--moments 50] [--plan quick] [--seed 0]

A clip is solved as a worker of a batch does it, twice: into an empty folder, and with another seed over the
result that is there. Meanwhile all that is flushed is noted. At each moment (a flush, a rename, a removal) a
disk that lost its power may hold what was flushed; of all else a part: files cut off, empty or as they were,
new names missing, old ones still there, of a rename either name. For moments drawn at random such a disk is
made, and the clip is given again: what is believed to be done must have the bits of the undisturbed result,
and what is not must be solved to them; the state of the batch must be shown without an error.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

from simrecon.batch import ahead, journal, page, status, survey, work
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Journal, Places
from simrecon.batch.work import Assignment
from simrecon.io.provenance import code_digest
from tools.bench.chaos_batch import SAME

CALLS = ("replace", "rename", "unlink", "rmdir", "mkdir")
"""Of `os`: moments beside flushes."""
NAME, RUN = "clip", "power"


@dataclass
class Disk:
    """What of a folder is on the disk for sure.

    Attributes:
        root: of the folder; files: content of flushed files, and folders: names in flushed folders, by inode.
    """

    root: Path
    files: dict[int, bytes] = field(default_factory=dict)
    folders: dict[int, dict[str, int]] = field(default_factory=dict)

    def flushed(self, descriptor: int) -> None:
        """Note what a flush has brought to the disk."""
        about, path = os.fstat(descriptor), Path(f"/proc/self/fd/{descriptor}")
        if stat.S_ISDIR(about.st_mode):
            self.folders[about.st_ino] = {entry.name: entry.inode() for entry in os.scandir(path)}
        else:
            self.files[about.st_ino] = path.read_bytes()

    def settle(self) -> None:
        """All of the folder is on the disk."""
        for folder, _, names in os.walk(self.root):
            entries = {entry.name: entry.inode() for entry in os.scandir(folder)}
            self.folders[os.stat(folder).st_ino] = entries
            self.files.update({entries[name]: (Path(folder) / name).read_bytes() for name in names})

    def image(self, target: Path, numbers: random.Random) -> None:
        """A folder as a disk that lost its power now may hold it."""
        there = {os.stat(folder).st_ino: Path(folder) for folder, _, _ in os.walk(self.root)}
        known = {entry.inode(): Path(entry.path) for folder in there.values() for entry in os.scandir(folder)}
        gone = _either(self, there, numbers)
        self._fill(os.stat(self.root).st_ino, target, (there, known, gone), numbers)

    def _fill(self, inode: int, target: Path, now: Any, numbers: random.Random) -> None:
        there, known, gone = now
        moved = {one for _, _, one in gone}
        target.mkdir(parents=True, exist_ok=True)
        flushed = self.folders.get(inode, {})
        current = {entry.name: entry.inode() for entry in os.scandir(there[inode])} if inode in there else {}
        for name in sorted({**flushed, **current}):
            new, old = (
                None if (inode, name, names.get(name)) in gone else names.get(name)
                for names in (current, flushed)
            )
            settled = new == old or (new in moved and new is not None)
            chosen = new if settled or (new is not None and numbers.random() < 0.5) else old
            if chosen is None:
                continue
            if chosen in there or chosen in self.folders:
                self._fill(chosen, target / name, now, numbers)
            else:
                content = _part(self.files.get(chosen), known.get(chosen), numbers)
                if content is not None:
                    (target / name).write_bytes(content)


def _either(disk: Disk, there: dict[int, Path], numbers: random.Random) -> set[tuple[int, str, int]]:
    """Of what was renamed, and not flushed, the name that it has not: the old one or the new one."""
    old = {(at, name, one) for at, names in disk.folders.items() for name, one in names.items()}
    new = {(at, entry.name, entry.inode()) for at, path in there.items() for entry in os.scandir(path)}
    before = {one: (at, name, one) for at, name, one in old - new if at in there}
    return {numbers.choice((place, before[place[2]])) for place in sorted(new - old) if place[2] in before}


def _part(flushed: bytes | None, path: Path | None, numbers: random.Random) -> bytes | None:
    """What there may be of a file that has changed since it was flushed; None: nothing at all."""
    content = None if path is None else path.read_bytes()
    if content is None or content == flushed:
        return flushed
    cut = content[: numbers.randrange(len(content) + 1)]
    return numbers.choice([flushed if flushed is not None else b"", b"", cut, bytes(len(content)), content])


@contextmanager
def watched(disk: Disk, moment: Callable[[], None]) -> Iterator[None]:
    """Call `moment` after each flush, rename and removal, but for those that it makes itself."""
    busy: list[bool] = []

    def now() -> None:
        if not busy:
            busy.append(True)
            moment()
            busy.clear()

    def told(call: Callable[..., Any]) -> Callable[..., Any]:
        def after(*words: Any, **more: Any) -> Any:
            answer = call(*words, **more)
            now()
            return answer

        return after

    def sync(descriptor: int) -> None:
        disk.flushed(descriptor)
        now()

    with ExitStack() as stack:
        stack.enter_context(patch.object(os, "fsync", sync))
        for name in CALLS:
            stack.enter_context(patch.object(os, name, told(getattr(os, name))))
        yield


def assignment(clip: Clip, root: Path) -> Assignment:
    """A clip that a batch in a folder has at work."""
    places = Places(root)
    places.inner.mkdir(parents=True, exist_ok=True)
    journal.write_json(places.lock, {"run": RUN})
    return Assignment(clip, str(root), RUN, survey.survey(clip)["key"], code_digest())


def solved(job: Assignment) -> None:
    """Solve a clip, with the events of a batch."""
    book = Journal(Places(Path(job.root)).events)
    book.append("begin", clips=1)
    book.append("clip", clip=job.clip.name, input=job.clip.input, plan="plan", video_s=1.0, windows=2)

    def tell(event: dict[str, Any]) -> None:
        book.append(event["event"], **{key: value for key, value in event.items() if key != "event"})

    said = work.solve(job, threads=1, tell=tell)
    if "figures" not in said:
        raise SystemExit(f"it was not solved: {said}")
    book.append("done", clip=job.clip.name)
    book.close()


def bits(root: Path) -> list[bytes]:
    """Of a result."""
    return [(root / NAME / name).read_bytes() for name in SAME]


def again(image: Path, clip: Clip, wanted: list[bytes]) -> tuple[bool, str]:
    """Give the clip again: whether it was believed to be done, and what is wrong."""
    places = Places(image)
    job = assignment(clip, image)
    believed = ahead.is_done(places, {"name": NAME, "key": job.key}) is not None
    if not believed:
        solved(job)
    if places.events.is_file():
        page.render(places, status.read(places))
    return believed, "" if bits(image) == wanted else "other bits"


def cut(clip: Clip, place: Path, disk: Disk, moments: int, numbers: random.Random) -> list[tuple[bool, str]]:
    """Solve a clip, make disks of random moments of it, and give the clip again on each."""
    images: list[Path] = []

    def image() -> None:
        images.append(place / f"image{len(images)}")
        disk.image(images[-1], numbers)

    with watched(disk, image):
        solved(assignment(clip, disk.root))
    wanted, answers = bits(disk.root), []
    for path in numbers.sample(images, min(moments, len(images))):
        answers.append(again(path, clip, wanted))
        if not answers[-1][1]:
            shutil.rmtree(path)
    return answers


def main() -> int:
    """Both passes; print what was wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clip", type=Path)
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    disk, numbers, bad = Disk(options.output / "batch"), random.Random(options.seed), 0
    for seed in (0, 1):
        began = time.monotonic()
        clip = Clip(NAME, str(options.clip.resolve()), options.plan, options={"seed": seed})
        disk.root.mkdir(parents=True, exist_ok=True)
        disk.settle()
        answers = cut(clip, options.output / f"seed{seed}", disk, options.moments // 2, numbers)
        faults = [fault for _, fault in answers if fault]
        done = sum(believed for believed, _ in answers)
        print(
            f"seed {seed}: {len(answers)} power cuts, {done} believed to be done, {len(faults)} with faults "
            f"{faults}, {time.monotonic() - began:.0f} s",
            flush=True,
        )
        bad += len(faults)
    return 1 if bad else 0


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    raise SystemExit(main())
