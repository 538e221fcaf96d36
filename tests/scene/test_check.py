"""Where a motion goes through things."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.scene import check
from simrecon.types import Scene, SceneItem

BODY = """
<mujoco>
  <worldbody>
    <body name="pelvis">
      <freejoint/>
      <geom name="trunk" type="capsule" size="0.1 0.3" mass="50"/>
      <geom name="foot" type="box" size="0.1 0.05 0.05" pos="0 0 -0.45" mass="2"/>
    </body>
  </worldbody>
</mujoco>
"""


def box(name: str, *position_m: float) -> SceneItem:
    return scenes.item(
        {"name": name, "kind": "box", "position_m": list(position_m), "size_m": [0.4, 0.4, 0.4]}, "test:"
    )


SCENE = Scene(items=(box("crate", 2.0, 0.0, 0.0), box("far", 9.0, 0.0, 0.0), box("crate/x", 4.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(scenes.build(BODY, SCENE, 0.01))


def path(*places: tuple[float, float]) -> np.ndarray:
    qpos = np.zeros((len(places), 7))
    qpos[:, 0], qpos[:, 2] = np.array(places).T
    qpos[:, 3] = 1.0
    return qpos


def test_depths_frames_and_parts(model: mujoco.MjModel) -> None:
    """Feet 5 cm in the floor at frame 1, the trunk 10 cm in a crate's side at frames 3 and 4."""
    found = check.penetrations(
        model, SCENE, path((0, 1), (0, 0.45), (0, 1), (2.0, 0.85), (2.0, 0.83), (4.0, 0.88))
    )
    by_name = {entry.name: entry for entry in found}
    assert list(by_name) == ["crate", "ground", "crate/x"]
    np.testing.assert_allclose(by_name["ground"].depth_m, [0, 0.05, 0, 0, 0, 0], atol=1e-6)
    np.testing.assert_allclose(by_name["crate"].depth_m, [0, 0, 0, 0.05, 0.07, 0], atol=1e-6)
    np.testing.assert_allclose(by_name["crate/x"].depth_m, [0, 0, 0, 0, 0, 0.02], atol=1e-6)
    crate = by_name["crate"]
    assert crate.deepest == 4
    assert crate.parts == ("", "", "", "foot", "foot", "")
    assert crate.spans(0.01) == ((3, 4),)
    assert crate.spans(0.06) == ((4, 4),)
    assert crate.spans(0.1) == ()


def test_a_thing_through_the_person_at_the_start_is_refused(model: mujoco.MjModel) -> None:
    check.refuse_start(model, SCENE, path((2.0, 0.85))[0])
    check.refuse_start(model, SCENE, path((0.0, 0.3))[0])  # the floor is the fit's business
    with pytest.raises(
        InputError, match=r"'crate' goes 1[0-9]0 mm through the person \((trunk|foot)\)"
    ) as caught:
        check.refuse_start(model, SCENE, path((2.0, 0.75))[0])
    assert "\n" not in str(caught.value)
