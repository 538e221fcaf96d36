"""Only regular files are read, and none that is too large."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, job, plan, results, scene
from simrecon.batch import manifest
from simrecon.body import model_file
from simrecon.errors import InputError
from simrecon.evidence.camera import files as cameras
from simrecon.io import npz, reading, toml
from simrecon.sim import models
from tests.support import side_files

READERS: dict[str, Callable[[Path], Any]] = {
    "evidence": evidence.read,
    "npz": npz.load,
    "toml": toml.load,
    "scene": scene.read,
    "plan": plan.read,
    "job": job.read,
    "camera": cameras.read,
    "body model": model_file.read,
    "model": models.load,
    "csv manifest": manifest.read,
    "motion": results.read_motion,
    "report": lambda path: results.read_report(path.parent),
}
SUFFIX = {"body model": ".npz", "csv manifest": ".csv", "report": ".json"}


def test_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"\xc3\xbc\r\n")
    assert reading.read_bytes(tmp_path / "a") == b"\xc3\xbc\r\n"
    assert reading.read_text(tmp_path / "a") == "ü\n"
    with pytest.raises(OSError, match="it has 4 bytes, more than 3 bytes"):
        reading.read_bytes(tmp_path / "a", 3)
    with pytest.raises(IsADirectoryError):
        reading.read_bytes(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("reader", READERS)
def test_a_pipe_is_refused_at_once(tmp_path: Path, reader: str) -> None:
    path = tmp_path / f"report{SUFFIX.get(reader, '')}"
    os.mkfifo(path)
    with pytest.raises(InputError) as caught:
        READERS[reader](path)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_in_a_folder_of_frames_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "frame_000.json")
    with pytest.raises(InputError) as caught:
        evidence.read(tmp_path)
    assert "\n" not in str(caught.value)


def claiming(path: Path) -> None:
    """Another array in an archive, which claims 8 TB."""
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"
    raw = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("more.npy", raw)


def locked(path: Path) -> None:
    """Members that say they have a password."""
    raw = bytearray(path.read_bytes())
    for mark, at in ((b"PK\x01\x02", 8), (b"PK\x03\x04", 6)):
        raw[raw.index(mark) + at] |= 1
    path.write_bytes(raw)


@pytest.mark.parametrize("damage", [claiming, locked])
def test_a_window_that_is_damaged_is_solved_again(tmp_path: Path, damage: Callable[[Path], None]) -> None:
    window = next(one for one in side_files.made(tmp_path) if one.format == "window")
    assert side_files.MAKERS["window"][1](window.path)
    damage(window.path)
    assert side_files.MAKERS["window"][1](window.path) is None


@pytest.mark.parametrize("reader", ["scene", "plan", "job", "camera"])
def test_deep_toml_is_a_line(tmp_path: Path, reader: str) -> None:
    path = tmp_path / "deep.toml"
    path.write_text("a = " + "[" * 5000 + "]" * 5000, encoding="utf-8")
    with pytest.raises(InputError, match=r"deep|recursion"):
        READERS[reader](path)


def test_what_becomes_of_a_file_is_limited_by_its_size(tmp_path: Path) -> None:
    """A few hundred kilobytes of zeros, as members or compressed, do not become gigabytes."""
    zeros = np.zeros(100 << 20, np.uint8)
    np.savez_compressed(tmp_path / "a.npz", a=zeros, b=zeros, c=zeros)
    with pytest.raises(InputError, match=r"315 MB; at most \d+ MB are read"):
        npz.load(tmp_path / "a.npz")
    (tmp_path / "a.pkl").write_bytes(zlib.compress(bytes(400 << 20), 9))
    with pytest.raises(InputError, match=r"found more than \d+ MB when decompressed"):
        evidence.read(tmp_path / "a.pkl")


def test_arrays_in_an_archive_are_counted(tmp_path: Path) -> None:
    """Each costs time, and a few hundred bytes hold one."""
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for i in range(npz.MEMBERS_MAX + 1):
            archive.writestr(f"{i}.npy", b"")
    with pytest.raises(InputError, match="10001 arrays; at most 10000 are read"):
        npz.load(path)
