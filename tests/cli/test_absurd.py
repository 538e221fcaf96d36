"""Inputs that no reader refuses and nobody means: every stage ends, soon, and the motion is kept."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, evidence, kinematics, results
from tests.support import runs

FRAMES = 20


@pytest.fixture(scope="module")
def far(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Motion capture of a person who goes ten kilometres in two thirds of a second."""
    body = runs.person()
    qpos = runs.squat(body, np.full(FRAMES, 0.15))
    qpos[:, 0] += np.linspace(0.0, 1e4, FRAMES)
    joints = kinematics.configurations(body, qpos)[1]
    folder = tmp_path_factory.mktemp("far")
    made = evidence.from_arrays(
        np.arange(FRAMES) / 30,
        joint_names=body.skeleton.point_names,
        joints_m=joints,
        trust="mocap",
        height_m=runs.HEIGHT_M,
        mass_kg=runs.MASS_KG,
    )
    evidence.write(folder / "far.npz", made)
    return folder


def test_a_path_of_ten_kilometres_ends_with_a_motion_and_a_picture(far: Path) -> None:
    tracemalloc.start()
    words = ["run", str(far / "far.npz"), "-o", str(far / "out"), "--plan", "quick", "--threads", "1"]
    status = cli.main(words)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert status in (0, 3)
    assert most < 300e6
    assert len(results.read_motion(far / "out").times_s) == FRAMES
    said = json.loads((far / "out" / "report.json").read_text(encoding="utf-8"))
    assert said["overlay"] is None
    assert said["verdict"]["verdict"] == "bad"
    assert "speed of the hips: found" in said["input"]["reading"]


def test_scenes_and_pictures_of_it_end_too(far: Path) -> None:
    if not (far / "out").is_dir():
        pytest.skip("the run before did not end")
    assert cli.main(["scene", "suggest", str(far / "far.npz"), "-o", str(far / "room.toml")]) == 0
    assert (
        cli.main(["scene", "show", str(far / "room.toml"), str(far / "far.npz"), "-o", str(far / "a.png")])
        == 0
    )
    assert cli.main(["picture", str(far / "out"), "-o", str(far / "b.png"), "--at", "0.3", "lowest"]) == 0
