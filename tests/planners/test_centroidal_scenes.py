"""Plans of the planner `centroidal` among items: what they stand on, and what it cannot plan on."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.planners.centroidal import check
from simrecon.planners.centroidal.inputs import inputs
from simrecon.planners.centroidal.settings import settings
from simrecon.types import Scene, SceneItem
from tests.support import rigid

STEP = SceneItem("step", "box", (0.9, 0.0, 0.0), {"size_m": (0.8, 1.2, 0.2)})


def item(kind: str, **values: float) -> Scene:
    """A scene with one item beside the person."""
    entry = {"name": "it", "kind": kind, "position_m": [9.0, 0.0, 0.0], **values}
    return Scene(items=(scenes.item(entry, "here"),))


@pytest.mark.parametrize("kind", ["trampoline", "mat"])
def test_what_gives_way_is_refused_in_a_line(kind: str) -> None:
    fit = rigid.fit(np.zeros((8, 3)), np.ones(8), scene=item(kind))
    with pytest.raises(InputError, match=f"the scene's {kind} 'it' gives way; valid: hard items") as caught:
        check(fit)
    assert "\n" not in str(caught.value)


def test_what_is_hard_is_not_refused() -> None:
    check(rigid.fit(np.zeros((8, 3)), np.ones(8), scene=item("stairs")))


def test_who_hops_onto_a_step_stands_on_the_floor_before_and_on_the_step_after() -> None:
    pytest.importorskip("casadi", reason="needs CasADi: install the extra centroidal")
    from simrecon.planners.centroidal import solving

    times, leaves_s, lands_s = rigid.FRAME_S * np.arange(40), 0.4, 0.9
    flight = np.clip(times - leaves_s, 0.0, 0.5)
    height = np.where(times < lands_s, flight * (0.4 + 0.5 * 9.81 * (0.5 - flight)), 0.2)
    moves = np.column_stack((1.6 * flight, 0.0 * times, height))
    rests = ((times <= leaves_s) | (times >= lands_s)).astype(float)
    fit = rigid.fit(moves, rests, scene=Scene(items=(STEP,)))
    planes = [[plane.height_m for plane in t.touching.planes] for t in inputs(fit, settings()).targets]
    found = solving.planned(fit, settings())
    assert found.notes == ()
    for place, contact, levels in zip(found.places_m, found.contact, planes, strict=True):
        assert levels[::2] == pytest.approx([0.0, 0.2], abs=1e-6)
        assert contact[:12].all()
        assert contact[28:].all()
        np.testing.assert_allclose(place[:12, 2], 0.0, atol=1e-6)
        np.testing.assert_allclose(place[28:, 2], 0.2, atol=1e-6)
