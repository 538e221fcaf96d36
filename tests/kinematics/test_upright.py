"""Up, of people who stand in a world that leans."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.kinematics import upright

FRAMES = 60


@dataclass
class Stated:
    """What `upright` looks at: feet on the ground, a centre of mass over them, all turned."""

    turn: np.ndarray
    high_m: float = 0.95
    sway_m: float = 0.05
    standing: float = 1.0

    def state(self) -> Any:
        phase = np.linspace(0, 6 * np.pi, FRAMES)
        com = np.stack((self.sway_m * np.sin(phase), 0 * phase, np.full(FRAMES, self.high_m)), axis=-1)
        soles = np.zeros((2, FRAMES, 3))
        soles[0, :, 1], soles[1, :, 1] = 0.1, -0.1
        see = SimpleNamespace(standing=np.full((2, FRAMES), self.standing))
        problem = SimpleNamespace(observations=see, skeleton=bodies.scaled({}, 1.7))
        return SimpleNamespace(
            problem=problem, com_m=com @ self.turn.T, soles_m=soles @ self.turn.T, scale=1.0, dt=1 / 30
        )


@pytest.fixture
def leaning() -> np.ndarray:
    return rotations.matrix(rotations.exp(np.array([0.2, -0.15, 0.0])))


def test_who_stands_says_where_up_is(leaning: np.ndarray) -> None:
    found = upright.find(Stated(leaning).state(), world=False)
    apart = np.degrees(np.arccos(found.direction @ leaning[:, 2]))
    assert apart < 2.0
    assert found.sigma_rad < 0.1
    np.testing.assert_allclose(found.turn @ found.direction, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(found.turn @ found.turn.T, np.eye(3), atol=1e-12)


def test_a_world_of_its_own_is_believed_more_than_a_camera_s(leaning: np.ndarray) -> None:
    apart = [
        float(np.arccos(upright.find(Stated(leaning).state(), world=world).direction @ leaning[:, 2]))
        for world in (False, True)
    ]
    assert apart[0] < apart[1]


@pytest.mark.parametrize("changes", [{"high_m": 0.5}, {"standing": 0.0}])
def test_who_sits_or_flies_says_nothing(leaning: np.ndarray, changes: dict[str, float]) -> None:
    found = upright.find(Stated(leaning, **changes).state(), world=False)
    np.testing.assert_array_equal(found.direction, [0, 0, 1])
    assert found.sigma_rad == upright.LEVEL_RAD["camera"] > upright.SURE_RAD
