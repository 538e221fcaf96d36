from __future__ import annotations

import pickle
import zipfile
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon.errors import InputError
from simrecon.evidence.npz import check_names, read, write
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, Evidence, Lens

T = 4
KEYPOINT_KEYS = ("keypoint_names", "keypoints_px", "keypoint_scores")
JOINT_KEYS = ("joint_names", "joints_m", "joints_frame")
Content = dict[str, Any]


def content() -> Content:
    """Every key of the format, filled validly."""
    rng = np.random.default_rng(3)
    pose = np.eye(4)
    pose[:3] = [[0, -1, 0, 0.1], [0, 0, -1, 1.5], [1, 0, 0, 4.0]]
    quaternions = rng.normal(size=(T, 2, 4))
    return {
        "schema": "simrecon.evidence/1",
        "times_s": np.arange(T) / 30,
        "image_size_px": np.array([640, 480]),
        "keypoint_names": np.array(["nose", "left_knee", "right_knee"]),
        "keypoints_px": rng.uniform(0, 480, (T, 3, 2)).astype(np.float32),
        "keypoint_scores": rng.uniform(0.1, 1, (T, 3)),
        "camera_K": np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]]),
        "camera_dist": np.array([-0.2, 0.1, 0, 0, 0]),
        "world_to_camera": pose,
        "joint_names": np.array(["left_hip", "right_hip"]),
        "joints_m": rng.uniform(-1, 1, (T, 2, 3)),
        "joints_frame": "world",
        "rotation_names": np.array(["left_hip", "spine"]),
        "rotations": quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True),
        "betas": np.arange(10.0),
        "mass_kg": 70.0,
        "height_m": 1.8,
    }


def saved(folder: Path, arrays: Content) -> Path:
    path = folder / "clip.npz"
    np.savez(path, **arrays)
    return path


def same(a: Any, b: Any) -> bool:
    if isinstance(a, (Camera, Lens)):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return bool(a == b)


def assert_same(a: Evidence, b: Evidence, but: tuple[str, ...] = ("sha256", "reading")) -> None:
    names = [f.name for f in fields(a) if f.name not in but]
    assert [name for name in names if not same(getattr(a, name), getattr(b, name))] == []


def test_reads_every_key(tmp_path: Path) -> None:
    given_ = content()
    evidence = read(saved(tmp_path, given_))
    assert evidence.keypoint_names == ("nose", "left_knee", "right_knee")
    assert evidence.keypoints_px.dtype == np.float64
    np.testing.assert_array_equal(evidence.keypoints_px, given_["keypoints_px"])
    np.testing.assert_array_equal(evidence.joints_m, given_["joints_m"])
    assert evidence.joints_frame == "world"
    assert evidence.camera is not None
    assert evidence.camera.lens.image_size_px == (640, 480)
    np.testing.assert_array_equal(evidence.camera.lens.matrix_px, given_["camera_K"])
    frames = len(given_["times_s"])
    np.testing.assert_array_equal(evidence.camera.path, [given_["world_to_camera"]] * frames)
    assert evidence.reading == "rotations, betas in the file, not used"
    assert (evidence.mass_kg, evidence.height_m) == (70.0, 1.8)


def test_sha256_is_of_the_bytes_of_the_file(tmp_path: Path) -> None:
    path = saved(tmp_path, content())
    first = read(path).sha256
    assert len(first) == 64
    assert read(saved(tmp_path, content() | {"mass_kg": 71.0})).sha256 != first


def test_what_is_written_reads_back_equal_and_the_bytes_are_reproducible(tmp_path: Path) -> None:
    evidence = read(saved(tmp_path, content()))
    copies = tmp_path / "a.npz", tmp_path / "b.npz"
    for copy in copies:
        write(copy, evidence)
    assert_same(read(copies[0]), evidence)
    assert copies[0].read_bytes() == copies[1].read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npz", "b.npz", "clip.npz"]


@pytest.mark.parametrize(
    "left_out",
    [
        JOINT_KEYS,
        KEYPOINT_KEYS,
        (*KEYPOINT_KEYS, "camera_K", "camera_dist", "world_to_camera", "image_size_px"),
        ("rotation_names", "rotations", "betas", "mass_kg", "height_m"),
        ("world_to_camera",),
    ],
)
def test_optional_parts_may_be_left_out(tmp_path: Path, left_out: tuple[str, ...]) -> None:
    arrays = {key: value for key, value in content().items() if key not in left_out}
    evidence = read(saved(tmp_path, arrays))
    assert evidence.keypoints_px.shape == (T, len(evidence.keypoint_names), 2)
    assert evidence.scores.shape == (T, len(evidence.keypoint_names))
    assert evidence.joints_m.shape == (T, len(evidence.joint_names), 3)
    write(tmp_path / "copy.npz", evidence)
    assert_same(read(tmp_path / "copy.npz"), evidence)


def test_camera_without_distortion_has_none(tmp_path: Path) -> None:
    arrays = content()
    del arrays["camera_dist"]
    camera = read(saved(tmp_path, arrays)).camera
    assert camera is not None
    np.testing.assert_array_equal(camera.lens.distortion, np.zeros(5))


@pytest.mark.parametrize("frame", ["camera", "camera_root_relative"])
def test_joints_in_the_camera_need_no_extrinsics(tmp_path: Path, frame: str) -> None:
    arrays = content() | {"joints_frame": frame}
    del arrays["world_to_camera"]
    evidence = read(saved(tmp_path, arrays))
    assert evidence.joints_frame == frame
    assert evidence.camera is not None
    assert evidence.camera.path is None


def panning() -> Array:
    """Transforms (T, 4, 4) of a camera that turns and moves."""
    path = np.tile(content()["world_to_camera"], (T, 1, 1))
    path[:, :3, :3] = (
        rotations.matrix(rotations.exp(np.arange(T)[:, None] * [0.0, 0.1, 0.0])) @ path[:, :3, :3]
    )
    path[:, 0, 3] += 0.1 * np.arange(T)
    return path


def test_a_moving_camera_has_a_transform_for_each_frame(tmp_path: Path) -> None:
    evidence = read(saved(tmp_path, content() | {"world_to_camera": panning()}))
    assert evidence.camera is not None
    np.testing.assert_array_equal(evidence.camera.path, panning())
    write(tmp_path / "copy.npz", evidence)
    assert_same(read(tmp_path / "copy.npz"), evidence)


def test_a_still_camera_is_written_as_one_transform(tmp_path: Path) -> None:
    pose = content()["world_to_camera"]
    write(
        tmp_path / "copy.npz",
        read(saved(tmp_path, content() | {"world_to_camera": np.tile(pose, (T, 1, 1))})),
    )
    with np.load(tmp_path / "copy.npz") as copy:
        np.testing.assert_array_equal(copy["world_to_camera"], pose)


def test_the_ground_may_be_unknown_beside_a_path(tmp_path: Path) -> None:
    assert read(saved(tmp_path, content())).ground_known
    evidence = read(saved(tmp_path, content() | {"ground": "unknown"}))
    assert not evidence.ground_known
    write(tmp_path / "copy.npz", evidence)
    assert not read(tmp_path / "copy.npz").ground_known


def test_unseen_landmarks_have_score_zero(tmp_path: Path) -> None:
    arrays = content()
    arrays["keypoints_px"][1, 2] = np.nan
    arrays["keypoint_scores"][1, 2] = np.nan
    arrays["keypoints_px"][2, 0] = np.nan
    evidence = read(saved(tmp_path, arrays))
    assert evidence.scores[1, 2] == 0.0
    assert evidence.scores[2, 0] == 0.0
    assert (evidence.scores > 0).sum() == T * 3 - 2


def changed(key: str, value: Any) -> Callable[[Content], Content]:
    def change(arrays: Content) -> Content:
        old = arrays.get(key)
        return arrays | {key: value(np.array(old)) if callable(value) else value}

    return change


def put(index: Any, number: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(array: np.ndarray) -> np.ndarray:
        array = array.astype(float)
        array[index] = number
        return array

    return change


def without(*keys: str) -> Callable[[Content], Content]:
    return lambda arrays: {key: value for key, value in arrays.items() if key not in keys}


def shorter(arrays: Content) -> Content:
    """A single frame."""
    by_frame = ("times_s", "keypoints_px", "keypoint_scores", "joints_m", "rotations")
    return {key: value[:1] if key in by_frame else value for key, value in arrays.items()}


BAD = {
    "no schema": (without("schema"), "schema", "no such key"),
    "schema of a result": (changed("schema", "simrecon.result/1"), "schema", "simrecon.result/1"),
    "schema is a number": (changed("schema", 1), "schema", "int64"),
    "misspelt key": (changed("mass", 70.0), "mass", "unknown key"),
    "key with a line break": (changed("a\nb", 1.0), "'a\\nb'", "unknown key"),
    "no times": (without("times_s"), "times_s", "no such key"),
    "a single frame": (shorter, "times_s", "a single frame"),
    "decreasing times": (changed("times_s", lambda t: t[::-1]), "times_s", "0.1 then 0.06"),
    "equal times": (changed("times_s", put(2, 1 / 30)), "times_s", "at frame 2"),
    "NaN time": (changed("times_s", put(1, np.nan)), "times_s", "1 NaN of 4"),
    "infinite time": (changed("times_s", put(3, np.inf)), "times_s", "infinite"),
    "times are frame numbers": (changed("times_s", np.arange(T)), "times_s", "median interval of 1 s"),
    "a gap of hours": (changed("times_s", put(3, 7200)), "times_s", "longest of 7199.93 s"),
    "times in two axes": (changed("times_s", lambda t: t[:, None]), "times_s", "shape (4, 1)"),
    "times are text": (changed("times_s", lambda t: t.astype(str)), "times_s", "real numbers"),
    "times are complex": (changed("times_s", lambda t: t + 0j), "times_s", "real numbers"),
    "no frames": (changed("times_s", np.zeros(0)), "times_s", "shape (0,)"),
    "one frame too many": (changed("keypoints_px", np.zeros((T + 1, 3, 2))), "keypoints_px", "T = 4"),
    "landmarks in 3D": (changed("keypoints_px", np.zeros((T, 3, 3))), "keypoints_px", "(T, J, 2)"),
    "more names than landmarks": (changed("keypoint_names", np.array(list("abcd"))), "keypoints_px", "J = 4"),
    "empty landmarks": (changed("keypoint_names", np.array([], dtype=str)), "keypoint_names", "shape (0,)"),
    "names twice": (changed("keypoint_names", np.array(["a", "b", "a"])), "keypoint_names", "once: a"),
    "names are bytes": (changed("joint_names", np.array([b"a", b"b"])), "joint_names", "|S1"),
    "landmarks NaN everywhere": (changed("keypoints_px", put(..., np.nan)), "keypoints_px", "NaN everywhere"),
    "joints NaN everywhere": (changed("joints_m", put(..., np.nan)), "joints_m", "NaN everywhere"),
    "half a landmark": (changed("keypoints_px", put((2, 1, 0), np.nan)), "keypoints_px", "at frame 2"),
    "infinite landmark": (changed("keypoints_px", put((2, 1, 0), np.inf)), "keypoints_px", "infinite"),
    "no scores": (without("keypoint_scores"), "keypoint_scores", "no such key beside"),
    "NaN score": (changed("keypoint_scores", put((0, 0), np.nan)), "keypoint_scores", "1 NaN"),
    "score above 1": (changed("keypoint_scores", put((0, 0), 1.5)), "keypoint_scores", "to 1.5"),
    "negative score": (changed("keypoint_scores", put((0, 0), -0.5)), "keypoint_scores", "-0.5 to"),
    "no landmark counts": (changed("keypoint_scores", np.zeros((T, 3))), "keypoint_scores", "0 at every"),
    "no camera": (without("camera_K", "camera_dist", "world_to_camera"), "camera_K", "without a camera"),
    "extrinsics alone": (without("camera_K"), "camera_K", "no such key"),
    "no image size": (without("image_size_px"), "image_size_px", "without an image size"),
    "negative image size": (changed("image_size_px", np.array([640, -1])), "image_size_px", "-1"),
    "half a pixel": (changed("image_size_px", np.array([640.5, 480])), "image_size_px", "640.5"),
    "camera (3, 4)": (changed("camera_K", np.eye(3, 4)), "camera_K", "shape (3, 4)"),
    "negative focal length": (changed("camera_K", put((0, 0), -500.0)), "camera_K", "-500 and 510"),
    "camera with skew": (changed("camera_K", put((0, 1), 3.0)), "camera_K", "[[fx, 0, cx]"),
    "transposed camera": (changed("camera_K", lambda k: k.T), "camera_K", "[[fx, 0, cx]"),
    "distortion of 4": (changed("camera_dist", np.zeros(4)), "camera_dist", "shape (4,)"),
    "extrinsics (3, 4)": (changed("world_to_camera", lambda p: p[:3]), "world_to_camera", "shape (3, 4)"),
    "mirror as extrinsics": (changed("world_to_camera", np.diag([1.0, 1, -1, 1])), "world_to_camera", "-1"),
    "scaled extrinsics": (changed("world_to_camera", np.diag([2.0, 2, 2, 1])), "world_to_camera", "det 8"),
    "a mirror in a path": (
        changed("world_to_camera", lambda _: panning() * np.where(np.arange(T) == 2, -1, 1)[:, None, None]),
        "world_to_camera",
        "in frame 2",
    ),
    "a path of other frames": (
        changed("world_to_camera", lambda _: panning()[1:]), "world_to_camera", "T = ",
    ),
    "a ground of another word": (changed("ground", "flat"), "ground", "'flat'"),
    "transposed extrinsics": (changed("world_to_camera", lambda p: p.T), "world_to_camera", "last row"),
    "unknown frame": (changed("joints_frame", "body"), "joints_frame", "'camera_root_relative'"),
    "joints in millimetres": (changed("joints_m", lambda x: 1000 * x), "joints_m", "metres"),
    "half a joint": (changed("joints_m", put((3, 1, 2), np.nan)), "joints_m", "at frame 3"),
    "rotations are no unit": (changed("rotations", lambda q: 2 * q), "rotations", "unit quaternions"),
    "rotations are vectors": (changed("rotations", np.zeros((T, 2, 3))), "rotations", "(T, B, 4)"),
    "mass 0": (changed("mass_kg", 0.0), "mass_kg", "found 0"),
    "mass in grams": (changed("mass_kg", 70000.0), "mass_kg", "found 70000"),
    "height in cm": (changed("height_m", 180.0), "height_m", "found 180"),
    "NaN height": (changed("height_m", np.nan), "height_m", "NaN"),
    "two masses": (changed("mass_kg", np.array([70.0, 71.0])), "mass_kg", "shape (2,)"),
    "no betas": (changed("betas", np.zeros(0)), "betas", "shape (0,)"),
    "NaN beta": (changed("betas", np.array([np.nan])), "betas", "NaN"),
    "neither 2D nor 3D": (
        without(*KEYPOINT_KEYS, *JOINT_KEYS),
        "keypoints_px, joints_m", "neither",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files_give_one_clear_line(tmp_path: Path, name: str) -> None:
    change, key, found = BAD[name]
    path = saved(tmp_path, change(content()))
    with pytest.raises(InputError) as error:
        read(path)
    message = str(error.value)
    assert "\n" not in message
    assert message.startswith(f"{path}: {key}: found ")
    assert "; valid: " in message
    assert found in message


def assert_refused(path: Path, *parts: str) -> None:
    with pytest.raises(InputError) as error:
        read(path)
    assert "\n" not in str(error.value)
    assert [part for part in (str(path), *parts) if part not in str(error.value)] == []


def test_missing_file_folder_and_other_files(tmp_path: Path) -> None:
    assert_refused(tmp_path / "none.npz", "No such file")
    assert_refused(tmp_path, "directory")
    text, array, empty = tmp_path / "text.npz", tmp_path / "array.npz", tmp_path / "empty.npz"
    text.write_text("times_s = 1")
    with array.open("wb") as file:
        np.save(file, np.zeros(3))
    empty.touch()
    for path in (text, array, empty):
        assert_refused(path, "no .npz archive")


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_character_that_there_is_not(tmp_path: Path, order: str) -> None:
    given = content()
    names = given["joint_names"].astype(f"{order}U30")
    names.view(f"{order}u4")[3] = 0x7FFFFFFF
    path = saved(tmp_path, {**given, "joint_names": names})
    with pytest.raises(InputError, match=r"joint_names: found .*a character of number 2147483647"):
        read(path)


def test_objects_are_never_unpickled(tmp_path: Path) -> None:
    path = saved(tmp_path, content() | {"betas": np.array([{"a": 1}], dtype=object)})
    assert_refused(path, "betas", "allow_pickle=False")
    member = tmp_path / "raw.npz"
    with zipfile.ZipFile(member, "w") as archive:
        archive.writestr("schema.npy", pickle.dumps("simrecon.evidence/1"))
    assert_refused(member, "schema")


@given(st.data())
def test_damage_is_an_input_error(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.mktemp("damage")
    path = folder / "clip.npz"
    np.savez_compressed(path, **content())
    whole = path.read_bytes()
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    assert_refused(path)
    flipped = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 5))):
        flipped[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(flipped)
    try:
        damaged = read(path)
    except InputError as error:
        refusal = str(error)
    else:  # only bytes that no reader looks at, such as time stamps, were changed
        refusal = ""
        assert_same(damaged, read(saved(folder, content())))
    assert "\n" not in refusal


def test_unknown_names_are_listed_with_the_valid_ones(tmp_path: Path) -> None:
    path = saved(tmp_path, content())
    evidence = read(path)
    valid = {"nose", "left_knee", "right_knee", "left_hip", "right_hip"}
    check_names(evidence, valid, path)
    with pytest.raises(InputError, match=r"joint_names: found unknown left_hip, right_hip; valid: left_knee"):
        check_names(evidence, valid - {"left_hip", "right_hip"}, path)
    with pytest.raises(InputError, match="keypoint_names: found unknown nose"):
        check_names(evidence, valid - {"nose"}, path)


def test_bad_evidence_is_not_written_and_the_old_file_stays(tmp_path: Path) -> None:
    path = saved(tmp_path, content())
    before = path.read_bytes()
    with pytest.raises(InputError, match="mass_kg"):
        write(path, replace(read(path), mass_kg=-1.0))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["clip.npz"]


def test_unwritable_target_leaves_nothing(tmp_path: Path) -> None:
    evidence = read(saved(tmp_path, content()))
    folder = tmp_path / "folder.npz"
    folder.mkdir()
    for target in (tmp_path / "missing" / "clip.npz", folder):
        with pytest.raises(InputError, match=r"cannot be written \(.*\); valid: a writable place"):
            write(target, evidence)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["clip.npz", "folder.npz"]


def test_real_evidence_reads_and_copies(tmp_path: Path, shared_data: Path) -> None:
    paths = sorted((shared_data / "evidence").glob("*.npz"))
    assert len(paths) >= 15
    for path in paths:
        evidence = read(path)
        assert evidence.camera is not None
        assert evidence.scores.any()
        write(tmp_path / "copy.npz", evidence)
        assert_same(read(tmp_path / "copy.npz"), evidence)
