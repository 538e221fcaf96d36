"""What is exported: which motion, at which rate, on which legs; and which requests are none."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import cli, exports, results
from simrecon.errors import InputError
from simrecon.exports import legs, segments
from simrecon.exports import view as views
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.results import folder as folders
from simrecon.types import Scene
from tests.support.runs import person, squat

CHOICES = views.Choices


def test_a_view_shows_the_motion_and_its_fit(finished: Path, view: ResultView) -> None:
    result = results.open_result(finished)
    kept = np.delete(np.arange(10), 4)  # the frame that was dropped is shown
    np.testing.assert_allclose(view.points_m[kept], result.motion.joints_m, atol=1e-9)
    fit = views.of(result, CHOICES(of="fit"))
    assert result.motion.kinematic_qpos is not None
    np.testing.assert_allclose(fit.qpos[kept], result.motion.kinematic_qpos, atol=1e-9)
    assert fit.touching[:, legs_of(fit)].all()
    assert not fit.touching[:, view.body.skeleton.names.index("head")].any()


def legs_of(view: ResultView) -> list[int]:
    return [view.body.skeleton.names.index(f"{side}_ankle") for side in legs.SIDES]


def test_any_frame_rate(finished: Path) -> None:
    result = results.open_result(finished)
    view = views.of(result, CHOICES(fps=100.0))
    assert view.rate_hz == pytest.approx(100.0)
    assert len(view.times_s) == 31
    every = views.of(result, CHOICES())
    np.testing.assert_allclose(view.points_m[::10], every.points_m[[0, 3, 6, 9]], atol=1e-9)
    with pytest.raises(InputError, match=r"one frame of 0\.3 s"):
        views.of(result, CHOICES(fps=1.0))


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"of": "dream"}, "--of: found 'dream'; valid: simulation, fit"),
        ({"rig": "biped"}, "--rig: found 'biped'; valid: simrecon, mixamo"),
        ({"fps": 0.0}, "--fps: found 0; valid: 1 to 1000"),
        ({"fps": float("nan")}, "--fps: found nan"),
        ({"legs": 9.0}, "--legs: found 9; valid: 0.5 to 2"),
    ],
)
def test_bad_choices_are_one_line(choice: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        CHOICES(**choice)


def test_a_rig_needs_a_format_with_joints(finished: Path, tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="--rig: found 'mixamo' without a skeleton; valid: with bvh, glb, usd"
    ):
        exports.export(finished, ["trc", "csv"], tmp_path / "none", rig="mixamo")
    assert not (tmp_path / "none").exists()
    assert len(exports.export(finished, ["trc", "bvh"], tmp_path / "both", rig="mixamo")) == 2


def test_forces_are_those_of_the_simulated_person(finished: Path) -> None:
    result = results.open_result(finished)
    for choices, flag in ((CHOICES(of="fit"), "--of fit"), (CHOICES(legs=1.15), "--legs 1.15")):
        with pytest.raises(InputError, match=f"{flag}: forces belong to the simulation"):
            _ = views.of(result, choices).forces


def test_segments_and_configurations_are_inverse(rng: np.random.Generator) -> None:
    skeleton = person().skeleton
    quats = rotations.canonical(rng.normal(size=(6, 17, 4)))
    qpos = np.concatenate((rng.normal(size=(6, 3)), quats.reshape(6, -1)), axis=1)
    posed = segments.of(skeleton, qpos)
    np.testing.assert_allclose(
        segments.configurations(skeleton, posed.origins_m[:, 0], posed.quats), qpos, atol=1e-12
    )


def test_angular_velocity_is_in_the_world(rng: np.random.Generator) -> None:
    rate, start = np.array([0.3, -2.0, 1.0]), rotations.canonical(rng.normal(size=4))
    quats = rotations.multiply(rotations.exp(0.02 * np.arange(5)[:, None] * rate), start)
    np.testing.assert_allclose(segments.turn_rates(quats, 0.02), np.tile(rate, (5, 1)), atol=1e-9)


# --- other legs


def walked(factor: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A squat that goes forward over planted feet: ankles and pelvis before, and on other legs."""
    body = person()
    qpos = squat(body, np.linspace(0.0, 1.0, 40))
    qpos[:, 0] += np.linspace(0.0, 0.1, 40)
    before = segments.of(body.skeleton, qpos)
    rows = [body.skeleton.names.index(f"{side}_ankle") for side in legs.SIDES]
    loaded = np.ones((40, 2), dtype=bool)
    other, moved = legs.on_other_legs(body, qpos, factor, loaded, Scene(), 1 / 30)
    after = segments.of(other.skeleton, moved)
    scale = np.linalg.norm(other.skeleton.offsets_m[rows]) / np.linalg.norm(body.skeleton.offsets_m[rows])
    assert scale == pytest.approx(factor)
    turned = rotations.angle_between(before.quats[:, rows], after.quats[:, rows])
    assert turned.max() < 1e-6  # soles stay as they are
    return before.origins_m[:, rows], after.origins_m[:, rows], moved[:, 2] - qpos[:, 2]


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.15])
def test_feet_stay_where_they_stand(factor: float) -> None:
    before, after, up = walked(factor)
    np.testing.assert_allclose(after, before, atol=1e-9)
    assert up.mean() == pytest.approx((factor - 1.0) * 0.73, abs=0.002)
    assert np.abs(np.diff(up)).max() < 0.01  # nothing jumps


def test_exported_feet_slide_no_more_than_they_did(finished: Path, view: ResultView) -> None:
    other = views.of(results.open_result(finished), CHOICES(legs=1.15))
    points = [view.body.skeleton.point_names.index(f"{side}_heel") for side in legs.SIDES]
    slide = [np.linalg.norm(np.diff(of.points_m[:, points], axis=0), axis=-1) for of in (view, other)]
    assert np.abs(slide[1] - slide[0]).max() < 0.002
    assert other.body.height_m > 1.06 * view.body.height_m


# --- the folder


def test_exports_belong_to_a_result_and_nothing_else_does(finished: Path) -> None:
    exports.export(finished, ("bvh", "trc"))
    results.check_writable(finished)
    other = finished / "export" / "mine.txt"
    other.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"holds export/mine\.txt"):
        results.check_writable(finished)
    other.unlink()
    assert folders.is_plain(finished)


def test_the_command_says_what_is_valid(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["export", str(finished), "--to", "bhv"]) == 2
    assert "--to: found bhv, did you mean 'bvh'?; valid: bvh" in capsys.readouterr().err
    assert cli.main(["export", str(finished), "--to", "trc", "--of", "fit", "--fps", "60"]) == 0
    assert "motion.trc" in capsys.readouterr().out


def test_a_result_of_an_earlier_version_is_one_line(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = tmp_path / "old"
    shutil.copytree(finished, old)
    model = (old / "model.xml").read_text(encoding="utf-8")
    (old / "model.xml").write_text(model.replace('name="skull_base"', 'name="other"'), encoding="utf-8")
    assert cli.main(["export", str(old), "--to", "bvh"]) == 2
    said = capsys.readouterr().err
    assert "Invalid name 'skull_base'; valid: the model of a result of this version" in said
    assert said.count("\n") == 1
    assert cli.main(["export", str(finished), "--to", "bvh,,trc"]) == 2
    assert "--to: found nothing between commas; valid: bvh" in capsys.readouterr().err
