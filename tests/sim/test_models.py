"""Models of MJCF."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrecon.errors import InputError
from simrecon.sim import models


def test_a_text_becomes_a_model() -> None:
    model = models.compile_text("<mujoco><worldbody><body><geom size='.1'/></body></worldbody></mujoco>")
    assert (model.nbody, model.ngeom) == (2, 1)


def test_an_error_in_a_text_is_an_error() -> None:
    with pytest.raises(ValueError, match="nowhere"):
        models.compile_text("<mujoco><worldbody><nowhere/></worldbody></mujoco>")


@pytest.mark.parametrize(
    "text",
    [
        '<mujoco><include file="/etc/passwd"/></mujoco>',
        "<mujoco><asset><mesh name='a' file='../a.stl'/></asset></mujoco>",
        '<mujoco><extension><plugin plugin="mujoco.sensor.touch_grid"/></extension></mujoco>',
        '<mujoco><compiler meshdir = "/"/></mujoco>',
    ],
)
def test_a_model_that_names_another_file_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "model.xml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="it names another file"):
        models.load(tmp_path / "model.xml")
