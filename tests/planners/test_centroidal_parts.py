"""What the planner `centroidal` plans for: angles, phases, points; nothing here needs its solver."""

from __future__ import annotations

import builtins
from dataclasses import replace
from itertools import product
from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon import plan, planners
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.planners.centroidal import euler, unseen
from simrecon.planners.centroidal.inputs import Inputs, inputs
from simrecon.planners.centroidal.phases import moved, phases
from simrecon.planners.centroidal.resting import Costs, evidence, resting
from simrecon.planners.centroidal.settings import settings
from simrecon.types import Array, Evidence, Ground, KinematicFit, Scene, SceneItem
from tests.support import rigid

TIMES = np.linspace(0.0, 2.0, 41)


@pytest.mark.parametrize("axis", [0, 1, 2], ids=["cartwheel", "flip", "pirouette"])
def test_angles_are_continuous_and_safe_whatever_turns(axis: int) -> None:
    spin = 2 * np.pi * TIMES[:, None] * np.eye(3)[axis]
    facing = np.array([0.1, -0.2, 1.0])
    matrices = rotations.matrix(rotations.multiply(rotations.exp(facing), rotations.exp(spin)))
    angles, axes = euler.angles(matrices)
    np.testing.assert_allclose(euler.matrix(angles, axes), matrices, atol=1e-12)
    assert np.abs(np.diff(angles, axis=0)).max() < 1.0
    assert np.cos(angles[:, 1]).min() > 0.5


def test_phases_alternate_and_fill_the_clip() -> None:
    contact = np.array([1] * 10 + [0] * 1 + [1] * 9 + [0] * 15 + [1] * 6, bool)
    found = phases(contact, TIMES, 0.07)
    assert [phase.contact for phase in found] == [True, False, True]  # one frame of flight is noise
    assert found[0].start_s == 0.0
    assert found[0].end_s == found[1].start_s == pytest.approx(0.975)
    assert found[-1].end_s == 2.0
    assert len(phases(contact, TIMES, 0.0)) == 5
    later = moved(found, np.array([1.0, 1.6]))
    assert [phase.end_s for phase in later] == [1.0, 1.6, 2.0]


def made(fit: KinematicFit) -> Inputs:
    return inputs(fit, settings())


def test_inertia_and_centre_are_those_of_the_body() -> None:
    fit = rigid.jump()
    found = made(fit)
    model = mujoco.MjModel.from_xml_string(fit.body.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = fit.qpos[0]
    mujoco.mj_forward(model, data)
    expected = np.zeros((3, 3))
    for body in range(1, model.nbody):
        axes, arm = data.ximat[body].reshape(3, 3), data.xipos[body] - data.subtree_com[1]
        expected += axes @ np.diag(model.body_inertia[body]) @ axes.T
        expected += model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    np.testing.assert_allclose(found.inertia[0], expected, atol=1e-4)
    np.testing.assert_allclose(found.com_m, fit.com_m, atol=1e-5)
    assert found.mass_kg == pytest.approx(rigid.MASS_KG)


def test_limbs_that_move_have_the_rest_of_the_angular_momentum() -> None:
    """MuJoCo's, of who turns and swings an arm, less that of a rigid body that turns with the root."""
    fit = rigid.jump()
    times, arm = fit.times_s, fit.body.skeleton.names.index("left_shoulder")
    qpos = fit.qpos.copy()
    qpos[:, 3:7] = rotations.exp(0.8 * times[:, None] * np.array([0.1, 0.2, 1.0]))
    swing = rotations.exp(np.sin(4 * times)[:, None] * np.array([1.0, 0.0, 1.0]))
    place = slice(3 + 4 * arm, 7 + 4 * arm)
    qpos[:, place] = rotations.multiply(qpos[:, place], swing)
    found = made(replace(fit, qpos=qpos))
    model = mujoco.MjModel.from_xml_string(fit.body.mjcf)
    data, frame = mujoco.MjData(model), 20
    velocity = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, velocity, 2 * rigid.FRAME_S, qpos[frame - 1], qpos[frame + 1])
    data.qpos[:], data.qvel[:] = qpos[frame], velocity
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    spin = velocity[3:6]  # on the axes of the root
    held = data.xmat[1].reshape(3, 3)
    own = held @ (found.inertia[frame] @ spin + found.swing[frame])
    np.testing.assert_allclose(own, data.subtree_angmom[1], atol=0.1)
    assert np.linalg.norm(found.swing[frame]) > 0.3


def test_feet_have_four_points_in_two_pairs_that_legs_reach() -> None:
    found = made(rigid.jump())
    assert [target.point.name for target in found.targets] == list(rigid.FEET)
    assert found.pairs == ((0, 1), (2, 3))
    for target in found.targets:
        hip = found.com_m + target.anchor_m  # the root does not turn
        assert (np.linalg.norm(target.place_m - hip, axis=1) < target.point.reach_m).all()
        assert [phase.contact for phase in target.touching.phases] == [True, False, True]
        np.testing.assert_allclose(target.place_m[0, 2], 0.0, atol=1e-3)


def test_labels_that_contradict_the_floor_are_dropped_and_said() -> None:
    high = rigid.fit(np.tile([0.0, 0.0, 0.25], (30, 1)), np.ones(30))
    found = made(high)
    assert all(not phase.contact for target in found.targets for phase in target.touching.phases)
    assert len(found.notes) == len(rigid.FEET) + 1
    assert "left toe: labelled as in contact at 0.00 to 0.97 s, but up to 25 cm" in found.notes[0]
    assert not made(rigid.jump()).notes


def test_a_clip_without_contact_is_said() -> None:
    flies = made(rigid.fit(np.tile([0.0, 0.0, 2.0], (19, 1)), np.zeros(19)))
    assert flies.notes == ("nothing is in contact in the whole clip; planned as one flight, a parabola",)


def test_who_hangs_in_the_air_for_a_while_is_said() -> None:
    """Something that nobody told the scene of carries the person."""
    rise = np.interp(np.arange(40), [10, 16], [0.0, 0.5])
    found = made(rigid.fit(np.column_stack((np.zeros((40, 2)), rise)), np.where(rise < 0.01, 1.0, 0.0)))
    assert "the person does not fall at" in found.notes[-1]
    assert "to 1.30 s, but nothing rests within 6 cm to carry it" in found.notes[-1]


def test_hands_that_touch_are_points_too() -> None:
    fit = rigid.jump()
    assert fit.contacts is not None
    probability = fit.contacts.probability.copy()
    probability[:5, fit.contacts.parts.index("left_hand")] = 1.0
    found = made(replace(fit, contacts=replace(fit.contacts, probability=probability)))
    hand = found.targets[-1]
    assert hand.point.name == "left_hand"
    assert hand.point.anchor == fit.body.skeleton.names.index("left_shoulder")
    assert "left hand" in found.notes[0]  # it is a metre above the floor


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ground": Ground(stiffness_Npm=2e4, damping_Nspm=500.0)}, "floor is compliant"),
        ({"frames": 4}, "found 4 frames; valid: 6 or more"),
    ],
)
def test_what_it_cannot_plan_is_refused_in_a_line(change: dict[str, Any], words: str) -> None:
    fit = rigid.jump()
    if "ground" in change:
        fit = replace(fit, scene=Scene(ground=change["ground"]))
    else:
        fit = rigid.fit(np.zeros((change["frames"], 3)), np.ones(change["frames"]))
    with pytest.raises(InputError, match=words) as caught:
        planned(fit)
    assert "\n" not in str(caught.value)


def test_without_the_extra_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name == "casadi":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setitem(__import__("sys").modules, "casadi", None)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"planner centroidal needs casadi: .*\[centroidal\]"):
        planned(rigid.jump())


def test_a_foot_that_is_never_seen_is_said() -> None:
    times = np.arange(3) / 30
    known = ("left_ankle", "right_ankle", "nose")
    scores = np.array([[0.9, 0.0, 0.9]] * 3)
    seen = replace(nothing_seen(times), keypoint_names=known, keypoints_px=np.zeros((3, 3, 2)), scores=scores)
    assert unseen.feet(seen) == ("the right foot is never seen; its contacts are guessed from the pose",)
    assert unseen.feet(replace(seen, scores=np.full((3, 3), 0.9))) == ()
    joints = replace(seen, joint_names=("right_heel",), joints_m=np.zeros((3, 1, 3)))
    assert unseen.feet(joints) == ()
    assert unseen.feet(nothing_seen(times)) == ()  # a motion on another body
    blind = replace(seen, scores=np.zeros_like(scores))
    assert len(unseen.feet(blind)) == 2


def test_who_does_not_fall_is_carried_by_what_is_lowest() -> None:
    hover = rigid.fit(np.tile([0.0, 0.0, 0.03], (30, 1)), np.zeros(30))
    found = made(hover)
    assert all(phase.contact for target in found.targets for phase in target.touching.phases)
    assert (
        "too little is labelled as in contact to carry the person in 30 frames at 0.00 to 0.97 s"
        in found.notes[0]
    )
    high = made(rigid.fit(np.tile([0.0, 0.0, 0.3], (30, 1)), np.zeros(30)))
    assert not any(phase.contact for target in high.targets for phase in target.touching.phases)


def test_who_lands_on_feet_that_still_slide_is_carried_by_one_of_them() -> None:
    """Labels know nothing until the feet have slid to where they stay, and no label outweighs the slide."""
    times = rigid.FRAME_S * np.arange(40)
    fall = np.maximum(0.25 - 4.905 * times**2, 0.0)  # until 0.226 s
    slide = np.interp(times, [0.22, 0.38], [0.0, 0.4])
    found = made(rigid.fit(np.column_stack((slide, 0 * times, fall)), np.where(times > 0.38, 1.0, 0.0)))
    lands = sorted(
        next(phase.start_s for phase in target.touching.phases if phase.contact) for target in found.targets
    )
    assert lands[0] == pytest.approx(0.22, abs=1.5 * rigid.FRAME_S)
    assert lands[1] > 0.3  # the others where their labels have them


def test_a_sole_beside_a_beam_stands_on_its_top() -> None:
    """The middle of the sole hangs over the edge: nearest to it is the edge, whose normal is oblique."""
    beam = SceneItem("beam", "box", (0.0, 0.13, 0.0), {"size_m": (4.0, 0.02, 0.06)})
    fit = rigid.fit(
        np.tile([0.0, 0.0, 0.06], (20, 1)), np.array([[1, 1, 0, 0]] * 20), scene=Scene(items=(beam,))
    )
    plane = made(fit).targets[0].touching.planes[0]
    np.testing.assert_allclose(plane.normal, [0.0, 0.0, 1.0], atol=1e-9)
    assert plane.height_m == pytest.approx(0.06, abs=1e-6)


def planned(fit: KinematicFit) -> Any:
    return planners.plan("centroidal", fit, nothing_seen(fit.times_s), plan.read("quick"))


def nothing_seen(times_s: Array) -> Evidence:
    """Evidence of a person of whom only the fit is known."""
    count = len(times_s)
    return Evidence(
        times_s=times_s, keypoint_names=(), keypoints_px=np.zeros((count, 0, 2)), scores=np.zeros((count, 0)),
        joint_names=(), joints_m=np.zeros((count, 0, 3)), joints_frame="world",
    )  # fmt: skip


def test_a_contact_is_cut_where_its_point_moves() -> None:
    """The label lasts through a step; the point rests before and after it."""
    costs, step = Costs(0.05, 3.0, 3), np.zeros((30, 3))
    step[12:18, 0] = np.linspace(0.05, 0.4, 6)
    step[18:, 0] = 0.45
    sure = evidence(np.full(30, 0.9), 0.2)
    found, _ = resting(sure, step, costs)
    assert found[:11].all()
    assert found[19:].all()
    assert not found[13:17].any()
    assert resting(sure, np.zeros((30, 3)), costs)[0].all()
    assert not resting(-sure, np.zeros((30, 3)), costs)[0].any()
    blink = sure.copy()
    blink[10] = -3.0
    assert resting(blink, np.zeros((30, 3)), costs)[0].all()  # a frame is noise


def test_the_best_cut_is_found() -> None:
    """Against all ways to cut eight frames."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        labels, places, costs = (
            rng.normal(0.0, 2.0, 8),
            0.05 * rng.standard_normal((8, 3)),
            Costs(0.05, 1.0, 1),
        )
        ways = [np.array(way, bool) for way in product([False, True], repeat=8)]
        best = min(ways, key=lambda way: price(way, labels, places, costs))
        found, cost = resting(labels, places, costs)
        assert price(found, labels, places, costs) == pytest.approx(price(best, labels, places, costs))
        assert cost == pytest.approx(price(best, labels, places, costs))


def price(flags: np.ndarray, labels: Array, places: Array, costs: Costs) -> float:
    total = costs.cut * float(np.sum(flags[1:] != flags[:-1]))
    for frames in np.split(np.arange(len(flags)), np.flatnonzero(flags[1:] != flags[:-1]) + 1):
        if flags[frames[0]]:
            own = places[frames]
            total += float(np.sum((own - own.mean(axis=0)) ** 2)) / costs.spread_m**2 - labels[frames].sum()
    return total


def test_who_lands_harder_than_a_toe_bears_has_a_heel_too() -> None:
    """Labels know one toe alone."""
    times = rigid.FRAME_S * np.arange(31)
    fall = rigid.fit(
        np.column_stack((np.zeros((31, 2)), 0.02 + 0.02 * np.cos(14.0 * times))),
        np.array([[1, 0, 0, 0]] * 31),
    )
    found = made(fall)
    assert "too little is labelled as in contact" in found.notes[0]
    assert any(phase.contact for phase in found.targets[1].touching.phases)
    touching = [any(phase.contact for phase in target.touching.phases) for target in found.targets]
    assert sum(touching) == 2  # no more than it takes
    still = made(rigid.fit(np.zeros((31, 3)), np.array([[1, 0, 0, 0]] * 31)))
    assert not still.notes
