"""A disk that loses its power keeps what was flushed, and a batch believes nothing else."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from simrecon.batch import journal
from simrecon.batch.clips import Clip
from simrecon.io import atomic
from tools.bench import power_cut
from tools.bench.power_cut import Disk

NEEDS_PROC = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="this system has no /proc")


def contents(disk: Disk, target: Path, name: str, times: int = 60) -> set[bytes | None]:
    """What a file may hold after a power cut."""
    found = set()
    for seed in range(times):
        image = target / str(seed)
        disk.image(image, random.Random(seed))
        found.add((image / name).read_bytes() if (image / name).is_file() else None)
    return found


@NEEDS_PROC
def test_what_is_written_durably_is_whole_or_as_it_was(tmp_path: Path) -> None:
    disk = Disk(tmp_path / "root")
    disk.root.mkdir()
    atomic.write_bytes(disk.root / "a", b"before")
    disk.settle()
    seen: list[set[bytes | None]] = []
    with power_cut.watched(disk, lambda: seen.append(contents(disk, tmp_path / str(len(seen)), "a"))):
        atomic.write_bytes(disk.root / "a", b"after it", durable=True)
    assert seen[0] == {b"before"}  # the file is flushed
    assert set().union(*seen) == {b"before", b"after it"}
    assert seen[-1] == {b"after it"}


@NEEDS_PROC
def test_what_is_not_flushed_may_be_cut_off(tmp_path: Path) -> None:
    disk = Disk(tmp_path / "root")
    disk.root.mkdir()
    disk.settle()
    with power_cut.watched(disk, lambda: None):
        atomic.write_bytes(disk.root / "a", b"after")
    found = contents(disk, tmp_path, "a")
    assert {None, b"", bytes(5), b"after"} < found


@NEEDS_PROC
def test_of_a_rename_there_is_either_name(tmp_path: Path) -> None:
    disk = Disk(tmp_path / "root")
    (disk.root / "old").mkdir(parents=True)
    (disk.root / "old" / "file").touch()
    disk.settle()
    os.rename(disk.root / "old", disk.root / "new")
    found = set()
    for seed in range(40):
        disk.image(tmp_path / str(seed), random.Random(seed))
        found.add(tuple(path.name for path in sorted((tmp_path / str(seed)).iterdir())))
    assert found == {("old",), ("new",)}


@pytest.mark.slow
@NEEDS_PROC
def test_after_a_power_cut_the_same_command_has_the_same_bits(
    inputs: Path, plan: str, tmp_path: Path
) -> None:
    disk, numbers = Disk(tmp_path / "batch"), random.Random(3)
    for seed in (0, 1):
        clip = Clip(power_cut.NAME, str(inputs / "one.npz"), plan, options={"seed": seed})
        disk.root.mkdir(exist_ok=True)
        disk.settle()
        answers = power_cut.cut(clip, tmp_path / str(seed), disk, 10, numbers)
        assert [fault for _, fault in answers if fault] == []
        assert len(answers) == 10
    assert (journal.read_json(journal.Places(disk.root).record(power_cut.NAME)) or {})["key"]
