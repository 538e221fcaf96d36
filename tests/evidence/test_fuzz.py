"""Twenty thousand damaged files, 2,000 of them always: every reader reads one, or refuses it in one line."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence import formats
from tests.support import corpus, mutations, own_files, side_files
from tools import CHECKOUT

SEED, FILES, PIECE, FEW = 17, 20_000, 1000, 500
NOT_READ = {"mot"}
"""What is refused as it is."""


@pytest.fixture(autouse=True)
def videos_without_a_network(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from simrecon.evidence.video import detection, weights
    from tests.support import video_files

    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(weights, "find", lambda name: (Path(name), f"hash of {name}"))
    monkeypatch.setattr(detection, "Networks", lambda *_: video_files.Rectangles())


def damage(folder: Path, first: int, last: int) -> list[str]:
    """Faults of readers on the files of these numbers, read by a process under limits."""
    command = [sys.executable, "-m", "tests.support.fuzzing", str(folder), str(SEED), str(first), str(last)]
    environment = os.environ | {"PYTHONPATH": str(CHECKOUT)}
    ended = subprocess.run(command, cwd=CHECKOUT, env=environment, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return [str(json.loads(line)) for line in ended.stdout.splitlines()]


def test_the_corpus_has_a_file_of_every_format_and_each_is_read_as_it_is(tmp_path: Path) -> None:
    samples = corpus.made(tmp_path)
    assert {sample.format for sample in samples} == set(formats.names())
    for sample in samples:
        assert formats.format_of(sample.path) == sample.format
        if sample.format in NOT_READ:
            continue
        corpus.read(sample)


def test_all_else_that_is_read_is_read_as_it_is(tmp_path: Path) -> None:
    samples = own_files.made(tmp_path / "own")
    assert [sample.format for sample in samples] == list(own_files.NAMES)
    samples += side_files.made(tmp_path / "side")
    for sample in samples:
        assert sample.reader is not None
        found = sample.reader(sample.path)
        assert found or sample.format not in side_files.MAKERS


@pytest.mark.parametrize("first", range(0, 4 * FEW, FEW))
def test_two_thousand_damaged_files(tmp_path: Path, first: int) -> None:
    assert damage(tmp_path / "fuzz", first, first + FEW) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(4 * FEW, FILES, PIECE))
def test_damaged_files_are_read_or_refused(tmp_path: Path, first: int) -> None:
    assert damage(tmp_path / "fuzz", first, first + PIECE) == []


def test_a_fault_is_noticed(tmp_path: Path) -> None:
    """The process tells what a reader does wrong: another exception, time, memory, a file that it writes."""
    script = (
        "import sys; from pathlib import Path\n"
        "import numpy as np; from tests.support import corpus, fuzzing\n"
        "place = Path(sys.argv[1]); (place / 'x').write_text('x')\n"
        "watch = fuzzing.Watch(place / 'cache'); fuzzing.limit(); fuzzing.SECONDS = 0.3\n"
        "def writes(_): (place / 'y').write_text('y')\n"
        "def hangs(_):\n"
        "    while True: pass\n"
        "def grows(_): np.ones(1 << 28)\n"
        "def fails(_): raise RuntimeError('no\\nreason')\n"
        "for corpus.read in (writes, hangs, grows, fails):\n"
        "    print(fuzzing.fault(corpus.Sample('x', place / 'x', None), watch).splitlines()[0])\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)], cwd=CHECKOUT, capture_output=True, text=True
    )
    wrote, hung, grew, failed = ended.stdout.splitlines()
    assert wrote.startswith("wrote ['open ")
    assert hung.startswith("more than 0.3 s")
    assert "Unable to allocate" in grew
    assert failed == "RuntimeError: no"


def test_mutations_are_the_same_every_time() -> None:
    path = corpus.CASES / "bvh_height_1m71.bvh"
    once, again, other = (mutations.damaged(path, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert once == again != other


# --- kinds that it found


def refused(path: Path, content: bytes, said: str) -> None:
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        formats.read(path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_numbers_beyond_all_sense_are_refused(tmp_path: Path) -> None:
    text = (corpus.CASES / "bvh_height_1m71.bvh").read_text()
    first = text.index("OFFSET", text.index("JOINT"))
    line = text[first : text.index("\n", first)]
    refused(
        tmp_path / "a.bvh",
        text.replace(line, "OFFSET 1e308 0 0", 1).encode(),
        "OFFSET: found a number of 1e+308",
    )
    refused(tmp_path / "b.bvh", text.replace(line, "OFFSET nan 0 0", 1).encode(), "OFFSET: found no number")
    rows = (corpus.CASES / "trc_keypoint_names.trc").read_text().splitlines()
    cells = rows[-1].split("\t")
    rows[-1] = "\t".join([*cells[:2], "1e300", *cells[3:]])
    refused(tmp_path / "c.trc", "\n".join(rows).encode(), "points: found a number of 1e+300")


def test_labels_without_end_are_refused_at_once(tmp_path: Path) -> None:
    rows = (corpus.CASES / "trc_keypoint_names.trc").read_text().splitlines()
    long = rows[3].replace("LKnee", "L_" * 50_000 + "Knee", 1)
    assert long != rows[3]
    refused(
        tmp_path / "a.trc",
        "\n".join([*rows[:3], long, *rows[4:]]).encode(),
        "characters; valid: at most 2000",
    )


def test_an_unfinished_header_of_an_array_is_damage(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((12, 33, 3)))
    raw = (tmp_path / "a.npy").read_bytes()
    refused(tmp_path / "b.npy", raw.replace(b"(12, 33, 3), }", b"(12, 33, 3,   "), "damaged header")
