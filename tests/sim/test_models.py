"""Models of MJCF."""

from __future__ import annotations

import pytest

from simrecon.sim import models


def test_a_text_becomes_a_model() -> None:
    model = models.compile_text("<mujoco><worldbody><body><geom size='.1'/></body></worldbody></mujoco>")
    assert (model.nbody, model.ngeom) == (2, 1)


def test_an_error_in_a_text_is_an_error() -> None:
    with pytest.raises(ValueError, match="nowhere"):
        models.compile_text("<mujoco><worldbody><nowhere/></worldbody></mujoco>")
