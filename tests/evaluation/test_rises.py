from __future__ import annotations

import numpy as np

from simrecon.evaluation import rises


def test_rises_of_hips_and_of_a_load() -> None:
    """Down for a second, up for a second, three times; a load that wavers while up does not count again."""
    height = np.tile(np.repeat([0.5, 0.9], 30), 3)
    assert rises.rises(height) == 3
    load = np.tile(np.concatenate((np.full(30, 75.0), np.zeros(30))), 3)
    assert rises.releases(load, 1 / 30) == 3
    load[40] = 30.0
    assert rises.releases(load, 1 / 30) == 3
    hips = np.zeros((180, 3))
    hips[:, 2] = height
    sitting, standing = rises.rests(hips, 1 / 30)
    assert sitting.sum() > 70
    assert standing.sum() == 90
    assert not (sitting & standing).any()
