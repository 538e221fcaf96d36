"""Motion capture of a body of known size: the fit has its size, its place, and where its joints are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import cli, evidence, kinematics, results, scene
from simrecon import plan as plans
from simrecon.evidence import Options, Span
from simrecon.types import KinematicFit, Scene

CASES = Path(__file__).resolve().parents[1] / "data" / "cases"


def fitted(name: str, place: Scene | None = None, **asked: Any) -> tuple[KinematicFit, dict[str, np.ndarray]]:
    """The fit, and distances (T,) m of its joints from the file's, by name."""
    seen = evidence.read(CASES / f"{name}.bvh", Options(**asked))
    fit = kinematics.fit(seen, place or Scene(), plans.read("default").kinematics)
    ours, names = kinematics.configurations(fit.body, fit.qpos)[1], fit.body.skeleton.point_names
    return fit, {
        point: np.linalg.norm(ours[:, names.index(point)] - seen.joints_m[:, i], axis=-1)
        for i, point in enumerate(seen.joint_names)
        if point != "neck"  # rigs have it anywhere
    }


def thigh(fit: KinematicFit) -> float:
    return bodies.measure_template(fit.body.skeleton)["thigh"]


def test_a_person_on_a_platform_stays_there() -> None:
    fit, off = fitted("bvh_stands_on_platform", scene.read(CASES / "platform.toml"))
    np.testing.assert_allclose(fit.qpos[:, 2], 1.17, atol=0.005)  # the middle of the hips
    assert thigh(fit) == pytest.approx(0.41, rel=0.01)
    assert fit.body.height_m == pytest.approx(1.71, rel=0.02)
    assert np.mean(list(off.values())) < 0.005


def test_a_platform_is_a_support_where_the_floor_is_unknown() -> None:
    """A network's estimate may be anywhere: 0.2 m too high here."""
    seen = evidence.read(CASES / "bvh_stands_on_platform.bvh")
    guess = replace(seen, trust="world", joints_m=seen.joints_m + np.array([0.0, 0.0, 0.2]))
    place = scene.read(CASES / "platform.toml")
    plan = plans.read("quick").kinematics
    blind, seeing = (
        kinematics.fit(guess, replace(place, items=items), plan).qpos[:, 2] for items in ((), place.items)
    )
    np.testing.assert_allclose(seeing, 1.17, atol=0.03)
    np.testing.assert_allclose(blind, 1.17 - 0.3, atol=0.03)


@pytest.mark.parametrize("height_m", [None, 1.71])
def test_a_body_of_known_height(height_m: float | None) -> None:
    fit, off = fitted("bvh_height_1m71", height_m=height_m)
    assert fit.body.height_m == pytest.approx(1.71, rel=0.02)
    assert thigh(fit) == pytest.approx(0.41, rel=0.01)
    assert np.mean(list(off.values())) < 0.01


def test_a_height_alone_is_that_of_the_fit() -> None:
    fit, off = fitted("bvh_scaled_units", height_m=1.75)
    assert fit.body.height_m == pytest.approx(1.75, rel=0.02)
    assert thigh(fit) == pytest.approx(0.41 * 1.75 / 1.71, rel=0.01)
    assert np.mean(list(off.values())) < 0.01


def hips(fit: KinematicFit) -> np.ndarray:
    """The middle of the hips (T, 3)."""
    points, names = kinematics.configurations(fit.body, fit.qpos)[1], fit.body.skeleton.point_names
    return np.asarray(points[:, [names.index(f"{side}_hip") for side in ("left", "right")]].mean(axis=1))


@pytest.mark.slow
@pytest.mark.parametrize(("file", "travel_m"), [("mass_bvh/walk.bvh", 1.36), ("walking2.trc", 1.69)])
def test_recorded_walks_keep_their_length(shared_data: Path, file: str, travel_m: float) -> None:
    place = hips(recorded(shared_data, file))
    assert np.linalg.norm(place[-1, :2] - place[0, :2]) == pytest.approx(travel_m, abs=0.02)


@pytest.mark.slow
def test_a_recorded_somersault_stays_in_the_air_and_a_drop_begins_on_its_box(shared_data: Path) -> None:
    """No scene has the box."""
    assert hips(recorded(shared_data, "mass_bvh/backflip.bvh", 4))[60 // 4, 2] == pytest.approx(
        1.41, abs=0.02
    )
    dropped = hips(recorded(shared_data, "DJ1.trc", 3))[:, 2]
    assert dropped.min() == pytest.approx(0.51, abs=0.02)
    assert dropped.max() == pytest.approx(1.25, abs=0.02)


def recorded(data: Path, file: str, every: int = 1) -> KinematicFit:
    """The fit of a recorded motion, without a scene."""
    folder = data / ("mocap" if file.endswith("bvh") else "grf/opencap_subject4")
    seen = evidence.read(folder / file, Options(span=Span(every=every)))
    return kinematics.fit(seen, Scene(), plans.read("default").kinematics)


@pytest.mark.slow
def test_a_recorded_walk_is_simulated_within_25_mm(shared_data: Path, tmp_path: Path) -> None:
    case = ["run", str(shared_data / "mocap" / "mass_bvh" / "walk.bvh"), "--every", "4"]
    assert cli.main([*case, "-o", str(tmp_path / "out")]) == 0
    seen = evidence.read(Path(case[1]), Options(span=Span(every=4)))
    motion = results.read_motion(tmp_path / "out")
    off = [
        np.linalg.norm(motion.joints_m[:, motion.joint_names.index(name)] - seen.joints_m[:, i], axis=-1)
        for i, name in enumerate(seen.joint_names)
        if name != "neck" and name in motion.joint_names
    ]
    assert len(off) >= 12
    assert np.mean(off) < 0.025


@pytest.mark.slow
def test_the_platform_on_the_command_line(tmp_path: Path) -> None:
    case = ["run", str(CASES / "bvh_stands_on_platform.bvh"), "--scene", str(CASES / "platform.toml")]
    assert cli.main([*case, "-o", str(tmp_path / "out"), "--plan", "quick"]) == 0
    motion = results.read_motion(tmp_path / "out")
    hips = [motion.joints_m[:, motion.joint_names.index(f"{side}_hip"), 2] for side in ("left", "right")]
    np.testing.assert_allclose(np.mean(hips, axis=0), 1.17, atol=0.02)
    assert results.open_result(tmp_path / "out").body.height_m == pytest.approx(1.71, rel=0.02)


@pytest.mark.slow
def test_a_unit_by_number_and_joints_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = ["run", str(CASES / "bvh_scaled_units.bvh"), "--unit", "0.025", "--joints", "left_knee=LeftLeg"]
    assert cli.main([*case, "-o", str(tmp_path / "out"), "--plan", "quick"]) in (0, 3)
    assert results.open_result(tmp_path / "out").body.height_m == pytest.approx(1.71, rel=0.02)
    assert "unit 0.025 m (as given)" in capsys.readouterr().err
    again = ["run", "--job", str(tmp_path / "out" / "job.toml"), "-o", str(tmp_path / "again")]
    assert cli.main(again) in (0, 3)
    assert (tmp_path / "again" / "motion.npz").read_bytes() == (tmp_path / "out" / "motion.npz").read_bytes()
