"""Depth and pull of a support, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.kinematics.terms.touch import penetration, touching


def test_only_depth_is_penetration() -> None:
    loss, gradient = penetration(np.array([0.3, 0.0, -0.02]), 0.01)
    assert loss == pytest.approx(4.0)
    np.testing.assert_allclose(gradient, [0.0, 0.0, -400.0])


def test_the_pull_to_a_support_fades_with_distance() -> None:
    loss, gradient = touching(np.array([0.0, 0.05, 5.0]), 0.05)
    assert loss == pytest.approx(0.5 + 1.0, abs=1e-3)
    assert gradient[0] == 0.0
    assert gradient[1] == pytest.approx(10.0)
    assert abs(gradient[2]) < 1e-3
