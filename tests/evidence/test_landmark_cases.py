"""Files of landmarks as sloppy writers leave them (`tests/data/cases`), and their relatives."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.camera import fov
from simrecon.evidence.keypoints import layouts
from simrecon.types import Camera, Evidence, Lens
from tests.support import foreign_files as foreign
from tests.support import people
from tools import CHECKOUT

CASES = CHECKOUT / "tests" / "data" / "cases"
UPRIGHT = fov.pinhole(1660.0, (1080, 1920))
APART = np.array([150.0, 0.0])
SMALL = Camera(Lens(np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]), np.zeros(5), (640, 480)))


def case(name: str, person: str | None = None) -> Evidence:
    return evidence.read(CASES / name, Options(fps=30.0, camera=UPRIGHT, person=person))


def at(found: Evidence, name: str) -> np.ndarray:
    return found.keypoints_px[:, found.keypoint_names.index(name)]


def test_body_25b_is_not_body_25() -> None:
    found = case("openpose_body25b")
    assert "in the order of openpose_25b" in found.reading
    np.testing.assert_allclose(at(found, "left_shoulder")[0], [515.067, 506.396])
    np.testing.assert_allclose(at(found, "head_top")[0], [566.129, 407.657])
    np.testing.assert_allclose(at(found, "right_heel")[0], [330.887, 1009.879])


def test_empty_people_are_left_out_and_said() -> None:
    found = case("openpose_empty_person")
    assert len(found.times_s) == 30
    assert "30 empty people left out" in found.reading
    np.testing.assert_allclose(at(found, "left_hip")[0], [460.879, 750.215])


def test_two_people_of_one_id_are_followed_by_distance() -> None:
    with pytest.raises(
        InputError, match=r"people: found 2: 0 \(30 frames\), 1 \(30 frames\); valid: one of them"
    ):
        case("alphapose_idx0_two_people.json")
    found = [case("alphapose_idx0_two_people.json", person=name) for name in "01"]
    assert "ids that stand for several people at once (0.0): not used" in found[0].reading
    assert "followed by distance" in found[0].reading
    np.testing.assert_allclose(
        found[0].keypoints_px - found[1].keypoints_px,
        np.broadcast_to([300.0, 0.0], found[0].keypoints_px.shape),
        atol=0.01,
    )


def test_the_list_of_the_inferencer_is_read() -> None:
    found = case("mmpose_inferencer_list.json")
    assert found.keypoint_names == layouts.layout("coco_17")
    np.testing.assert_allclose(at(found, "left_ankle")[0], [417.957, 1085.551])


def test_a_lifter_gives_metres_not_pixels() -> None:
    found = case("mmpose_3d_lift.json")
    assert found.keypoint_names == ()
    assert found.joints_frame == "camera_root_relative"
    assert "without a place" in found.reading
    ankle, hip = (found.joints_m[0, found.joint_names.index(name)] for name in ("left_ankle", "left_hip"))
    np.testing.assert_allclose(ankle - hip, [-0.096, 0.769, 0.079], atol=1e-6)  # x right, y down, z ahead


# --- relatives: empty people, ids, numbers of frames


def people_of(count: int, frames: int = 20) -> list[np.ndarray]:
    """Landmarks (T, J, 3) with confidences of people side by side."""
    name = foreign.USUAL[count]
    points = [people.landmarks(layouts.layout(name), frames, k) + k * APART for k in range(2)]
    return [np.concatenate((one, np.full((frames, count, 1), 0.9)), axis=-1) for one in points]


def alphapose(
    path: Path, name: Callable[[int, int], Any], *, order: Callable[[int, int], int] = lambda _t, k: k
) -> Path:
    both = people_of(26)
    tree = []
    for t in range(20):
        for k in range(2):
            who = order(t, k)
            tree.append(
                {
                    "image_id": f"{t}.jpg",
                    "keypoints": both[who][t].ravel().tolist(),
                    "score": 2.0,
                    "idx": name(t, who),
                }
            )
    return foreign.save_json(path / "alphapose-results.json", tree)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        (lambda _t, _k: 7, "stand for several people at once"),
        (lambda t, k: 100 * t + k, "change from frame to frame"),
        (lambda t, k: k if t < 10 else 1 - k, "go from one person to another"),
        (lambda _t, _k: None, ""),
    ],
)
def test_ids_that_are_none_are_not_believed(
    tmp_path: Path, name: Callable[[int, int], Any], word: str
) -> None:
    path = alphapose(tmp_path, name, order=lambda t, k: k if t % 3 else 1 - k)
    found = [evidence.read(path, Options(fps=30.0, camera=SMALL, person=who)) for who in "01"]
    both = people_of(26)
    keep = [i for i, landmark in enumerate(layouts.layout("halpe_26")) if landmark]
    firsts = sorted(found, key=lambda one: one.keypoints_px[0, 0, 0])
    for one, wanted in zip(firsts, both, strict=True):
        np.testing.assert_allclose(one.keypoints_px, wanted[:, keep, :2])
        assert word in one.reading
        assert "followed by distance" in one.reading


@pytest.mark.parametrize("which", [lambda t: t % 2, lambda t: t > 9, lambda t: 5 < t < 9])
def test_one_id_for_whoever_was_best_seen_is_nobodys(tmp_path: Path, which: Callable[[int], Any]) -> None:
    both = people_of(17)
    tree = [
        {"image_id": t, "keypoints": both[int(which(t))][t].ravel().tolist(), "score": 1.0, "track_id": 0}
        for t in range(20)
    ]
    path = foreign.save_json(tmp_path / "results.json", tree)
    with pytest.raises(InputError, match="people: found 2: 0 "):
        evidence.read(path, Options(fps=30.0, camera=SMALL))
    found = evidence.read(path, Options(fps=30.0, camera=SMALL, person="1"))
    assert "ids that go from one person to another (0): not used" in found.reading


def test_who_runs_at_few_frames_a_second_is_one_person(tmp_path: Path) -> None:
    points = people_of(17)[0]
    points[..., 0] = 0.2 * points[..., 0] + 29.0 * np.arange(20)[:, None]  # 0.4 of the size of 70 px a frame
    points[..., 1] *= 0.2
    tree = [
        {"image_id": t, "keypoints": row.ravel().tolist(), "score": 1.0, "track_id": 3}
        for t, row in enumerate(points)
    ]
    found = evidence.read(foreign.save_json(tmp_path / "results.json", tree), Options(fps=8.0, camera=SMALL))
    assert len(found.times_s) == 20


def test_names_that_make_no_person_are_doubted(tmp_path: Path) -> None:
    points = people_of(17)[0]
    names = dict(enumerate(np.random.default_rng(0).permutation(layouts.layout("coco_17")).tolist()))
    frames = [{"frame_id": t, "instances": instances(row)} for t, row in enumerate(points)]
    for table, odd in ((names, True), (dict(enumerate(layouts.layout("coco_17"))), False)):
        meta = {"keypoint_id2name": {str(i): name for i, name in table.items()}}
        path = foreign.save_json(tmp_path / "clip.json", {"meta_info": meta, "instance_info": frames})
        found = evidence.read(path, Options(fps=30.0, camera=SMALL))
        assert ("hardly make a person" in found.reading) == odd


def test_ids_that_are_people_are_believed(tmp_path: Path) -> None:
    found = evidence.read(
        alphapose(tmp_path, lambda _t, k: f"p{k}"), Options(fps=30.0, camera=SMALL, person="p1")
    )
    assert "followed by distance" not in found.reading


def test_what_is_there_twice_counts_once(tmp_path: Path) -> None:
    path = alphapose(tmp_path, lambda _t, k: k)
    tree = json.loads(path.read_text())
    foreign.save_json(path, [*tree, *tree[:6]])
    found = evidence.read(path, Options(fps=30.0, camera=SMALL, person="0"))
    assert "6 detections that are there twice left out" in found.reading
    assert "followed by distance" not in found.reading


@pytest.mark.parametrize("empty", [[], None, [0.0] * 75])
def test_empty_people_of_every_kind(tmp_path: Path, empty: Any) -> None:
    (one, _) = people_of(25)
    for t in range(20):
        listed = [{"person_id": [-1], "pose_keypoints_2d": empty}]
        if t != 4:  # and a frame of nobody else
            listed.append({"person_id": [-1], "pose_keypoints_2d": one[t].ravel().tolist()})
        foreign.save_json(tmp_path / f"{t:012d}_keypoints.json", {"people": listed})
    found = evidence.read(tmp_path, Options(fps=30.0, camera=SMALL))
    assert len(found.times_s) == 19
    assert "left out" in found.reading


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("frame{}_keypoints.json", ""),
        ("{:04d}_cam02_keypoints.json", "the number before the last 1"),
        ("take3_{}_1080p_keypoints.json", "the number before the last 1"),
        ("{:03d}.json", ""),
        ("frame_{:04d}_rendered2_keypoints.json", "the number before"),
    ],
)
def test_frames_are_numbered_by_what_differs_in_the_names(tmp_path: Path, name: str, word: str) -> None:
    (one, _) = people_of(25)
    for t in range(20):
        people_ = [{"pose_keypoints_2d": one[t].ravel().tolist()}]
        foreign.save_json(tmp_path / name.format(t), {"people": people_})
    found = evidence.read(tmp_path, Options(fps=30.0, camera=SMALL))
    np.testing.assert_allclose(found.times_s, np.arange(20) / 30.0)
    np.testing.assert_allclose(at(found, "nose"), one[:, 0, :2])
    assert word in found.reading


def test_frames_without_numbers_and_numbers_in_steps(tmp_path: Path) -> None:
    (one, _) = people_of(17)
    words = sorted({"".join((a, b)) for a in "abcde" for b in "wxyz"})
    for key, names in (
        ("words", [f"{w}.jpg" for w in words]),
        ("steps", [f"{5 * t}.jpg" for t in range(20)]),
    ):
        tree = [
            {"image_id": n, "keypoints": one[t].ravel().tolist(), "score": 1.0} for t, n in enumerate(names)
        ]
        found = evidence.read(
            foreign.save_json(tmp_path / f"{key}.json", tree), Options(fps=120.0, camera=SMALL)
        )
        np.testing.assert_allclose(at(found, "nose"), one[:, 0, :2])
        assert ("in the order of the names" if key == "words" else "numbered in steps of 5") in found.reading


# --- relatives: how MMPose's predictions are put into files


def instances(values: np.ndarray) -> list[dict[str, Any]]:
    return [
        {
            "keypoints": values[:, :2].tolist(),
            "keypoint_scores": values[:, 2].tolist(),
            "bbox": [[0, 0, 1, 1]],
        }
    ]


@pytest.mark.parametrize("kind", ["lists", "batches", "predictions", "constant ids", "folder", "empty first"])
def test_predictions_of_mmpose_in_every_wrapping(tmp_path: Path, kind: str) -> None:
    (one, _) = people_of(17)
    frames: list[Any] = [instances(values) for values in one]
    path = tmp_path / "clip.json"
    if kind == "batches":
        frames = [[frame] for frame in frames]
    if kind == "constant ids":
        frames = [{"frame_id": 0, "instances": frame} for frame in frames]
    if kind == "empty first":
        frames = [[], *frames]
    if kind == "folder":
        path = tmp_path / "predictions"
        path.mkdir()
        for t, frame in enumerate(frames):
            foreign.save_json(path / f"{t}.json", frame)
    else:
        foreign.save_json(path, {"predictions": frames} if kind == "predictions" else frames)
    found = evidence.read(path, Options(fps=30.0, camera=SMALL))
    np.testing.assert_allclose(found.keypoints_px, one[..., :2])
    np.testing.assert_allclose(found.times_s, (np.arange(20) + (kind == "empty first")) / 30.0)
    assert found.reading.startswith("MMPose/RTMPose: ")


# --- relatives: an axis of people in an array


@pytest.mark.parametrize("shape", ["PTJC", "TPJC", "1TJC", "T1JC", "TJC", "TJ2"])
def test_arrays_with_an_axis_of_people(tmp_path: Path, shape: str) -> None:
    both = np.stack(people_of(17))  # (P, T, J, C)
    values = {
        "PTJC": both,
        "TPJC": np.swapaxes(both, 0, 1),
        "1TJC": both[:1],
        "T1JC": both[0][:, None],
        "TJC": both[0],
        "TJ2": both[0][..., :2],
    }[shape]
    np.save(tmp_path / "clip.npy", values)
    person = "0" if "P" in shape else None
    found = evidence.read(tmp_path / "clip.npy", Options(fps=30.0, camera=SMALL, person=person))
    np.testing.assert_allclose(found.keypoints_px, both[0, ..., :2])
    if person is not None:
        with pytest.raises(InputError, match="people: found 2"):
            evidence.read(tmp_path / "clip.npy", Options(fps=30.0, camera=SMALL))
