from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence
from simrecon.body import names as body_names
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.keypoints import layouts, people3d
from simrecon.types import Camera, Lens
from tests.support import foreign_files as foreign

T, FPS = foreign.T, foreign.FPS
APART = np.array([150.0, 0.0])
LENS = Camera(Lens(np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]), np.zeros(5), (640, 480)))
ASKED = Options(fps=FPS, camera=LENS)


def triples(points: np.ndarray, scores: np.ndarray) -> list[float]:
    return [float(x) for x in np.concatenate((points, scores[:, None]), axis=1).ravel()]


def openpose(folder: Path, count: int = 25, people: int = 1) -> Path:
    target = folder / "json"
    target.mkdir()
    for t in range(T):
        listed = []
        for k in range(people):
            points, scores = foreign.landmarks(count, seed=k + 1)
            listed.append({"person_id": [-1], "pose_keypoints_2d": triples(points[t] + APART * k, scores[t])})
        foreign.save_json(target / f"clip_{t + 5:012d}_keypoints.json", {"version": 1.3, "people": listed})
    return target


def coco_results(folder: Path, count: int = 17) -> Path:
    points, scores = foreign.landmarks(count)
    tree = [
        {"image_id": t + 5, "category_id": 1, "keypoints": triples(points[t], scores[t]), "score": 0.9}
        for t in range(T)
    ]
    return foreign.save_json(folder / "results.json", tree)


def coco_dataset(folder: Path, count: int = 17) -> Path:
    points, _ = foreign.landmarks(count)
    images = [
        {"id": 100 - t, "file_name": f"frame_{t + 5:05d}.jpg", "width": 640, "height": 480} for t in range(T)
    ]
    people = [
        {
            "id": t,
            "image_id": 100 - t,
            "keypoints": triples(points[t], np.full(count, 2.0)),
            "num_keypoints": count,
        }
        for t in range(T)
    ]
    categories = [{"id": 1, "name": "person", "keypoints": list(layouts.layout("coco_17"))}]
    return foreign.save_json(
        folder / "dataset.json", {"images": images, "annotations": people, "categories": categories}
    )


def alphapose(folder: Path, count: int = 26, people: int = 1) -> Path:
    tree = []
    for t in range(T):
        for k in range(people):
            points, scores = foreign.landmarks(count, seed=k + 1)
            tree.append(
                {
                    "image_id": f"{t + 5}.jpg",
                    "category_id": 1,
                    "score": 2.7,
                    "idx": k + 1,
                    "box": [0, 0, 1, 1],
                    "keypoints": triples(points[t] + APART * k, scores[t]),
                }
            )
    return foreign.save_json(folder / "alphapose-results.json", tree)


def mmpose(folder: Path, count: int = 17, named: bool = True) -> Path:
    points, scores = foreign.landmarks(count)
    frames = [
        {
            "frame_id": t + 5,
            "instances": [
                {
                    "keypoints": points[t].tolist(),
                    "keypoint_scores": scores[t].tolist(),
                    "bbox": [[0, 0, 1, 1]],
                }
            ],
        }
        for t in range(T)
    ]
    meta = {"dataset_name": "x", "num_keypoints": count}
    if named:
        meta["keypoint_id2name"] = {str(i): name for i, name in enumerate(layouts.layout("coco_17"))}
    return foreign.save_json(folder / "results_clip.json", {"meta_info": meta, "instance_info": frames})


def array(folder: Path, count: int) -> Path:
    """As GVHMR keeps the landmarks of ViTPose; the first five frames are of nobody."""
    points, scores = foreign.landmarks(count)
    seen_ = np.concatenate((points, scores[..., None]), axis=-1)
    return foreign.save_torch(folder / "vitpose.pt", np.concatenate((np.zeros((5, count, 3)), seen_)))


LAYOUTS: dict[str, tuple[Callable[..., Path], int, str]] = {
    "OpenPose BODY_25": (openpose, 25, "openpose_25"),
    "OpenPose COCO": (openpose, 18, "openpose_18"),
    "COCO results": (coco_results, 17, "coco_17"),
    "COCO WholeBody results": (coco_results, 133, "wholebody_133"),
    "COCO dataset": (coco_dataset, 17, "coco_17"),
    "AlphaPose COCO": (alphapose, 17, "coco_17"),
    "AlphaPose Halpe": (alphapose, 26, "halpe_26"),
    "AlphaPose Halpe full": (alphapose, 136, "halpe_136"),
    "MMPose": (mmpose, 17, "coco_17"),
    "landmark array": (array, 17, "coco_17"),
    "RTMPose Halpe": (lambda folder, count: mmpose(folder, count, named=False), 26, "halpe_26"),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_round_trip(tmp_path: Path, name: str) -> None:
    write, count, layout = LAYOUTS[name]
    found = evidence.read(write(tmp_path, count), ASKED)
    points, scores = foreign.landmarks(count)
    keep = [i for i, landmark in enumerate(layouts.layout(layout)) if landmark]
    assert [n.lower() for n in found.keypoint_names] == [layouts.layout(layout)[i].lower() for i in keep]
    np.testing.assert_allclose(found.keypoints_px, points[:, keep], atol=1e-4)
    if name != "COCO dataset":
        np.testing.assert_allclose(found.scores, scores[:, keep], atol=1e-6)
    np.testing.assert_allclose(found.times_s, (np.arange(T) + 5) / FPS, atol=1e-9)
    assert found.camera is not None
    assert found.camera is LENS or found.camera.lens.image_size_px == (640, 480)
    assert found.reading.split(":")[0].split("/")[0] in (
        "OpenPose",
        "COCO",
        "AlphaPose",
        "MMPose",
        "landmark array",
    )


@pytest.mark.parametrize(
    "layout", ["coco_17", "openpose_18", "openpose_25", "halpe_26", "wholebody_133", "halpe_136", "mhr_70"]
)
def test_layouts_have_known_names_each_once_and_both_sides(layout: str) -> None:
    listed = [name.lower() for name in layouts.layout(layout) if name]
    assert set(listed) <= set(body_names.valid_names())
    assert len(set(listed)) == len(listed)
    points = [body_names.points()[i]["name"] for i in body_names.resolve(listed)]
    assert sorted(p.replace("left", "right") for p in points if p.startswith("left_")) == sorted(
        p for p in points if p.startswith("right_")
    )


def test_hands_of_the_whole_body_layout_are_at_their_place() -> None:
    whole = layouts.layout("wholebody_133")
    assert (whole[93], whole[96], whole[108]) == ("left_thumb", "left_index", "left_pinky")
    assert (whole[114], whole[117], whole[129]) == ("right_thumb", "right_index", "right_pinky")


def test_zero_confidence_is_unseen_and_hidden_counts_half(tmp_path: Path) -> None:
    path = coco_dataset(tmp_path)
    tree = json.loads(path.read_text())
    tree["annotations"][2]["keypoints"][3:9] = [0, 0, 0, 50, 60, 1]
    foreign.save_json(path, tree)
    found = evidence.read(path, ASKED)
    assert np.isnan(found.keypoints_px[2, 1]).all()
    assert found.scores[2, 1:3].tolist() == [0.0, 0.5]
    assert (found.scores[0] == 1).all()


def test_people_are_followed_without_ids(tmp_path: Path) -> None:
    path = openpose(tmp_path, people=2)
    for i, file in enumerate(sorted(path.iterdir())):  # the order of the people changes from frame to frame
        tree = json.loads(file.read_text())
        if i % 2:
            tree["people"].reverse()
        if i == 4:  # and a false detection comes in
            tree["people"].append({"pose_keypoints_2d": [5.0 + i, 6.0, 0.4] * 25})
        foreign.save_json(file, tree)
    assert_refused(path, ASKED, "people: found 2", "--person")
    first, second = (evidence.read(path, replace(ASKED, person=name)) for name in "01")
    keep = [i for i, name in enumerate(layouts.layout("openpose_25")) if name]
    wanted = [foreign.landmarks(25, seed=seed)[0][:, keep] for seed in (1, 2)]
    np.testing.assert_allclose(first.keypoints_px, wanted[0], atol=1e-4)
    np.testing.assert_allclose(second.keypoints_px, wanted[1] + APART, atol=1e-4)
    assert "followed by distance" in first.reading


def test_short_tracks_are_left_out_and_said(tmp_path: Path) -> None:
    path = openpose(tmp_path)
    frames = sorted(path.iterdir())
    for i in range(T, 3 * T):
        tree = json.loads(frames[-1].read_text())
        foreign.save_json(path / f"clip_{i + 5:012d}_keypoints.json", tree)
    tree = json.loads(frames[3].read_text())
    tree["people"].append({"pose_keypoints_2d": [5.0, 6.0, 0.4, 50.0, 6.0, 0.4] + [0.0] * 69})
    foreign.save_json(frames[3], tree)
    found = evidence.read(path, ASKED)
    assert "1 short tracks left out" in found.reading
    assert len(found.times_s) == 3 * T


def test_ids_of_the_file_are_used(tmp_path: Path) -> None:
    path = alphapose(tmp_path, people=2)
    assert_refused(path, ASKED, "people: found 2: 1 (12 frames), 2 (12 frames)")
    found = evidence.read(path, replace(ASKED, person="2"))
    keep = [i for i, name in enumerate(layouts.layout("halpe_26")) if name]
    np.testing.assert_allclose(
        found.keypoints_px, foreign.landmarks(26, seed=2)[0][:, keep] + APART, atol=1e-4
    )


def test_a_lens_and_a_frame_rate_are_asked_for(tmp_path: Path) -> None:
    path = coco_results(tmp_path)
    assert_refused(path, Options(fps=FPS), "no lens", "--fov")
    assert_refused(path, Options(camera=LENS), "frame rate", "--fps")


def assert_refused(path: Path, options: Options, *parts: str) -> None:
    with pytest.raises(InputError) as error:
        evidence.read(path, options)
    message = str(error.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    assert [part for part in (*parts, "valid: ") if part not in message] == []


def changed(write: Callable[[Path], Path], change: Callable[[Any], Any]) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = write(folder)
        file = sorted(path.iterdir())[1] if path.is_dir() else path
        tree = json.loads(file.read_text())
        done = change(tree)
        foreign.save_json(file, tree if done is None else done)
        return path

    return make


def nobody(folder: Path) -> Path:
    path = openpose(folder)
    for file in path.iterdir():
        foreign.save_json(file, {"people": []})
    return path


def cut(folder: Path) -> Path:
    path = mmpose(folder)
    path.write_text(path.read_text()[:-200])
    return path


def first(tree: Any) -> Any:
    return tree["instance_info"][1]["instances"][0]


BAD: dict[str, tuple[Callable[[Path], Path], str]] = {
    "OpenPose, nobody": (nobody, "people: found no person"),
    "OpenPose, missing key": (
        changed(openpose, lambda t: t["people"][0].pop("pose_keypoints_2d") and None),
        "clip_000000000006_keypoints.json: people[0].pose_keypoints_2d: found no such key",
    ),
    "OpenPose, wrong rank": (
        changed(openpose, lambda t: t["people"][0].update(pose_keypoints_2d=[1.0, 2.0])),
        "found 2 numbers",
    ),
    "OpenPose, other number": (
        changed(openpose, lambda t: t["people"][0].update(pose_keypoints_2d=[1.0, 2.0, 0.5] * 18)),
        "25 landmarks",
    ),
    "OpenPose, unknown number": (lambda folder: openpose(folder, count=24), "found 24 landmarks"),
    "COCO, missing key": (changed(coco_results, lambda t: t[3].pop("keypoints") and None), "[3].keypoints"),
    "COCO, text": (changed(coco_results, lambda t: t[3].update(keypoints=["a"] * 51)), "[3].keypoints"),
    "COCO, unknown number": (lambda folder: coco_results(folder, 13), "found 13 landmarks"),
    "COCO, unknown image": (
        changed(coco_dataset, lambda t: t["annotations"][2].update(image_id=-7)),
        "annotations[2].image_id",
    ),
    "COCO, nobody": (changed(coco_dataset, lambda t: t.update(annotations=[])), "people: found no person"),
    "AlphaPose, missing key": (changed(alphapose, lambda t: t[5].pop("keypoints") and None), "[5].keypoints"),
    "AlphaPose, no image": (
        changed(alphapose, lambda t: t[5].pop("image_id") and None),
        "image_id: found no such key",
    ),
    "COCO, a list as id": (
        changed(coco_dataset, lambda t: t["annotations"][0].update(image_id=[1])),
        "layout: found values that do not fit it (TypeError: ",
    ),
    "AlphaPose, a list as image": (changed(alphapose, lambda t: t[5].update(image_id=[1])), "[5].image_id"),
    "OpenPose, beyond any image": (
        changed(openpose, lambda t: t["people"][0].update(pose_keypoints_2d=[1e300, 2.0, 0.5] * 25)),
        "pose_keypoints_2d: found a number of 1e+300",
    ),
    "MMPose, missing key": (
        changed(mmpose, lambda t: first(t).pop("keypoint_scores") and None),
        "instance_info[1].instances[0].keypoint_scores: found no such key",
    ),
    "MMPose, wrong rank": (
        changed(mmpose, lambda t: first(t).update(keypoints=[1.0] * 34)),
        "found shapes (34,)",
    ),
    "MMPose, nobody": (changed(mmpose, lambda t: t.update(instance_info=[])), "people: found no person"),
    "MMPose, no list": (changed(mmpose, lambda t: t.update(instance_info={})), "instance_info: found a dict"),
    "MMPose, cut": (cut, "damaged JSON"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_give_one_clear_line(tmp_path: Path, name: str) -> None:
    write, found = BAD[name]
    with pytest.raises(InputError) as error:
        evidence.read(write(tmp_path), ASKED)
    assert "\n" not in str(error.value)
    assert found in str(error.value)


def test_nan_in_json_is_unseen(tmp_path: Path) -> None:
    path = changed(coco_results, lambda t: t[3]["keypoints"].__setitem__(4, float("nan")))(tmp_path)
    found = evidence.read(path, ASKED)
    assert np.isnan(found.keypoints_px[3, 1]).all()
    assert found.scores[3, 1] == 0


# --- people with joints in space

FOCAL, SIZE = 1100.0, (1280, 720)


def body(count: int, seed: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Joints around the origin of a camera's axes (T, J, 3), and places (T, 3)."""
    rng = np.random.default_rng(seed)
    shape = rng.uniform(-0.5, 0.5, (1, count, 3)) + 0.02 * np.linspace(0, 1, T)[:, None, None]
    return shape, np.array([0.1, 0.2, 4.0]) + np.linspace(0, 1, T)[:, None] * [0.3, 0.0, 0.5]


def seen(joints: np.ndarray, focal: float) -> np.ndarray:
    return focal * joints[..., :2] / joints[..., 2:] + np.array(SIZE) / 2


def sam3d(folder: Path, focal: Any = FOCAL, kind: str = "pickle", **change: Any) -> Path:
    shape, place = body(70)
    focals = np.broadcast_to(focal, T)
    frames = []
    for t in range(T):
        at = place[t] * [1, 1, focals[t] / FOCAL]
        person = {
            "bbox": np.zeros(4),
            "focal_length": np.float32(focals[t]),
            "pred_keypoints_3d": shape[t],
            "pred_keypoints_2d": seen(shape[t] + at, focals[t]),
            "pred_cam_t": at,
            "mask": None,
            "global_rot": np.zeros(3),
            "body_pose_params": np.zeros(133),
            "shape_params": np.zeros(45),
        } | change
        frames.append(
            [{key: value for key, value in person.items() if key not in change or value is not None}]
        )
    if kind == "npz":
        keys = ("focal_length", "pred_keypoints_3d", "pred_keypoints_2d", "pred_cam_t")
        path = folder / "sam.npz"
        np.savez(
            path, allow_pickle=False, **{key: np.stack([frame[0][key] for frame in frames]) for key in keys}
        )
        return path
    if kind == "json":
        tree = {
            f"frame_{t:04d}.jpg": [{k: np.asarray(v).tolist() for k, v in frame[0].items() if v is not None}]
            for t, frame in enumerate(frames)
        }
        return foreign.save_json(folder / "sam.json", tree)
    return foreign.save_pickle(folder / "sam.pkl", frames)


@pytest.mark.parametrize("kind", ["pickle", "npz", "json"])
def test_sam_3d_body_round_trip(tmp_path: Path, kind: str) -> None:
    found = evidence.read(sam3d(tmp_path, kind=kind), Options(fps=FPS))
    shape, place = body(70)
    keep = [i for i, name in enumerate(layouts.layout("mhr_70")) if name]
    assert found.joints_frame == "camera"
    np.testing.assert_allclose(found.joints_m, (shape + place[:, None])[:, keep], atol=1e-5)
    np.testing.assert_allclose(found.keypoints_px, seen(shape + place[:, None], FOCAL)[:, keep], atol=1e-2)
    assert found.camera is not None
    np.testing.assert_allclose(
        found.camera.lens.matrix_px, [[FOCAL, 0, 640], [0, FOCAL, 360], [0, 0, 1.0]], atol=0.05
    )
    assert found.camera.lens.image_size_px == SIZE


def test_sam_3d_body_with_a_focal_length_for_every_frame_has_one_lens(tmp_path: Path) -> None:
    focals = FOCAL * np.linspace(0.9, 1.1, T)
    found = evidence.read(sam3d(tmp_path, focals), Options(fps=FPS))
    shape, place = body(70)
    keep = [i for i, name in enumerate(layouts.layout("mhr_70")) if name]
    distance = np.linalg.norm(found.joints_m - (shape + place[:, None])[:, keep], axis=-1)
    assert distance.max() < 0.02


def phalp(folder: Path, people: int = 1, **change: Any) -> Path:
    """As of joblib, compressed: the landmarks are shares of the padded image, the camera far away."""
    focal = 5000 / 256 * max(SIZE)
    shape, place = body(45)
    place = place * [1, 1, focal / FOCAL]
    tree = {}
    for t in range(T):
        pixels = seen(shape[t] + place[t], focal) + np.array([0, (SIZE[0] - SIZE[1]) / 2])
        one = {
            "time": t,
            "shot": 0,
            "tid": list(range(1, people + 1)),
            "tracked_time": [0] * people,
            "3d_joints": [shape[t]] * people,
            "2d_joints": [(pixels / SIZE[0]).ravel()] * people,
            "camera": [place[t]] * people,
            "size": [[SIZE[1], SIZE[0]]] * people,
            "bbox": [np.zeros(4)] * people,
            "smpl": [
                {
                    "betas": np.zeros(10),
                    "body_pose": np.zeros((23, 3, 3)),
                    "global_orient": np.zeros((1, 3, 3)),
                }
            ],
        } | change
        tree[f"outputs/img/{t:06d}.jpg"] = {key: value for key, value in one.items() if value is not None}
    return foreign.save_joblib(folder / "demo_clip.pkl", tree, compress=True)


def test_phalp_round_trip(tmp_path: Path) -> None:
    found = evidence.read(phalp(tmp_path), Options(fps=FPS))
    shape, _ = body(45)
    names = [name.lower() for name in found.joint_names]
    layout = layouts.layout("openpose_25")
    keep = [i for i, name in enumerate(layout) if name]
    assert names == [layout[i] for i in keep]
    hips = shape[:, [layout.index("right_hip"), layout.index("left_hip")]].mean(axis=1, keepdims=True)
    assert found.joints_frame == "camera_root_relative"
    np.testing.assert_allclose(found.joints_m, (shape - hips)[:, keep], atol=1e-6)
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.lens.matrix_px[0, 0], 25000, rtol=1e-4)
    np.testing.assert_allclose(found.camera.lens.matrix_px[:2, 2], [640, 360], atol=0.1)
    assert "nearly orthographic" in found.reading
    lens = Camera(Lens(np.array([[800.0, 0, 640], [0, 800, 360], [0, 0, 1]]), np.zeros(5), SIZE))
    real = evidence.read(phalp(tmp_path), Options(fps=FPS, camera=lens))
    assert real.camera is not None
    assert real.camera.lens.matrix_px[0, 0] == 800


def test_phalp_leaves_out_frames_in_which_the_person_was_not_seen(tmp_path: Path) -> None:
    path = phalp(tmp_path, tracked_time=None)
    assert len(evidence.read(path, Options(fps=FPS)).times_s) == T
    gone = phalp(tmp_path, people=2, tracked_time=[0, 3])
    assert "person 1 of" not in evidence.read(gone, Options(fps=FPS)).reading  # the second was never seen


BAD3D: dict[str, tuple[Callable[[Path], Path], str]] = {
    "SAM, missing key": (lambda f: sam3d(f, pred_cam_t=None), "[0][0].pred_cam_t: found no such key"),
    "SAM, wrong rank": (lambda f: sam3d(f, pred_keypoints_3d=np.zeros((70, 2))), "found shape (70, 2)"),
    "SAM, NaN": (lambda f: sam3d(f, pred_cam_t=np.full(3, np.nan)), "found NaN"),
    "SAM, no focal length": (lambda f: sam3d(f, focal_length=0.0), "focal_length: found 0"),
    "SAM, they do not agree": (
        lambda f: sam3d(f, pred_keypoints_2d=np.random.default_rng(0).uniform(0, 700, (70, 2))),
        "px off",
    ),
    "PHALP, missing key": (
        lambda f: phalp(f, camera=None),
        "outputs/img/000000.jpg.camera: found no such list",
    ),
    "PHALP, too few": (lambda f: phalp(f, people=1, **{"3d_joints": []}), "3d_joints: found 0 people"),
    "PHALP, wrong rank": (
        lambda f: phalp(f, people=1, **{"3d_joints": [np.zeros(135)]}),
        "3d_joints[0]: found shape (135,)",
    ),
    "PHALP, NaN": (lambda f: phalp(f, camera=[np.full(3, np.nan)]), "found NaN"),
    "PHALP, nobody": (lambda f: phalp(f, tid=[]), "people: found no person"),
}


@pytest.mark.parametrize("name", BAD3D)
def test_bad_files_with_joints_give_one_clear_line(tmp_path: Path, name: str) -> None:
    write, found = BAD3D[name]
    assert_refused(write(tmp_path), Options(fps=FPS), found)


def test_a_lens_is_found_again() -> None:
    shape, place = body(30)
    joints = shape + place[:, None]
    camera, off = people3d.lens(joints, seen(joints, FOCAL), None)
    np.testing.assert_allclose(
        camera.lens.matrix_px, [[FOCAL, 0, 640], [0, FOCAL, 360], [0, 0, 1.0]], atol=1e-6
    )
    assert off < 1e-6
    assert people3d.lens(joints, seen(joints, FOCAL)[:, ::-1], None)[1] > 50
