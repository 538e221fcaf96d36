"""What segments are to bear of which a user wishes that a part touches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.contact import wishes
from simrecon.engines.borne import Borne, borne
from simrecon.types import ContactWish, KinematicFit, Reference
from tests.engines.conftest import Makers


def planned(fit: KinematicFit) -> Reference:
    """A plan in which the scene pushes both ends of the left foot, one twice as much, and the right foot."""
    force = np.zeros((len(fit.times_s), 3, 3))
    force[..., 2] = [200.0, 100.0, 300.0]
    place = np.tile([[0.0, 0.1, 0.0], [0.3, 0.1, 0.0], [0.1, -0.1, 0.0]], (len(fit.times_s), 1, 1))
    return Reference(
        planner="soft_contact",
        times_s=fit.times_s,
        qpos=fit.qpos,
        com_m=fit.com_m,
        contact_segments=("left_ankle", "left_ankle", "right_ankle"),
        contact_force_N=force,
        contact_place_m=place,
    )


def found(fit: KinematicFit, *asked: ContactWish) -> Borne | None:
    return borne(replace(fit, wished=wishes.targets(asked, fit.times_s)), planned(fit))


def test_a_segment_bears_what_the_plan_has_it_bear(make: type[Makers]) -> None:
    fit = make.standing()
    made = found(fit, ContactWish("left_heel", "auto", ((0.2, 0.3),)))
    assert made is not None
    assert made.segments == ("left_ankle",)
    np.testing.assert_allclose(made.wrenches[0, 0], [30.0, -30.0, 0.0, 0.0, 0.0, 300.0])
    np.testing.assert_allclose(made.places_m[0, 0], [0.1, 0.1, 0.0], atol=1e-6)
    led = (fit.times_s > 0.09) & (fit.times_s < 0.41)  # it is led there
    np.testing.assert_array_equal(made.sure[:, 0], led)


def test_nothing_is_borne_by_what_is_free_or_cannot_touch(make: type[Makers]) -> None:
    fit = make.standing()
    assert found(fit, ContactWish("left_heel", "never")) is None
    assert found(fit, ContactWish("left_hand", "always")) is None  # a metre above the floor
    assert borne(fit, planned(fit)) is None
    asked = replace(fit, wished=wishes.targets((ContactWish("left_heel", "always"),), fit.times_s))
    assert borne(asked, replace(planned(fit), contact_force_N=None)) is None
