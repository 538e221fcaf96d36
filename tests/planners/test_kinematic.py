"""The kinematic optimisation of Rempe 2020, appendix B: its derivatives, its floor, what it makes of a clip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon import kinematics, plan, resources
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.kinematics import forward, layout
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
    seen = replace(
        whole, times_s=whole.times_s[FRAMES], keypoints_px=whole.keypoints_px[FRAMES], scores=whole.scores[FRAMES],
        joints_m=whole.joints_m[FRAMES],
    )  # fmt: skip
    return kinematics.fit(seen, scenes.read(resources.folder("example") / "beam.toml"), QUICK.kinematics), seen


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


def test_feet_in_contact_are_stiller_and_flatter(walk: tuple[KinematicFit, Evidence]) -> None:
    data = kinematic.prepared(*walk, QUICK, settings())
    found, floor = kinematic.optimised(*walk, QUICK, settings())
    assert np.isfinite(found.qpos).all()
    assert floor.normal[2] > 0.8
    before, after = (moved(fit, data) for fit in (walk[0], found))
    assert after < 0.7 * before


def moved(fit: KinematicFit, data: Data) -> float:
    """Mean step of foot points in contact."""
    root, base, rotvecs = layout.from_qpos(fit.qpos)
    pose = forward.forward(fit.body.skeleton, root, base, rotvecs, 1.0)
    places = forward.points(pose, data.segments, data.offsets_m)
    steps = np.linalg.norm(np.diff(places, axis=1), axis=2)
    return float(steps[data.contact[:, :-1]].mean())


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
    assert (level.normal.tolist(), level.height_m) == ([0.0, 0.0, 1.0], pytest.approx(0.3))


def test_without_landmarks_it_is_refused_in_a_line(walk: tuple[KinematicFit, Evidence]) -> None:
    fit, seen = walk
    blind = replace(seen, scores=np.zeros_like(seen.scores))
    with pytest.raises(InputError, match="no 2D landmarks") as caught:
        kinematic.optimised(fit, blind, QUICK, settings())
    assert "\n" not in str(caught.value)
