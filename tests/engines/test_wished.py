"""Where points are wanted by what a user wishes of the contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.contact import wishes
from simrecon.engines.wished import PRESSED_M, Wished
from simrecon.kinematics.touched import touched
from simrecon.types import Array, ContactWish, KinematicFit
from tests.engines.conftest import Makers


def made(make: type[Makers], fit: KinematicFit, *asked: ContactWish) -> tuple[Wished | None, Array]:
    wished = replace(fit, wished=wishes.targets(asked, fit.times_s))
    problem = make.clip(make.settings(), wished)
    return problem.wished, problem.points_m


def test_what_is_to_touch_is_wanted_under_its_support(make: type[Makers]) -> None:
    fit = make.standing()
    fit.qpos[:, 2] += 0.05
    found, points = made(make, fit, ContactWish("left_heel", "auto", ((0.2, 0.3),)))
    assert found is not None
    heel = fit.body.skeleton.point_names.index("left_heel")
    assert set(np.flatnonzero(found.sure.any(axis=0))) == {heel}
    asked = (fit.times_s > 0.19) & (fit.times_s < 0.31)
    led = (fit.times_s > 0.09) & (fit.times_s < 0.41)  # it is led there
    np.testing.assert_array_equal(found.sure[:, heel], led)
    apart = touched(fit.body, fit.scene, fit.qpos, fit.times_s).clearance_m[:, 0]
    assert apart.min() > 0.04
    down = points[:, heel] - found.points_m[:, heel]
    np.testing.assert_allclose(down[asked], np.outer(apart[asked] + PRESSED_M, [0.0, 0.0, 1.0]), atol=1e-9)


def test_what_is_to_be_free_is_left_to_the_reference(make: type[Makers]) -> None:
    free = ContactWish("right_toe", "never", ((0.0, 0.1),))
    found, points = made(make, make.standing(), free)
    assert found is not None
    rows = [make.standing().body.skeleton.point_names.index(f"right_{end}") for end in ("toe", "mtp")]
    assert found.sure[:3, rows].all()
    assert not found.sure[4:].any()  # nor is it led through frames in which it is to be free
    np.testing.assert_array_equal(found.points_m[4:], points[4:])
    assert (found.points_m[:3, rows, 2] < points[:3, rows, 2] - PRESSED_M / 2).all()


@pytest.mark.parametrize(
    "asked", [(), (ContactWish("left_hand", "always"),), (ContactWish("left_heel", "never"),)]
)
def test_nothing_is_wanted_where_nothing_can_hold(make: type[Makers], asked: tuple[ContactWish, ...]) -> None:
    assert made(make, make.standing(), *asked)[0] is None  # the hand is a metre above the floor
