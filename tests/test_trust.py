"""What a source is worth, and what the fit makes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon import plan as plans
from simrecon import trust
from simrecon.errors import InputError
from simrecon.types import Evidence


def seen(frame: str = "world", worth: str = "", joints: bool = True) -> Evidence:
    places = np.arange(12.0).reshape(2, 2, 3) / 10
    return Evidence(
        times_s=np.array([0.0, 0.1]),
        keypoint_names=(),
        keypoints_px=np.empty((2, 0, 2)),
        scores=np.empty((2, 0)),
        joint_names=("left_hip", "right_hip") if joints else (),
        joints_m=places if joints else np.empty((2, 0, 3)),
        joints_frame=frame,
        trust=worth,
    )


@pytest.mark.parametrize(
    ("evidence", "source"),
    [
        (seen(), "world"),
        (seen("camera"), "camera"),
        (seen("camera_root_relative"), "camera"),
        (seen(joints=False), "landmarks"),
        (seen(worth="mocap"), "mocap"),
    ],
)
def test_evidence_is_trusted_as_it_says_or_as_its_frame_deserves(evidence: Evidence, source: str) -> None:
    assert trust.of(evidence).source == source


def test_single_values_follow_the_source() -> None:
    worth = trust.parse("world, place_m=0.05, floor=scene, metric=true", "--trust")
    assert (worth.place_m, worth.floor, worth.metric) == (0.05, "scene", True)
    assert worth.size == trust.parse("world", "--trust").size


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("mocp", "--trust: found 'mocp', did you mean 'mocap'"),
        ("mocap,place=1", "--trust: found 'place', did you mean 'place_m'"),
        ("mocap,place_m=far", "place_m"),
        ("mocap,floor=wet", "floor"),
        ("mocap,purpose=none", "found 'purpose'"),
        ("", "found ''"),
    ],
)
def test_what_is_no_trust_is_refused(words: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        trust.parse(words, "--trust")


def test_errors_of_the_source_are_the_scales_of_the_fit() -> None:
    plan = plans.read("default").kinematics
    assert trust.weighed(plan, trust.parse("world", "")) == plan
    mocap = trust.weighed(plan, trust.parse("mocap,joints_m=0.005", ""))
    assert mocap.joint_scale_m == 0.005
    assert mocap.contact < 0.1 * plan.contact
    assert (mocap.joint, mocap.limit) == (plan.joint, plan.limit)


def test_a_file_keeps_what_its_source_is_worth(tmp_path: Path) -> None:
    path = tmp_path / "seen.npz"
    readers.write(path, seen(worth="mocap,place_m=0.1"))
    assert readers.read(path).trust == "mocap,place_m=0.1"
    with pytest.raises(InputError, match="trust: found 'nobody'"):
        readers.write(path, replace(seen(), trust="nobody"))
