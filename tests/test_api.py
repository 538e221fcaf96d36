"""The public API: what it lists is there, and importing it is cheap."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import simrecon

CHECKOUT = Path(__file__).resolve().parents[1]
IMPORT_MAX_S = 0.3


def test_what_is_listed_is_there() -> None:
    for name in simrecon.__all__:
        assert getattr(simrecon, name) is not None
    assert set(simrecon.__all__) <= set(dir(simrecon))
    with pytest.raises(AttributeError, match="has no attribute 'walk'"):
        _ = simrecon.walk


def test_importing_loads_nothing_heavy() -> None:
    code = (
        "import sys, time; began = time.perf_counter(); import simrecon; "
        "print(time.perf_counter() - began, 'mujoco' in sys.modules, 'numpy' in sys.modules)"
    )
    spent = []
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        seconds, *heavy = done.stdout.split()
        assert heavy == ["False", "False"]
        spent.append(float(seconds))
    assert min(spent) <= IMPORT_MAX_S


def test_every_public_name_is_documented() -> None:
    text = (CHECKOUT / "docs" / "api.md").read_text(encoding="utf-8")
    headings = set(re.findall(r"^#+ .*`(?:simrecon\.)?(\w+)", text, re.MULTILINE))
    assert set(simrecon.__all__) - {"__version__"} <= headings


EXAMPLES = sorted((CHECKOUT / "docs" / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_short_and_run(path: Path, tmp_path: Path) -> None:
    assert 15 <= len(path.read_text(encoding="utf-8").splitlines()) <= 40
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, str(path), str(tmp_path)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip(), f"says nothing after {time.perf_counter() - began:.0f} s"


def test_there_are_at_least_four_examples() -> None:
    assert len(EXAMPLES) >= 4
