"""MediaPipe's landmarks in JSON, however they were written, and easy_ViTPose's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.camera import fov
from simrecon.evidence.keypoints import layouts
from simrecon.types import Evidence
from tests.support import foreign_files as foreign
from tests.support import people

T = 20
NAMES = layouts.layout("blazepose_33")
LENS = fov.pinhole(800.0, (640, 480))
ASKED = Options(fps=30.0, camera=LENS)
POINTS = people.landmarks(NAMES, T)
BODY = people.named(people.walking(T), NAMES)
WORLD = (BODY - BODY[:, 23:25].mean(axis=1, keepdims=True)) @ np.array(
    [[0, -1.0, 0], [0, 0, -1], [1, 0, 0]]
).T


def entry(x: np.ndarray, kind: str = "tasks") -> Any:
    if kind == "list":
        return [*x[:3].tolist(), 0.8]
    one = {"x": x[0], "y": x[1], "z": x[2], "visibility": 0.8}
    return one | ({"presence": 0.5, "name": ""} if kind == "tasks" else {})


def rows(values: np.ndarray, kind: str) -> list[Any]:
    return [entry(x, kind) for x in values]


def frame(t: int, kind: str, shift: float = 0.0) -> Any:
    image = np.concatenate((POINTS[t] / [640, 480], np.full((33, 1), -0.1)), axis=1) + np.array(
        [shift, 0.0, 0.0]
    )
    image_, world = rows(image, kind), rows(WORLD[t], kind)
    return {
        "tasks": {"pose_landmarks": [image_], "pose_world_landmarks": [world], "segmentation_masks": None},
        "javascript": {"landmarks": [image_], "worldLandmarks": [world], "timestampMs": 40.0 * t},
        "solutions": {"poseLandmarks": {"landmark": image_}, "poseWorldLandmarks": {"landmark": world}},
        "one person": {"frame": t, "pose_landmarks": image_, "pose_world_landmarks": world},
        "list": {"pose_landmarks": image_, "pose_world_landmarks": world},
    }[kind]


def check(found: Evidence, scores: float) -> None:
    assert found.keypoint_names == found.joint_names == NAMES
    np.testing.assert_allclose(found.keypoints_px, POINTS, atol=1e-6)
    np.testing.assert_allclose(found.joints_m, WORLD, atol=1e-9)
    np.testing.assert_allclose(found.scores, scores)
    assert found.joints_frame == "camera_root_relative"
    assert found.reading.startswith("MediaPipe: ")


@pytest.mark.parametrize("kind", ["tasks", "javascript", "solutions", "one person", "list"])
@pytest.mark.parametrize("wrapping", ["list", "frames", "numbers"])
def test_results_of_every_spelling(tmp_path: Path, kind: str, wrapping: str) -> None:
    frames = [frame(t, kind) for t in range(T)]
    tree: Any = {
        "list": frames,
        "frames": {"fps": 30, "frames": frames},
        "numbers": {f"frame_{t}": one for t, one in enumerate(frames)},
    }[wrapping]
    found = evidence.read(foreign.save_json(tmp_path / "pose.json", tree), ASKED)
    check(found, 0.4 if kind == "tasks" else 0.8)
    np.testing.assert_allclose(found.times_s, np.arange(T) / 30.0)


def test_a_result_on_each_line(tmp_path: Path) -> None:
    path = tmp_path / "pose.jsonl"
    path.write_text("\n".join(json.dumps(frame(t, "solutions")) for t in range(T)) + "\n\n")
    check(evidence.read(path, ASKED), 0.8)
    path.write_text(path.read_text() + '{"poseLandmarks": ')
    with pytest.raises(InputError, match="damaged JSON"):
        evidence.read(path, ASKED)


def test_lists_over_frames_and_bare_landmarks(tmp_path: Path) -> None:
    frames = [frame(t, "one person") for t in range(T)]
    keys = ("pose_landmarks", "pose_world_landmarks")
    columns = {key: [one[key] for one in frames] for key in keys}
    check(evidence.read(foreign.save_json(tmp_path / "a.json", columns), ASKED), 0.8)
    bare = evidence.read(foreign.save_json(tmp_path / "b.json", [one[keys[0]] for one in frames]), ASKED)
    np.testing.assert_allclose(bare.keypoints_px, POINTS, atol=1e-6)
    assert bare.joint_names == ()


@pytest.mark.parametrize("nothing", [None, {}, {"pose_landmarks": []}, {"pose_landmarks": None}, []])
def test_frames_of_nobody_keep_their_number(tmp_path: Path, nothing: Any) -> None:
    frames = [frame(t, "list") for t in range(T)]
    frames[0] = frames[4] = nothing
    found = evidence.read(foreign.save_json(tmp_path / "pose.json", frames), ASKED)
    kept = [t for t in range(T) if t not in (0, 4)]
    np.testing.assert_allclose(found.times_s, np.array(kept) / 30.0)
    np.testing.assert_allclose(found.keypoints_px, POINTS[kept], atol=1e-6)


def test_times_of_the_file_are_used_unless_the_user_knows_better(tmp_path: Path) -> None:
    path = foreign.save_json(tmp_path / "pose.json", [frame(t, "javascript") for t in range(T)])
    found = evidence.read(path, Options(camera=LENS))
    np.testing.assert_allclose(found.times_s, 0.04 * np.arange(T))
    assert "times as in the file" in found.reading


def test_world_landmarks_alone_need_no_lens(tmp_path: Path) -> None:
    frames = [{"pose_world_landmarks": frame(t, "list")["pose_world_landmarks"]} for t in range(T)]
    found = evidence.read(foreign.save_json(tmp_path / "pose.json", frames), Options(fps=30.0))
    assert found.keypoint_names == ()
    np.testing.assert_allclose(found.joints_m, WORLD, atol=1e-9)
    assert found.joints_frame == "camera_root_relative"


def test_several_people_are_followed(tmp_path: Path) -> None:
    frames = []
    for t in range(T):
        pair = [frame(t, "tasks"), frame(t, "tasks", shift=0.25)]
        if t % 2:
            pair.reverse()
        frames.append(
            {key: [one[key][0] for one in pair] for key in ("pose_landmarks", "pose_world_landmarks")}
        )
    path = foreign.save_json(tmp_path / "pose.json", frames)
    with pytest.raises(InputError, match="people: found 2"):
        evidence.read(path, ASKED)
    second = evidence.read(path, Options(fps=30.0, camera=LENS, person="1"))
    np.testing.assert_allclose(second.keypoints_px, POINTS + np.array([160.0, 0.0]), atol=1e-6)
    np.testing.assert_allclose(second.joints_m, WORLD, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f[3]["pose_landmarks"].pop(), "frame 3: found 32 landmarks; valid: 33"),
        (
            lambda f: f[3]["pose_landmarks"][2].update(x="left"),
            "frame 3: found landmarks that are no numbers",
        ),
        (
            lambda f: f[3].update(pose_landmarks=[f[3]["pose_landmarks"]] * 2),
            "2 people in the image and 1 in space",
        ),
    ],
)
def test_damage_is_named(tmp_path: Path, change: Any, words: str) -> None:
    frames = [frame(t, "one person") for t in range(T)]
    change(frames)
    with pytest.raises(InputError, match=words) as raised:
        evidence.read(foreign.save_json(tmp_path / "pose.json", frames), ASKED)
    assert "\n" not in str(raised.value)


# --- easy_ViTPose

COCO = layouts.layout("coco_17")


def vitpose(folder: Path, names: tuple[str, ...] = COCO, order: tuple[int, int] = (1, 0)) -> Path:
    points = people.landmarks(layouts.layout("coco_17"), T)
    frames = [
        {
            str(k): [[*(row + np.array([150.0 * k, 0.0]))[list(order)], 0.9] for row in points[t]]
            for k in range(2)
            if (t, k) != (4, 1)
        }
        for t in range(T)
    ]
    tree = {"keypoints": frames, "skeleton": {str(i): name for i, name in enumerate(names)}}
    return foreign.save_json(folder / "clip_result.json", tree)


@pytest.mark.parametrize(("order", "words"), [((1, 0), "y before x"), ((0, 1), "x before y, by which")])
def test_easy_vitpose_writes_y_before_x(tmp_path: Path, order: tuple[int, int], words: str) -> None:
    path = vitpose(tmp_path, order=order)
    with pytest.raises(InputError, match=r"people: found 2: 0 \(20 frames\), 1 \(19 frames\)"):
        evidence.read(path, ASKED)
    found = evidence.read(path, Options(fps=30.0, camera=LENS, person="0"))
    np.testing.assert_allclose(found.keypoints_px, people.landmarks(COCO, T))
    assert found.reading.startswith("easy_ViTPose: ")
    assert words in found.reading


def test_animals_and_other_shapes_are_no_people(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"skeleton: found nose, .*; valid: the names of a person's landmarks"
    ):
        evidence.read(vitpose(tmp_path, (*COCO[:16], "L_F_Paw")), ASKED)
    with pytest.raises(InputError, match=r"keypoints\[0\].0: found shape \(17, 3\); valid: \(16, 3\)"):
        evidence.read(vitpose(tmp_path, COCO[:16]), ASKED)
