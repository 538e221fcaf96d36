from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon.evaluation.accuracy import accuracy
from simrecon.evaluation.comparison import Comparison, comparison, track
from simrecon.evaluation.plausibility import plausibility
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, read_truth
from simrecon.types import Array, Scene, SceneItem
from tests.support.standing import NAMES, standing

TIMES = np.arange(61) / 30
LIFT = np.array([0.0, 0.0, 0.4])


def still() -> Array:
    return np.repeat(standing()[None], len(TIMES), axis=0)


def on(scene: Scene = Scene(), truth: Array | None = None) -> Comparison:  # noqa: B008
    target = track(TIMES, NAMES, still() if truth is None else truth, "reference")
    return comparison(target, TIMES, scene)


def scores(motion: Array, against: Comparison) -> dict[str, float]:
    own = track(TIMES, NAMES, motion, "motion")
    return (accuracy(own, against) | plausibility(own, against)).values


def test_a_standing_body_is_perfect_against_itself() -> None:
    values = scores(still(), on())
    for name, value in values.items():
        if name.startswith(("implied_grf", "f1_", "contact_f1", "touch_f1", "pck", "foot_contact")):
            continue
        assert value == pytest.approx(0, abs=1e-9), name
    assert values["implied_grf_mean_pct"] == pytest.approx(100)
    assert values["implied_grf_max_pct"] == pytest.approx(100)
    assert (
        values["contact_f1"] == values["f1_left_heel"] == values["touch_f1"] == values["touch_f1_least"] == 1
    )
    assert values["pck_pct"] == 100
    assert "implied_grf_ballistic_pct" not in values  # nobody flies


def test_ten_millimetres_under_the_floor() -> None:
    values = scores(still() - [0.0, 0.0, 0.01], on())
    assert values["body_penetration_mean_mm"] == pytest.approx(10)
    assert values["body_penetration_max_mm"] == pytest.approx(10)
    assert values["body_penetration_pct"] == 100
    assert values["penetration_rempe_pct"] == 0
    assert values["mpjpe_g_mm"] == pytest.approx(10)


def test_a_slide_at_half_a_metre_a_second() -> None:
    values = scores(still() + TIMES[:, None, None] * [0.5, 0.0, 0.0], on())
    assert values["skate_wham_mm"] == pytest.approx(500 / 30)
    assert values["foot_slide_mps"] == pytest.approx(0.5)
    assert values["velocity_mps"] == pytest.approx(0.5)
    assert values["skate_rempe_pct"] == values["footskate_annotated_pct"] == 0
    assert values["e_foot_vxy_mm"] == pytest.approx(500 / 25)


def test_gaertner_s_counts_of_heels_and_toes() -> None:
    """2.4 cm a frame at his 25 frames a second, and a body 1 cm over the floor."""
    values = scores(still() + TIMES[:, None, None] * [0.6, 0.0, 0.0], on())
    assert values["footskate_points_pct"] == 100
    assert values["contact_f1"] == 0
    assert values["float_points_pct"] == values["float_annotated_pct"] == 0
    values = scores(still() + 0.025 * LIFT, on())
    assert values["footskate_points_pct"] == 0
    assert values["float_points_pct"] == values["float_annotated_pct"] == 100


def test_foot_points_that_lie_elsewhere_in_the_foot() -> None:
    """Those of the reference are 4 cm over the sole, those of the motion on it."""
    raised = still()
    raised[:, len(BODY_JOINTS) :, 2] += 0.04
    assert scores(still(), on(truth=raised))["penetration_rempe_pct"] == 100
    sole = dict.fromkeys(FOOT_POINTS, 0.0)
    own = track(TIMES, NAMES, still(), "motion", sole)
    values = plausibility(own, on(truth=raised)).values
    assert values["penetration_rempe_pct"] == values["body_penetration_mean_mm"] == 0
    assert values["contact_f1"] == 1


def test_what_rolls_touches_and_what_swings_past_does_not() -> None:
    flat = standing() @ np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]).T
    flat[:, 2] = 0.05
    lying = np.repeat(flat[None], len(TIMES), axis=0) + TIMES[:, None, None] * [1.0, 0.0, 0.0]
    clip = on(truth=lying)
    touches = dict(zip(clip.parts.names, clip.touching.T, strict=True))
    assert touches["trunk"].all()
    assert not touches["left_toe"].any()


def test_a_ballistic_body_asks_for_no_force() -> None:
    flight = np.clip(TIMES - 0.5, 0.0, 1.0)
    height = 4.905 * flight * (1.0 - flight)  # one second in the air between two of standing
    jump = still() + height[:, None, None] * [0.0, 0.0, 1.0]
    values = scores(jump, on(truth=jump))
    assert values["implied_grf_ballistic_pct"] == pytest.approx(0, abs=1e-6)
    assert values["implied_grf_max_pct"] > 200


def test_seat_and_floor_both_support() -> None:
    box = SceneItem("box", "box", (0.0, 0.0, 0.0), {"size_m": (4.0, 4.0, 0.4)})
    clip = on(Scene(items=(box,)), still() + LIFT)
    values = scores(still() + 0.95 * LIFT, clip)
    assert values["body_penetration_mean_mm"] == pytest.approx(20)
    assert values["f1_left_toe"] == 1


def test_unknown_joints_drop_only_what_they_touch() -> None:
    motion = still()
    motion[7, 3] = np.nan
    values = scores(motion, on())
    assert values["mpjpe_g_mm"] == pytest.approx(0, abs=1e-9)
    assert values["skate_wham_mm"] == pytest.approx(0, abs=1e-9)
    assert not {"w_mpjpe_mm", "body_penetration_mean_mm", "implied_grf_max_pct"} & set(values)


@pytest.mark.parametrize("clip", ["synth_jump", "opencap_STS"])
def test_references_are_plausible(shared_data: Path, clip: str) -> None:
    truth = read_truth(shared_data / "truth" / f"{clip}.npz")
    own = track(truth.times_s, truth.joint_names, truth.joints_m, "reference")
    values = plausibility(own, comparison(own, truth.times_s, Scene())).values
    assert values["implied_grf_mean_pct"] == pytest.approx(103, abs=4)
    assert values["implied_grf_max_pct"] < 350
    assert values["body_penetration_mean_mm"] < 2
    assert values["skate_wham_mm"] < 4
