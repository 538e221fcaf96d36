from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.evidence.video import choosing
from simrecon.evidence.video.blazepose import Pose, Region
from simrecon.evidence.video.choosing import Option
from simrecon.types import Array

RNG = np.random.default_rng(7)
SHAPE = RNG.normal(size=(33, 2)) * 40.0


def pose(x: float, angle_rad: float = 0.0, shape: Array = SHAPE, score: float = 0.9) -> Pose:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    points = shape @ np.array([[cos, sin], [-sin, cos]]) + [x, 100.0]
    region = Region(np.array([x, 100.0]), 250.0, angle_rad)
    return Pose(points, np.full(33, score), np.zeros((33, 3)), 1.0, region)


def made_up(x: float, seed: int) -> Pose:
    """Limbs of which the network is quite sure, others in each frame."""
    shape = np.random.default_rng(seed).normal(size=(33, 2)) * 40.0
    return pose(x, shape=shape, score=0.99)


def test_a_turn_is_no_change_of_the_body() -> None:
    assert choosing.change(pose(100.0), pose(140.0, 1.2)) == pytest.approx(0.0, abs=1e-12)
    assert choosing.jump(pose(100.0), pose(150.0)) == pytest.approx(0.2)
    assert choosing.agree(pose(100.0), pose(115.0))
    assert not choosing.agree(pose(100.0), pose(130.0))


def test_what_goes_on_counts_before_what_is_sure() -> None:
    """A somersault that is seen unclearly, and limbs that are made up from frame 3 to 8."""
    spins = [Option(pose(100.0 + 5 * t, 0.5 * t, score=0.5), 0.2) for t in range(12)]
    wrong = [Option(made_up(100.0 + 5 * t, t), 0.2) for t in range(12)]
    options = [[wrong[t] if 3 <= t < 9 else spins[t], spins[t]] for t in range(12)]
    assert choosing.best(options)[3:9].tolist() == [1] * 6


def test_the_clearer_one_of_two_that_agree_counts_and_the_one_with_the_colours() -> None:
    faint = [Option(replace(pose(100.0), scores=np.full(33, 0.4)), 0.1) for _ in range(4)]
    clear = [Option(pose(101.0), 0.1) for _ in range(4)]
    assert choosing.best(list(zip(faint, clear, strict=True))).tolist() == [1] * 4
    others = [replace(one, off=0.5) for one in clear]
    assert choosing.best(list(zip(faint, others, strict=True))).tolist() == [0] * 4


def test_frames_without_anybody_and_frames_with_one() -> None:
    one, other = Option(pose(100.0), 0.1), Option(pose(101.0, score=0.3), 0.1)
    assert choosing.best([[], [one], [other, one], [], [other, one]]).tolist() == [-1, 0, 1, -1, 1]
    assert choosing.best([]).tolist() == []
