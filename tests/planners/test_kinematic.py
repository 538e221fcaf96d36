"""The kinematic optimisation of Rempe 2020, appendix B: derivatives, floor, what it makes of a clip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon import kinematics, plan, resources
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.evidence import cutting, resample
from simrecon.kinematics import layout
from simrecon.planners.centroidal import kinematic, plane
from simrecon.planners.centroidal.energies import Data, rows
from simrecon.planners.centroidal.settings import settings
from simrecon.types import Array, Evidence, KinematicFit

QUICK = plan.read("quick")
FRAMES = slice(0, 12)


@pytest.fixture(scope="module")
def walk() -> tuple[KinematicFit, Evidence]:
    """The first frames of the example."""
    whole, _ = resample(readers.read(resources.folder("example") / "beam.npz"))
    seen = cutting.cut(whole, FRAMES)
    return kinematics.fit(
        seen, scenes.read(resources.folder("example") / "beam.toml"), QUICK.kinematics
    ), seen


def unknowns(data: Data) -> Array:
    """The fit's, with noise."""
    root, _, rotvecs = layout.from_qpos(data.fit.qpos)
    by_frame = np.concatenate((root, np.swapaxes(rotvecs, 0, 1).reshape(len(root), -1)), axis=1)
    return np.asarray(by_frame.ravel() + 0.01 * np.random.default_rng(0).standard_normal(by_frame.size))


def test_derivatives_are_those_of_differences(walk: tuple[KinematicFit, Evidence]) -> None:
    sloped = plane.Floor(np.array([0.1, 0.0, 0.995]), 0.02)
    data = replace(kinematic.prepared(*walk, QUICK, settings()), floor=sloped)
    x = unknowns(data)
    along = np.random.default_rng(1).standard_normal(len(x))
    ahead, behind = (rows(data, x + step * along)[0] for step in (1e-6, -1e-6))
    slope = rows(data, x)[1] @ along
    np.testing.assert_allclose((ahead - behind) / 2e-6, slope, atol=1e-4 * np.abs(slope).max())
    assert len(slope) > 300 * len(data.base)


def test_the_search_lowers_the_objective(walk: tuple[KinematicFit, Evidence]) -> None:
    data = kinematic.prepared(*walk, QUICK, settings())
    start = unknowns(data)
    before, after = (float(np.sum(rows(data, x)[0] ** 2)) for x in (start, kinematic.searched(data, start)))
    assert after < 0.5 * before


def test_the_motion_is_there_with_a_floor(walk: tuple[KinematicFit, Evidence]) -> None:
    found, floor = kinematic.optimised(*walk, QUICK, settings())
    assert np.isfinite(found.qpos).all()
    assert floor.normal[2] > 0.8
    off = np.linalg.norm(found.com_m - walk[0].com_m, axis=1)
    assert 1e-3 < off.mean() < 0.5


def test_the_floor_is_that_of_most_contacts() -> None:
    """A tenth of the contacts is 20 cm too high; the rest is on a slope."""
    rng = np.random.default_rng(3)
    places = rng.uniform(-1.0, 1.0, (4, 25, 3))
    places[..., 2] = 0.3 + 0.1 * places[..., 0] + 0.003 * rng.standard_normal((4, 25))
    places[0, :10, 2] += 0.2
    floor, contact = plane.through(places, np.ones((4, 25), bool), 1.345, 0.05)
    expected = np.array([-0.1, 0.0, 1.0]) / np.hypot(0.1, 1.0)
    np.testing.assert_allclose(floor.normal, expected, atol=0.01)
    assert floor.over_m(np.array([0.0, 0.0, 0.3])) == pytest.approx(0.0, abs=0.005)
    assert not contact[0, :10].any()
    assert contact.sum() == 90
    level = plane.huber(np.array([[0.0, 0.0, 0.2], [1.0, 0.0, 0.4]]), 1.345)
    assert level.normal.tolist() == [0.0, 0.0, 1.0]
    assert level.height_m == pytest.approx(0.3)


def test_without_landmarks_it_is_refused_in_a_line(walk: tuple[KinematicFit, Evidence]) -> None:
    fit, seen = walk
    blind = replace(seen, scores=np.zeros_like(seen.scores))
    with pytest.raises(InputError, match="no 2D landmarks") as caught:
        kinematic.optimised(fit, blind, QUICK, settings())
    assert "\n" not in str(caught.value)
