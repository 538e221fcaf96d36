"""The lines of docs/formats.md that replay a result run as they stand, in its folder."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, results
from simrecon.evidence import Options
from simrecon.types import Evidence
from tests.support import foreign_files as foreign
from tests.support.runs import job_of
from tools import CHECKOUT


def lines() -> str:
    """The block of the page, which is indented."""
    page = (CHECKOUT / "docs" / "formats.md").read_text(encoding="utf-8")
    after = page[page.index("### Replaying it") :]
    block = after[after.index("\n    ") : after.index("\n`simrecon export")]
    return textwrap.dedent(block)


def test_the_lines_of_the_page_replay_a_result(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results.write(job_of(tmp_path / "out"), run)
    monkeypatch.chdir(tmp_path / "out")
    there: dict[str, Any] = {}
    exec(lines(), there)
    assert len(there["replayed"]) == len(run.motion.times_s)
    np.testing.assert_array_equal(there["replayed"], run.motion.qpos)


def test_the_lines_notice_another_motion(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results.write(job_of(tmp_path / "out"), run)
    path = tmp_path / "out" / "motion.npz"
    with np.load(path) as content:
        changed = dict(content)
    changed["ctrl"] = changed["ctrl"] + 1e-6
    np.savez(path, **changed)
    monkeypatch.chdir(tmp_path / "out")
    with pytest.raises(AssertionError):
        exec(lines(), {})


def read(folder: Path, scale: float, unit: str | float | None = None) -> Evidence:
    """A rig whose file was written at a scale of its centimetres."""
    path = folder / "rig.bvh"
    path.write_text(foreign.bvh(scale=scale)[0])
    return evidence.read(path, Options(unit=unit))


@pytest.mark.parametrize(
    ("scale", "unit", "said"), [(0.01, "m", "m"), (1.0, "cm", "cm"), (0.01 / 0.0254, 0.0254, "0.0254")]
)
def test_what_blender_exports_is_read_at_any_scale(
    tmp_path: Path, scale: float, unit: str | float, said: str
) -> None:
    """Metres with its Scale 1, centimetres with 100; found, or said."""
    wanted = read(tmp_path, 1.0).joints_m
    told = read(tmp_path, scale, unit)
    np.testing.assert_allclose(told.joints_m, wanted, atol=1e-6)
    if unit != 0.0254:
        alone = read(tmp_path, scale)
        np.testing.assert_allclose(alone.joints_m, wanted, atol=1e-6)
        assert f"unit {said} (the person is about 1.76 m tall)" in alone.reading
