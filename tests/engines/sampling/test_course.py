"""When the search of a window is at rest."""

from __future__ import annotations

from dataclasses import replace

import pytest

from simrecon import plan
from simrecon.engines.sampling.course import Course


def course(*losses: float) -> Course:
    made = Course()
    for loss in losses:
        made.add(loss, 0)
    return made


@pytest.mark.parametrize(
    ("losses", "since", "relative", "absolute", "rests"),
    [
        ((9.0, 5.0, 5.0, 5.0), 0, 0.01, 0.0, False),  # it gained, three entries ago
        ((9.0, 5.0, 5.0, 5.0, 5.0), 0, 0.01, 0.0, True),
        ((9.0, 5.0, 5.0, 5.0, 5.0), 2, 0.01, 0.0, False),  # two entries only since then
        ((104.0, 103.0, 102.0, 100.0), 0, 0.039, 0.0, False),
        ((104.0, 103.0, 102.0, 100.0), 0, 0.041, 0.0, True),
        ((104.0, 103.0, 102.0, 100.0), 0, 0.0, 3.9, False),
        ((104.0, 103.0, 102.0, 100.0), 0, 0.02, 2.1, True),
        ((5.0, 5.0, 5.0, 5.0, 5.0), 0, 0.0, 0.0, False),  # never
    ],
)
def test_at_rest(
    losses: tuple[float, ...], since: int, relative: float, absolute: float, rests: bool
) -> None:
    optimiser = replace(plan.read("default").optimiser, tol_loss=relative, tol_loss_absolute=absolute)
    assert course(*losses).at_rest(optimiser, 3, since) is rests


def test_the_best_loss_counts() -> None:
    assert course(3.0, 5.0, 2.0).losses == [3.0, 3.0, 2.0]
