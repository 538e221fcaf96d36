"""The examples of docs/api.md run as they stand, one after another, beside a result in `out/clip`."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simrecon
from simrecon import evidence, results
from simrecon.metrics.truth import TRUTH_SCHEMA
from tests.support.runs import hasty, job_of
from tools import CHECKOUT

SECTIONS = ("## Results", "## Again, and for others")
EXTRAS = {"to_pandas": "pandas", "plot": "matplotlib"}
"""What a block needs that names it."""


def blocks() -> list[str]:
    """The indented blocks of the sections."""
    page = (CHECKOUT / "docs" / "api.md").read_text(encoding="utf-8")
    parts = [page[page.index(f"\n{title}\n") :].split("\n## ")[1] for title in SECTIONS]
    found = [
        textwrap.dedent(block) for part in parts for block in re.findall(r"(?:(?:^    .*|^)\n)+", part, re.M)
    ]
    return [block.strip() for block in found if block.strip()]


def test_every_call_has_an_example() -> None:
    text = "\n".join(blocks())
    for name in ("rerun", "retarget", "picture", "evaluate", "suggest", "export", "open_result"):
        assert f"simrecon.{name}(" in text


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_examples_run(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    evidence.write("clip.npz", run.evidence)
    motion = results.write(job_of(tmp_path / "out" / "clip", input="clip.npz"), run).motion
    np.savez(
        "truth.npz",
        schema=TRUTH_SCHEMA,
        times_s=motion.times_s,
        joint_names=np.array(motion.joint_names),
        joints_m=motion.joints_m,
    )
    monkeypatch.setattr(simrecon, "read_plan", lambda _: hasty())
    there: dict[str, Any] = {"simrecon": simrecon}
    ran = 0
    for block in blocks():
        needed = [package for word, package in EXTRAS.items() if word in block]
        if any(not _is_there(package) for package in needed):
            there.setdefault("result", simrecon.open_result("out/clip"))
            continue
        exec(block, there)
        ran += 1
    assert ran >= 6
    assert there["again"].job.seed == 1
    assert there["small"].body.height_m == pytest.approx(1.2)
    assert Path("frames.png").is_file()
    assert {path.name for path in there["paths"]} == {"motion.bvh", "motion.trc"}


def _is_there(package: str) -> bool:
    try:
        __import__(package)
    except ImportError:
        return False
    return True
