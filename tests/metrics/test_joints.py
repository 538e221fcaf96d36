from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon import body as bodies_
from simrecon.metrics import bodies, joints, plausibility
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, read_truth
from simrecon.types import Array, Scene, SceneItem

NAMES = (*BODY_JOINTS, *FOOT_POINTS)
TIMES = np.arange(61) / 30
LIFT = np.array([0.0, 0.0, 0.4])


def standing(height_m: float = 0.0) -> Array:
    """(16, 3) the template in T-pose, heels and toes on the floor."""
    skeleton = bodies_.scaled({}, 1.7)
    places = bodies_.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m
    at = dict(zip(skeleton.point_names, places, strict=True))
    found = np.array([at[name] for name in NAMES])
    return found + np.array([0.0, 0.0, height_m - found[:, 2].min()])


def still() -> Array:
    return np.repeat(standing()[None], len(TIMES), axis=0)


def on(scene: Scene = Scene(), truth: Array | None = None) -> joints.Clip:  # noqa: B008
    track = joints.track(TIMES, NAMES, still() if truth is None else truth, "reference")
    return joints.clip(track, TIMES, scene)


def scores(motion: Array, clip: joints.Clip) -> dict[str, float]:
    track = joints.track(TIMES, NAMES, motion, "motion")
    return (joints.accuracy(track, clip) | plausibility.plausibility(track, clip)).values


def test_a_standing_body_is_perfect_against_itself() -> None:
    found = scores(still(), on())
    for name, value in found.items():
        if name.startswith(("implied_grf", "f1_", "contact_f1", "touch_f1", "pck", "foot_contact")):
            continue
        assert value == pytest.approx(0, abs=1e-9), name
    assert found["implied_grf_mean_pct"] == pytest.approx(100)
    assert found["implied_grf_max_pct"] == pytest.approx(100)
    assert found["contact_f1"] == found["f1_left_heel"] == found["touch_f1"] == found["touch_f1_least"] == 1
    assert found["pck_pct"] == 100
    assert "implied_grf_ballistic_pct" not in found  # nobody flies


def test_ten_millimetres_under_the_floor() -> None:
    found = scores(still() - [0.0, 0.0, 0.01], on())
    assert found["body_penetration_mean_mm"] == pytest.approx(10)
    assert found["body_penetration_max_mm"] == pytest.approx(10)
    assert found["body_penetration_pct"] == 100
    assert found["penetration_rempe_pct"] == 0
    assert found["mpjpe_g_mm"] == pytest.approx(10)


def test_a_slide_at_half_a_metre_a_second() -> None:
    found = scores(still() + TIMES[:, None, None] * [0.5, 0.0, 0.0], on())
    assert found["skate_wham_mm"] == pytest.approx(500 / 30)
    assert found["foot_slide_mps"] == pytest.approx(0.5)
    assert found["velocity_mps"] == pytest.approx(0.5)
    assert found["skate_rempe_pct"] == found["footskate_annotated_pct"] == 0
    assert found["e_foot_vxy_mm"] == pytest.approx(500 / 25)


def test_gaertner_s_counts_of_heels_and_toes() -> None:
    """2.4 cm a frame at his 25 frames a second, and a body 1 cm over the floor."""
    found = scores(still() + TIMES[:, None, None] * [0.6, 0.0, 0.0], on())
    assert found["footskate_points_pct"] == 100
    assert found["contact_f1"] == 0
    assert found["float_points_pct"] == found["float_annotated_pct"] == 0
    found = scores(still() + 0.025 * LIFT, on())
    assert found["footskate_points_pct"] == 0
    assert found["float_points_pct"] == found["float_annotated_pct"] == 100


def test_foot_points_that_lie_elsewhere_in_the_foot() -> None:
    """Those of the reference are 4 cm over the sole, those of the motion on it."""
    raised = still()
    raised[:, len(BODY_JOINTS) :, 2] += 0.04
    assert scores(still(), on(truth=raised))["penetration_rempe_pct"] == 100
    sole = dict.fromkeys(FOOT_POINTS, 0.0)
    track = joints.track(TIMES, NAMES, still(), "motion", sole)
    found = plausibility.plausibility(track, on(truth=raised)).values
    assert found["penetration_rempe_pct"] == found["body_penetration_mean_mm"] == 0
    assert found["contact_f1"] == 1


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
    found = scores(jump, on(truth=jump))
    assert found["implied_grf_ballistic_pct"] == pytest.approx(0, abs=1e-6)
    assert found["implied_grf_max_pct"] > 200


def test_seat_and_floor_both_support() -> None:
    box = SceneItem("box", "box", (0.0, 0.0, 0.0), {"size_m": (4.0, 4.0, 0.4)})
    clip = on(Scene(items=(box,)), still() + LIFT)
    found = scores(still() + 0.95 * LIFT, clip)
    assert found["body_penetration_mean_mm"] == pytest.approx(20)
    assert found["f1_left_toe"] == 1


def test_unknown_joints_drop_only_what_they_touch() -> None:
    motion = still()
    motion[7, 3] = np.nan
    found = scores(motion, on())
    assert found["mpjpe_g_mm"] == pytest.approx(0, abs=1e-9)
    assert found["skate_wham_mm"] == pytest.approx(0, abs=1e-9)
    assert not {"w_mpjpe_mm", "body_penetration_mean_mm", "implied_grf_max_pct"} & set(found)


def test_centre_of_mass_and_stature_of_the_template() -> None:
    """A standing person's centre of mass is at 55 to 57 % of stature (Winter 2009); arms are level here."""
    body = standing()
    assert bodies.stature_m(NAMES, body[None]) == pytest.approx(1.7, rel=0.04)
    com = bodies.centre_of_mass(NAMES, body)
    assert 0.54 < com[2] / 1.7 < 0.62
    assert com[1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("clip", ["synth_jump", "opencap_STS"])
def test_references_are_plausible(shared_data: Path, clip: str) -> None:
    truth = read_truth(shared_data / "truth" / f"{clip}.npz")
    track = joints.track(truth.times_s, truth.joint_names, truth.joints_m, "reference")
    found = plausibility.plausibility(track, joints.clip(track, truth.times_s, Scene())).values
    assert found["implied_grf_mean_pct"] == pytest.approx(103, abs=4)
    assert found["implied_grf_max_pct"] < 350
    assert found["body_penetration_mean_mm"] < 2
    assert found["skate_wham_mm"] < 4
