"""The recipe of docs/scenes.md for a trampoline: bed and ground, what `scene check` says, and the fit."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, evidence, kinematics, plan, results
from simrecon import scene as scenes
from simrecon.types import Array, Evidence, Scene
from tests.support import runs
from tools import CHECKOUT

FRAMES, FPS = 46, 30.0
APEX_M, STIFFNESS_NPM, GRAVITY = 0.3, 5000.0, 9.81


def bouncing() -> Array:
    """Heights (T,) over the bed of a mass that falls on a spring from its apex, and is thrown back."""
    natural = np.sqrt(STIFFNESS_NPM / runs.MASS_KG)
    fall_s = np.sqrt(2 * APEX_M / GRAVITY)
    sag, speed = GRAVITY / natural**2, GRAVITY * fall_s
    sink, phase = np.hypot(speed / natural, sag), np.arctan2(speed / natural, sag)
    pressed_s = 2 * (np.pi - phase) / natural
    since = np.mod(np.arange(FRAMES) / FPS, 2 * fall_s + pressed_s)
    after, late = since - fall_s, since - fall_s - pressed_s
    pressed = -sag + sink * np.cos(natural * after + phase)
    rising = speed * late - GRAVITY * late**2 / 2
    return np.where(since < fall_s, APEX_M - GRAVITY * since**2 / 2, np.where(late < 0, pressed, rising))


def jump() -> Evidence:
    """Motion capture of a person who bounces; its zero is the bed at rest."""
    body = runs.person()
    qpos = runs.squat(body, np.full(FRAMES, 0.15))
    qpos[:, 2] += bouncing()
    joints = kinematics.configurations(body, qpos)[1]
    return evidence.from_arrays(
        np.arange(FRAMES) / FPS,
        joint_names=body.skeleton.point_names,
        joints_m=joints,
        height_m=runs.HEIGHT_M,
        mass_kg=runs.MASS_KG,
        trust="mocap",
    )


def recipe() -> Scene:
    """The scene as the page has it."""
    page = (CHECKOUT / "docs" / "scenes.md").read_text(encoding="utf-8")
    block = re.search(r"(?ms)^    # jump\.toml.*?(?=^\S)", page)
    assert block is not None
    return scenes.parse(block[0].replace("\n    ", "\n")[4:])


def test_the_fit_follows_a_person_into_the_bed() -> None:
    seen = jump()
    fit = kinematics.fit(seen, recipe(), plan.read("quick").kinematics, None)
    points = kinematics.configurations(fit.body, fit.qpos)[1]
    off = np.linalg.norm(points - seen.joints_m, axis=-1)
    assert off.mean() < 0.01
    assert points[..., 2].min() < -0.35


def test_only_a_trampoline_gives_way_and_only_as_far_as_its_bed_goes() -> None:
    scene = recipe()
    places = np.array([[0.0, 0.0, z] for z in (0.2, -0.3, -1.0)])
    solid, pressed = (scenes.distances(scene, places, pressed=asked)[0][1] for asked in (False, True))
    np.testing.assert_allclose(solid, [0.2, -0.3, -1.0], atol=1e-9)
    np.testing.assert_allclose(pressed, [0.2, 0.0, 0.0], atol=1e-9)
    low = '[[item]]\nname = "a"\nkind = "trampoline"\nposition_m = [0, 0, 0]\nheight_m = 0.5\n'
    deep = scenes.distances(scenes.parse(low), np.array([[0.0, 0.0, 0.01]]), pressed=True)[0][1]
    assert deep[0] == pytest.approx(-0.49 + 0.95 * 0.5)
    box = scenes.parse('[[item]]\nname = "a"\nkind = "box"\nposition_m = [0, 0, -1]\nsize_m = [1, 1, 1]\n')
    assert scenes.distances(box, places, pressed=True)[0][1][1] == pytest.approx(-0.3)


def test_scene_check_says_when_the_bed_is_pressed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    evidence.write(tmp_path / "jump.npz", jump())
    (tmp_path / "jump.toml").write_text(scenes.dumps(recipe()))
    assert cli.main(["scene", "check", str(tmp_path / "jump.toml"), str(tmp_path / "jump.npz")]) == 0
    shown = capsys.readouterr().out
    found = shown[shown.index("kinematic motion") :]
    assert "more than 5 mm deep in 1 of 2 (the ground and 1 item)" in found
    assert re.search(r"(?m)^trampoline +\d+ mm at \d\.\d+ s \((left|right)_foot\); 0\.27-0\.70 s", found)
    assert "\nground" not in found
    deepest = re.search(r"(?m)^trampoline +(\d+) mm", found)
    assert deepest is not None
    assert int(deepest[1]) == pytest.approx(-1e3 * bouncing().min(), abs=40)


@pytest.mark.slow
def test_the_bed_throws_the_person_up_again(tmp_path: Path) -> None:
    evidence.write(tmp_path / "jump.npz", jump())
    (tmp_path / "jump.toml").write_text(scenes.dumps(recipe()))
    words = ["--scene", str(tmp_path / "jump.toml"), "--plan", "quick", "--threads", "1"]
    assert cli.main(["run", str(tmp_path / "jump.npz"), "-o", str(tmp_path / "out"), *words]) == 0
    motion = results.read_motion(tmp_path / "out")
    height = motion.joints_m[:, motion.joint_names.index("pelvis"), 2]
    lowest = int(np.argmin(height[:30]))
    assert height[0] - height[lowest] > 0.5
    assert height[lowest:].max() - height[lowest] > 0.4
