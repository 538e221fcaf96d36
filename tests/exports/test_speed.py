"""All formats of ten seconds, in the time that a user waits gladly."""

from __future__ import annotations

import importlib.util
import shutil
import time
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import exports, results
from simrecon.results import motion_file

SECONDS, MOST_S = 10.0, 5.0


def repeated(finished: Path, target: Path) -> Path:
    """The result with its motion over and over, for ten seconds."""
    shutil.copytree(finished, target)
    motion = results.read_motion(finished)
    count = len(motion.times_s)
    times = int(np.ceil(SECONDS * 30 / count))
    rows: dict[str, Any] = {
        item.name: np.concatenate([values] * times)
        for item in fields(motion)
        if isinstance(values := getattr(motion, item.name), np.ndarray) and len(values) == count
    }
    rows["ctrl"] = np.concatenate([motion.ctrl] * times)
    rows["times_s"] = np.arange(count * times) / 30
    steps = np.linspace(0, len(rows["ctrl"]), count * times).astype(np.int64)
    rows["frame_step"] = steps
    long = replace(motion, **rows)
    (target / "motion.npz").write_bytes(motion_file.dumps(long))
    return target


@pytest.mark.slow
def test_all_formats_of_ten_seconds(finished: Path, tmp_path: Path) -> None:
    folder = repeated(finished, tmp_path / "long")
    formats = [name for name in exports.FORMATS if name != "usd" or importlib.util.find_spec("pxr")]
    began = time.process_time()  # other work on the machine does not count
    paths = exports.export(folder, formats)
    spent = time.process_time() - began
    print(f"{len(formats)} formats in {spent:.1f} s of a processor")
    assert all(path.stat().st_size for path in paths)
    assert spent < MOST_S
    results.check_writable(folder)
