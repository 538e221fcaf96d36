"""A short version of tools/bench/chaos_batch.py."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools import CHECKOUT


@pytest.mark.slow
def test_killed_at_random_the_results_have_the_same_bits(inputs: Path, plan: str, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs dask.distributed: install the extra batch")
    text = Path(plan).read_text(encoding="utf-8").replace("population = 12", "population = 40")
    slow = tmp_path / "plan.toml"
    slow.write_text(text.replace("generations = 12", "generations = 60"), encoding="utf-8")
    command = [sys.executable, "-m", "tools.bench.chaos_batch", str(inputs), "-o", str(tmp_path)]
    done = subprocess.run(
        [*command, "--kills", "6", "--plan", str(slow), "--span", "8"],
        env={**os.environ, "PYTHONPATH": str(CHECKOUT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "6 kills, 0 with processes left over, 0 files that differ" in done.stdout
