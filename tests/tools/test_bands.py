"""The study of bands: factors are those with which nine of ten lie within."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tools.study import bands

FRAMES = 400


def clip(scale: float, seed: int) -> Any:
    """Errors that are Gaussian, `scale` times as wide as their spreads say."""
    rng = np.random.default_rng(seed)
    line = np.tile([1.0, 0.0, 0.0], (FRAMES, 1, 1))
    across, along = np.tile([0.0, 0.01, 0.01], (FRAMES, 4, 1)), np.tile([0.05, 0.0, 0.0], (FRAMES, 4, 1))
    sigma = np.full((FRAMES, 3, 3), 20.0)
    sigma[0] = np.nan
    content: dict[str, Any] = {
        "weight_N": np.array(700.0),
        "across_m": across,
        "along_m": along,
        "off_m": scale * rng.standard_normal((FRAMES, 4, 3)) * (across + along),
        "sight": line,
        "truth_N": scale * 20.0 * rng.standard_normal((FRAMES, 3, 3)),
        "own_N": np.zeros((FRAMES, 3, 3)),
        "touch": np.full((FRAMES, 2), 0.95),
        "touches": np.ones((FRAMES, 2), bool),
    }
    for word in ("planned", "alone"):
        content |= {f"centre_{word}_N": 0.0 * sigma, f"sigma_{word}_N": sigma}
    return content


def test_factors_of_gaussian_errors_are_their_quantiles() -> None:
    found = bands.factors({"a": clip(1.0, 0), "b": clip(1.0, 1)})
    assert found["joints_along"] == pytest.approx(1.645, rel=0.05)
    for kind in bands.KINDS[2:]:
        assert found[kind] == pytest.approx(1.645, rel=0.08), kind
    shares = bands.covered(clip(1.0, 2), found)
    assert shares["planned_all_vertical"][0] == pytest.approx(0.9, abs=0.04)
    assert shares["planned_all_vertical"][1] == pytest.approx(100 * 1.645 * 20 / 700, rel=0.1)


def test_a_clip_that_is_off_by_more_is_covered_less() -> None:
    found = bands.factors({"a": clip(1.0, 0), "b": clip(1.0, 1)})
    assert bands.covered(clip(3.0, 2), found)["planned_feet_vertical"][0] < 0.6
    assert bands.covered(clip(3.0, 2), found)["joints"][0] < 0.8
