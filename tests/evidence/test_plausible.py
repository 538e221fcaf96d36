"""What no person does is refused or said, whatever file it stands in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import scene
from simrecon.errors import InputError
from simrecon.evidence import plausible
from simrecon.job import Job, inputs
from simrecon.types import Evidence, Scene
from tools import CHECKOUT

T = 60


def person(tall_m: float = 1.7, worth: str = "mocap", rate_hz: float = 30.0) -> Evidence:
    """The template who stands still."""
    skeleton = bodies.rescaled(bodies.template(), tall_m / bodies.stature_m(bodies.template()))
    places = bodies.t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m
    heel = skeleton.point_names.index("left_heel")
    places[:, 2] -= places[heel, 2]
    return Evidence(
        times_s=np.arange(T) / rate_hz,
        keypoint_names=(),
        keypoints_px=np.empty((T, 0, 2)),
        scores=np.empty((T, 0)),
        joint_names=skeleton.point_names,
        joints_m=np.repeat(places[None], T, axis=0),
        joints_frame="world",
        trust=worth,
        reading="made",
    )


def said(evidence: Evidence, *, unit_given: bool = False) -> list[str]:
    return plausible.checked(evidence, "clip.bvh", unit_given=unit_given).reading.splitlines()[1:]


def moved(evidence: Evidence, shift: np.ndarray) -> Evidence:
    return replace(evidence, joints_m=evidence.joints_m + shift[:, None])


@pytest.mark.parametrize("tall_m", [0.5, 1.1, 1.7, 2.5])
def test_people_of_all_sizes_pass_without_a_word(tall_m: float) -> None:
    assert said(person(tall_m)) == []


@pytest.mark.parametrize("tall_m", [0.069, 0.3, 2.9, 12.0])
def test_an_impossible_stature_is_refused_unless_the_user_says_the_unit(tall_m: float) -> None:
    line = f"stature: found {tall_m:.3g} m; valid: 0.4 to 2.6 m"
    with pytest.raises(InputError, match=f"^clip.bvh: {line}; --unit"):
        said(person(tall_m))
    if 0.1 < tall_m < 10.0:
        assert line in said(person(tall_m), unit_given=True)
    else:
        with pytest.raises(InputError, match=r"valid: 0\.1 to 10 m, or another --unit"):
            said(person(tall_m), unit_given=True)
    assert said(person(tall_m, worth="world"))[0] == line  # an estimate that isn't metric may be of any size


def test_a_jump_in_the_file_is_said() -> None:
    shift = np.zeros((T, 3))
    shift[40:, 0] = 0.9
    (line,) = said(moved(person(), shift))
    assert line.startswith(
        "speed of the hips: found 27 m/s at 1.30 s, too fast in 1 of 59 frames; valid: up to 15"
    )


def test_what_shakes_is_said_and_a_fall_is_not() -> None:
    times = np.arange(T) / 30
    shaken, falling = np.zeros((T, 3)), np.zeros((T, 3))
    shaken[30, 1] = 0.45
    falling[:, 2] = np.maximum(2.0 - 9.81 / 2 * times**2, 0.0)
    (line,) = said(moved(person(), shaken))
    assert line.startswith("acceleration of the hips: found 90 m/s²")
    assert said(moved(person(), falling)) == []


@pytest.mark.parametrize(("rate_hz", "fine"), [(8.0, False), (25.0, True), (240.0, True), (1500.0, False)])
def test_odd_frame_rates_are_said(rate_hz: float, fine: bool) -> None:
    lines = said(person(rate_hz=rate_hz))
    assert [line.split(":")[0] for line in lines] == ([] if fine else ["frame rate"])


def test_feet_far_from_the_floor_are_said_of_motion_capture() -> None:
    for height, lowest in ((0.3, "0.30"), (-1.0, "-1.00")):
        up = np.tile([0.0, 0.0, height], (T, 1))
        (line,) = said(moved(person(), up))
        assert line.startswith(f"floor: found the lowest of the feet at {lowest} m; valid: -0.1 to 0.25 m")
        assert said(moved(person(worth="world"), up)) == []


def test_unknown_names_are_left_to_those_who_check_them() -> None:
    odd = person()
    odd = replace(odd, joint_names=("left_kneee", *odd.joint_names[1:]))
    assert said(odd) == []


def test_who_stands_on_something_of_the_scene_is_not_asked_for_one() -> None:
    case = CHECKOUT / "tests" / "data" / "cases" / "bvh_stands_on_platform.bvh"
    platform = scene.read(case.with_name("platform.toml"))
    bare, seen = (inputs.observe(Job(str(case), "", scene=place)) for place in (Scene(), platform))
    assert "a scene with what they stand on" in bare.reading
    assert "floor: found" not in seen.reading
    assert seen.reading.startswith("BVH: ")
