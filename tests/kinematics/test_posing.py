"""Poses of a known body: found again from joints, with nothing of the body moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import kinematics
from simrecon import plan as plans
from simrecon.errors import InputError
from simrecon.evidence import from_arrays
from simrecon.synthesis.features import POINTS
from simrecon.types import Ground, Scene
from tests.support.runs import person, squat

PLAN = plans.read("quick").kinematics
TRUST = "mocap,floor=scene"


def test_a_squat_is_found_again_from_its_joints() -> None:
    body = person()
    qpos = squat(body, np.linspace(0.0, 0.5, 12))
    marks, names = kinematics.configurations(body, qpos)[1], body.skeleton.point_names
    rows = [names.index(name) for name in POINTS]
    seen = from_arrays(np.arange(12) / 30, joint_names=POINTS, joints_m=marks[:, rows], trust=TRUST)
    fit = kinematics.pose(seen, body, Scene(), PLAN)
    assert fit.body is body
    own = kinematics.configurations(body, fit.qpos)[1][:, rows]
    assert np.linalg.norm(own - marks[:, rows], axis=-1).max() < 0.005
    assert fit.contacts is not None


def test_the_floor_of_the_scene_holds() -> None:
    body = person()
    qpos = squat(body, np.zeros(12))
    names = body.skeleton.point_names
    marks = kinematics.configurations(body, qpos)[1] - [0.0, 0.0, 0.04]  # sunk in
    trust = "mocap,assume=1,joints_m=0.03,place_m=0.05,floor=scene"
    seen = from_arrays(np.arange(12) / 30, joint_names=names, joints_m=marks, trust=trust)
    scene = Scene(ground=Ground(height_m=0.0))
    own = kinematics.configurations(body, kinematics.pose(seen, body, scene, PLAN).qpos)[1]
    assert own[..., 2].min() > -0.02


def test_joints_without_any_known_are_refused() -> None:
    body = person()
    joints = np.zeros((3, 1, 3))
    seen = from_arrays(np.arange(3) / 30, joint_names=("pelvis",), joints_m=joints, trust=TRUST)
    seen = replace(seen, joints_m=np.full_like(joints, np.nan))
    with pytest.raises(InputError, match="names no point of the body that is ever seen"):
        kinematics.pose(seen, body, Scene(), PLAN)
