"""The page of the synthesis says what was measured, and marks what is missed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tools.study import synthesis_numbers as numbers
from tools.study import synthesis_page
from tools.study.synthesis_targets import targets

KINDS = ("truth", "simulation", "fit", "half")


def known(**better: float) -> dict[str, Any]:
    """Two seeds, three windows of two motions; a factor on the scores of what is named."""

    def scores(kind: str, seed: int, sampler: str) -> dict[str, list[float]]:
        factor = better.get(kind, 1.0) * (1 + 0.001 * seed) * (0.9 if sampler == "dlow" else 1.0)
        down, up = [factor * 0.1] * 3, [2.0 / factor] * 3
        feet = {name: [1.0] * 3 for name in ("skate", "penetration", "floating")}
        return {"ade": down, "fde": down, "apd": up, "nearest_m": [0.2] * 3, **feet}

    far = dict.fromkeys(
        ("fit_mpjpe_g_mm", "simulation_mpjpe_g_mm", "fit_mpjpe_mm", "simulation_mpjpe_mm"), 50.0
    )
    return {
        "clips": [{"part": "train", "seconds": 4.97, "frames": 150, "simulated": 120, **far}],
        "motions": [51, 18], "windows": 40, "tests": [3, 2], "test_names": ["a", "a", "b"], "seeds": 2,
        "scores": {
            f"{kind} {seed}": {name: scores(kind, seed, name) for name in ("cvae", "dlow", "seen")}
            for kind in KINDS
            for seed in range(2)
        },
        "still": {"ade": [0.2], "fde": [0.3], "apd": [0.0]}, "still_seen": {"ade": [0.2]},
        "true_looks": [1.0, 2.0, 3.0],
        "true_nearest": dict.fromkeys(KINDS, 0.15), "speed_s": 0.04,
        "simulated": [
            {"to_the_end": True, "balanced": True}, {"to_the_end": False, "balanced": False}, {"refused": "x"}
        ],
    }  # fmt: skip


def test_the_page_has_all_tables() -> None:
    page = synthesis_page.page(known(simulation=0.9))
    assert "| train | 1 of 51 | 5 | 80.0 | 50 | 50 | 50 | 50 |" in page
    assert "| DLow | (b) simulated | 0.081 (0.081–0.081) |" in page
    assert "| amount of data | ADE with every second recording against all | +0.0 % |" in page
    assert "1 of 2 futures are followed to the end" in page
    assert "--seconds 5 " in page
    assert max(len(line) for line in page.splitlines() if not line.startswith("|")) <= 120


def test_a_target_is_met_or_missed() -> None:
    assert {row[-1] for row in targets(known(simulation=0.9))} == {"met"}
    missed = [row[0] for row in targets(known(simulation=1.3)) if row[-1] != "met"]
    assert missed == [
        *(f"(b) against (c), {score}" for score in ("ADE", "FDE", "APD")),
        *(f"(b) against (a), {score}" for score in ("ADE", "FDE", "APD")),
    ]
    nobody = known() | {"simulated": []}
    assert [
        "simulated to the end, of those that start in balance",
        "90% or more",
        "0 of 0",
        "**missed**",
    ] in targets(nobody)


@pytest.mark.parametrize(("factor", "said"), [(0.9, "better"), (1.0, "no"), (1.1, "worse")])
def test_seeds_are_apart_or_not(factor: float, said: str) -> None:
    facts = known(simulation=factor)
    for score in ("ade", "apd"):
        both = numbers.pair(facts, "cvae", "fit", score)
        assert numbers.apart(*both, score) == said
    low, high = numbers.interval(facts, *numbers.pair(facts, "cvae", "fit", "ade"))
    np.testing.assert_allclose([low, high], 100 * (factor - 1), atol=1e-9)
