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


GROWING = {
    "'replicate'": '<worldbody><replicate count="9999999"><geom size="1"/></replicate></worldbody>',
    "'flexcomp'": '<worldbody><flexcomp type="grid" count="2000 2000 10"/></worldbody>',
    "'size'": '<size nuser_body="2000000000"/>',
    "'texture'": '<asset><texture name="a" type="2d" builtin="flat" width="60000"/></asset>',
    "it holds: <hfield": '<asset><hfield name="a" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>',
    "it holds: builtin": '<asset><mesh name="a" builtin="sphere" params="12"/></asset>',
    "DEPTH_EXCEEDED": f"<worldbody>{'<body>' * 9999}{'</body>' * 9999}</worldbody>",
}


@pytest.mark.parametrize("said", GROWING)
def test_a_model_that_grows_is_refused_before_it_does(tmp_path: Path, said: str) -> None:
    (tmp_path / "model.xml").write_text(f"<mujoco>{GROWING[said]}</mujoco>", encoding="utf-8")
    with pytest.raises(InputError, match=said) as caught:
        models.load(tmp_path / "model.xml")
    assert "\n" not in str(caught.value)


def test_whatever_mujoco_ends_in_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: str) -> None:
        raise RuntimeError("Caught an unknown exception!")

    monkeypatch.setattr(models, "compile_text", fail)
    with pytest.raises(InputError, match=r"a.xml: cannot be loaded .Caught an unknown exception!."):
        models.compile_foreign("<mujoco/>", "a.xml")


def test_a_model_of_numbers_beyond_all_sense_is_refused() -> None:
    whole = "<mujoco><worldbody><body><geom size='.1' pos='0 0 1'/></body></worldbody></mujoco>"
    assert models.compile_foreign(whole, "model.xml").ngeom == 1
    with pytest.raises(InputError, match=r"model\.xml: cannot be loaded \(\w+ holds a number beyond 1e\+12"):
        models.compile_foreign(whole.replace("0 0 1", "0 0 -1e308"), "model.xml")
