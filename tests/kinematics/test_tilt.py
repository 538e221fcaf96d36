"""A tilt that nobody knows: the parabola, and the weight of what the motion says."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.kinematics import tilt
from simrecon.kinematics.world import LEVEL
from simrecon.types import Array, KinematicFit


def test_the_lowest_place_of_a_parabola_and_no_farther_than_trusted() -> None:
    assert tilt.lowest(*(3.0 * (x - 0.4) ** 2 + 1.0 for x in (-1, 0, 1))) == pytest.approx(0.4)
    assert tilt.lowest(*((x - 7.0) ** 2 for x in (-1, 0, 1))) == tilt.FARTHEST
    assert tilt.lowest(*(-((x - 0.2) ** 2) for x in (-1, 0, 1))) == -tilt.FARTHEST
    assert tilt.lowest(2.0, 2.0, 2.0) == 0.0


def of_loss(weight: float, real: Array, tried: list[Array]) -> tilt.Fit:
    """Fits whose evidence is best at a tilt; what the rest of the loss says is not asked."""

    def fit(lean: Array) -> KinematicFit:
        tried.append(lean)
        loss = {"place": weight * float(np.sum((lean - real) ** 2)), "balance": -1e6 * float(lean.sum())}
        return KinematicFit(*[None] * 9, loss)  # type: ignore[call-arg, arg-type]

    return fit


def test_what_the_motion_says_is_weighed_against_balance() -> None:
    real, tried = np.radians([4.0, -2.0]), list[Array]()
    sure = tilt.estimated(of_loss(1e6, real, tried))
    np.testing.assert_allclose(sure, real, atol=1e-4)
    assert len(tried) == 10
    as_sure_as_balance = 1 / (tilt.SHARE * tilt.SIGMA_RAD**2)
    np.testing.assert_allclose(tilt.estimated(of_loss(as_sure_as_balance, real, [])), real / 2)
    np.testing.assert_allclose(tilt.estimated(of_loss(0.0, real, [])), 0.0)


def test_pitch_is_about_the_images_x_axis_and_roll_about_the_view() -> None:
    down = tilt.turned(np.array([0.1, 0.0]), LEVEL) @ [1.0, 0.0, 0.0]
    assert down[2] == pytest.approx(np.sin(0.1))
    rolled = tilt.turned(np.array([0.0, 0.1]), LEVEL)
    np.testing.assert_allclose(rolled @ [1.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    assert (rolled @ [0.0, 0.0, 1.0])[1] == pytest.approx(-np.sin(0.1))
