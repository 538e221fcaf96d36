from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence import markers, opensim
from simrecon.geometry import rotations
from simrecon.types import Array


def test_a_point_is_carried_by_its_cluster_and_needs_three_markers(rng: np.random.Generator) -> None:
    static, centre = rng.normal(size=(5, 3)), rng.normal(size=3)
    turn = rotations.matrix(rotations.exp(rng.normal(size=(6, 3))))  # (T, 3, 3)
    shift = rng.normal(size=(6, 1, 3))
    moving = static @ np.swapaxes(turn, -1, -2) + shift
    expected = (turn @ centre) + shift[:, 0]
    moving[1, 0] = np.nan
    moving[2, :3] = np.nan
    found = markers.carried(static, moving, centre)
    np.testing.assert_allclose(np.delete(found, 2, axis=0), np.delete(expected, 2, axis=0), atol=1e-9)
    assert np.isnan(found[2]).all()


@pytest.fixture
def trials(shared_data: Path) -> dict[str, opensim.Markers]:
    folder = shared_data / "grf" / "opencap_subject4"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    return {name: opensim.read_trc(folder / f"{name}.trc") for name in ("static1", "walking1")}


def lengths(centres: dict[str, Array], a: str, b: str) -> Array:
    return np.linalg.norm(centres[a] - centres[b], axis=-1)


def test_joint_centres_of_a_real_walk(trials: dict[str, opensim.Markers]) -> None:
    found = markers.joint_centres(trials["static1"], trials["walking1"])
    for side, functional in (("left", "L_HJC"), ("right", "R_HJC")):
        # the laboratory's own functional hip centres
        distance = np.linalg.norm(found[f"{side}_hip"] - trials["walking1"].of(functional), axis=-1)
        assert np.nanmedian(distance) < 0.025
        for a, b in (("hip", "knee"), ("knee", "ankle"), ("heel", "toe")):
            length = lengths(found, f"{side}_{a}", f"{side}_{b}")
            assert np.std(length) < 0.015, (a, b)
        assert found[f"{side}_heel"][:, 2].min() == pytest.approx(0.0, abs=0.01)
    assert abs(np.median(lengths(found, "left_knee", "left_ankle")) - 0.39) < 0.04


def test_feet_are_as_long_as_feet_though_the_markers_are_on_their_knuckles(
    trials: dict[str, opensim.Markers],
) -> None:
    found = markers.joint_centres(trials["static1"], trials["walking1"])
    for side in ("left", "right"):
        shank = np.median(lengths(found, f"{side}_knee", f"{side}_ankle"))
        foot = np.median(lengths(found, f"{side}_heel", f"{side}_toe"))
        assert foot == pytest.approx(0.152 / 0.246 * shank, rel=0.02)


def test_evidence_says_that_its_world_is_known(trials: dict[str, opensim.Markers]) -> None:
    made = markers.evidence(trials["static1"], trials["walking1"], 60.1)
    assert made.joints_frame == "world"
    assert made.mass_kg == 60.1
    assert made.camera is not None
    assert made.camera.path is not None


def test_missing_markers_are_named(trials: dict[str, opensim.Markers]) -> None:
    walk = trials["walking1"]
    short = opensim.Markers(walk.times_s, tuple(n.replace("L_calc", "x") for n in walk.names), walk.points_m)
    with pytest.raises(InputError, match="of the trial: found no L_calc"):
        markers.joint_centres(trials["static1"], short)
    with pytest.raises(InputError, match="static trial: found no L_mankle"):
        markers.joint_centres(walk, walk)
