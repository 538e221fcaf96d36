"""Two short clips, a broken one and a plan that takes a second or two."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrecon import evidence, resources
from tests.support import plan_text

FRAMES = 26
FAST = {
    "population": 12, "generations": 12, "descent_steps": 0, "length_s": 0.2, "overlap_s": 0.1,
    "evaluations": 40, "timestep_max_s": 0.017,
}  # fmt: skip


@pytest.fixture(scope="session")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `one.npz`, `two.npz`, `broken.npz`, and `plan.toml` in `settings`."""
    folder = tmp_path_factory.mktemp("inputs")
    given = evidence.read(resources.folder("example") / "beam.npz")
    for name, first in (("one", 0), ("two", 40)):
        part = slice(first, first + FRAMES)
        evidence.write(folder / f"{name}.npz", evidence.cut(given, part))
    (folder / "broken.npz").write_bytes(b"PK\x03\x04 and then nothing")
    (folder / "settings").mkdir()
    (folder / "settings" / "plan.toml").write_text(plan_text.quick(FAST), encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def plan(inputs: Path) -> str:
    """Path of the fast plan."""
    return str(inputs / "settings" / "plan.toml")
