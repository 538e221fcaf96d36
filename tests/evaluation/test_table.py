from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simrecon.evaluation import table
from simrecon.evaluation.comparison import comparison, track
from simrecon.metrics.definitions import DEFINITIONS
from simrecon.metrics.statistics import Scores, of_frames
from simrecon.types import Scene
from tests.support.standing import NAMES, standing

TIMES = np.arange(61) / 30


@pytest.fixture
def on() -> Any:
    still = np.repeat(standing()[None], len(TIMES), axis=0)
    return comparison(track(TIMES, NAMES, still, "reference"), TIMES[:31], Scene())


def rows() -> dict[str, Scores]:
    errors = of_frames(np.random.default_rng(0).uniform(0.02, 0.04, size=31), scale=1e3)
    return {
        "result": Scores({"mpjpe_g_mm": errors}, {"grf_max_pct": 1234.5, "grf_ballistic_pct": float("nan")}),
        "reference": Scores({}, {"grf_max_pct": 0.25}),
    }


def test_means_have_intervals_and_what_is_unknown_is_left_out(on: Any) -> None:
    scored = table.make("result", rows(), on, seed=0)
    assert list(scored.values["result"]) == ["covered", "mpjpe_g_mm", "grf_max_pct"]
    assert scored.values["result"]["covered"] == pytest.approx(31 / 61)
    low, high = scored.intervals["result"]["mpjpe_g_mm"]
    assert low < scored.values["result"]["mpjpe_g_mm"] < high
    assert list(scored.intervals["result"]) == ["mpjpe_g_mm"]
    assert table.make("result", rows(), on, seed=None).intervals == {}


def test_text_has_a_column_for_each_motion_and_the_definition(on: Any) -> None:
    lines = table.text(table.make("result", rows(), on, seed=3)).splitlines()
    assert lines[0].split() == ["result", "reference", "[result]"]
    (line,) = [line for line in lines if line.startswith("grf_max_pct")]
    assert line.split()[1:3] == ["1234", "0.25"]
    assert line.endswith(DEFINITIONS["grf_max_pct"])
    assert lines[-1].endswith("seed 3")
    assert "[" not in table.text(table.make("result", rows(), on, seed=None))


@pytest.mark.parametrize(
    ("value", "shown"), [(None, "-"), (0.0, "0"), (-1e-12, "0"), (0.012345, "0.0123"), (-12345.6, "-12346")]
)
def test_numbers_have_three_digits_or_all_whole_ones(value: float | None, shown: str) -> None:
    assert table.number(value) == shown
