from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, resources
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.smpl import motion as smpl
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Camera, Evidence, Lens
from tests.support import foreign_files as foreign

FPS = foreign.FPS
AT_30 = Options(fps=FPS)
T = foreign.T
K = np.array([[900.0, 0, 640], [0, 900, 360], [0, 0, 1]])


def table() -> dict[str, Any]:
    return resources.toml("models", "body", "smpl.toml")


def wham(folder: Path, **change: Any) -> Path:
    vectors, place = foreign.poses()
    seen, there = foreign.poses(seed=5)
    track = {
        "pose": seen.reshape(T, 72).astype(np.float32),
        "trans": there,
        "pose_world": vectors.reshape(T, 72),
        "trans_world": place,
        "betas": np.tile(np.arange(10.0), (T, 1)),
        "verts": np.zeros((T, 6, 3), np.float32),
        "frame_ids": np.arange(T) + 3,
    }
    track = {key: value for key, value in (track | change).items() if value is not None}
    return foreign.save_joblib(folder / "wham_output.pkl", {0: track}, compress=True)


def params(seed: int, **change: Any) -> dict[str, Any]:
    vectors, place = foreign.poses(seed, joints=22)
    found = {
        "body_pose": vectors[:, 1:].reshape(T, 63),
        "betas": np.zeros((T, 10)),
        "global_orient": vectors[:, 0],
        "transl": place,
    } | change
    return {key: value for key, value in found.items() if value is not None}


def gvhmr(folder: Path, group: str = "smpl_params", **change: Any) -> Path:
    tree = {
        f"{group}_global": params(0, **change),
        f"{group}_incam": params(0),
        "K_fullimg": np.tile(K, (T, 1, 1)),
    }
    return foreign.save_torch(folder / "hmr4d_results.pt", tree)


def gem(folder: Path, **change: Any) -> Path:
    return gvhmr(folder, "body_params", **change)


def tram(folder: Path, **change: Any) -> Path:
    vectors, place = foreign.poses()
    track = {
        "pred_cam": np.zeros((T, 3)),
        "pred_rotmat": rotations.matrix(rotations.exp(vectors)),
        "pred_trans": place[:, None],
        "pred_shape": np.zeros((T, 10)),
        "frame": np.arange(T),
        "img_focal": 900.0,
        "img_center": np.array([640.0, 360.0]),
    } | change
    path = folder / "hps" / "hps_track_0.npy"
    path.parent.mkdir(exist_ok=True)
    holder = np.empty((), dtype=object)
    holder[()] = {key: value for key, value in track.items() if value is not None}
    np.save(path, holder)
    return path


def tram_camera(folder: Path, turn: np.ndarray, place: np.ndarray, world: bool = False) -> None:
    prefix = "world_cam" if world else "pred_cam"
    holder = np.empty((), dtype=object)
    holder[()] = {
        f"{prefix}_R": turn,
        f"{prefix}_T": place,
        "img_focal": np.array([900.0]),
        "img_center": np.array([640.0, 360.0]),
    }
    np.save(folder / "camera.npy", holder)


def prompthmr(folder: Path, **change: Any) -> Path:
    vectors, place = foreign.poses()
    pose = np.concatenate((vectors[:, :22].reshape(T, 66), np.zeros((T, 99))), axis=1)
    track: dict[str, Any] = {
        "smplx_world": {"pose": pose, "shape": np.zeros((T, 10)), "trans": place},
        "frames": np.arange(T),
    }
    track["smplx_world"] |= change
    track["smplx_world"] = {key: value for key, value in track["smplx_world"].items() if value is not None}
    camera = {
        "Rwc": np.tile(np.eye(3), (T, 1, 1)),
        "Twc": np.zeros((T, 3)),
        "img_focal": 900.0,
        "img_center": np.array([640.0, 360.0]),
    }
    tree = {"people": {1: track}, "camera_world": camera, "timings": {}}
    return foreign.save_joblib(folder / "results.pkl", tree)


def amass(folder: Path, **change: Any) -> Path:
    """As AMASS has it: z up."""
    vectors, place = foreign.poses()
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    root = rotations.log(rotations.from_matrix(turn @ rotations.matrix(rotations.exp(vectors[:, 0]))))
    body = np.concatenate((root, vectors[:, 1:22].reshape(T, 63), np.zeros((T, 90))), axis=1)
    tree: dict[str, Any] = {
        "poses": body,
        "trans": _z_up_place(place, "smpl"),
        "betas": np.arange(16.0),
        "gender": "neutral",
        "mocap_framerate": FPS,
    } | change
    path = folder / "walk_poses.npz"
    np.savez(path, **{key: value for key, value in tree.items() if value is not None})
    return path


def _z_up_place(place: np.ndarray, model: str) -> np.ndarray:
    """The translation that puts the pelvis where it is in the world with y up."""
    pelvis = np.array(table()[model]["pelvis"])
    return foreign.y_to_z(place + pelvis) - pelvis


def amass_x(folder: Path, **change: Any) -> Path:
    with np.load(amass(folder)) as given:
        whole = dict(given)
    _, place = foreign.poses()
    tree = {
        "root_orient": whole["poses"][:, :3],
        "pose_body": whole["poses"][:, 3:66],
        "pose_jaw": np.zeros((T, 3)),
        "trans": _z_up_place(place, "smplx"),
        "betas": np.zeros(16),
        "mocap_frame_rate": FPS,
        "surface_model_type": "smplx",
        "gender": "neutral",
    } | change
    path = folder / "walk_stageii.npz"
    np.savez(path, **{key: value for key, value in tree.items() if value is not None})
    return path


def plain(folder: Path, **change: Any) -> Path:
    vectors, place = foreign.poses()
    tree: dict[str, Any] = {
        "global_orient": vectors[:, 0],
        "body_pose": vectors[:, 1:].reshape(T, 69),
        "transl": place,
        "betas": np.zeros((1, 10)),
        "fps": FPS,
    } | change
    path = folder / "motion.npz"
    np.savez(path, **{key: value for key, value in tree.items() if value is not None})
    return path


# writer, options, model, joints, title
LAYOUTS: dict[str, tuple[Callable[..., Path], Options, str, int]] = {
    "WHAM": (wham, AT_30, "smpl", 24),
    "GVHMR": (gvhmr, AT_30, "smplx", 22),
    "GEM/GENMO": (gem, AT_30, "smplx", 22),
    "PromptHMR": (prompthmr, AT_30, "smplx", 22),
    "AMASS": (amass, Options(), "smpl", 22),
    "AMASS SMPL-X": (amass_x, Options(), "smplx", 22),
    "SMPL/SMPL-X parameters": (plain, Options(), "smpl", 24),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_round_trip_in_a_world_with_z_up(tmp_path: Path, layout: str) -> None:
    write, options, model, joints = LAYOUTS[layout]
    found = evidence.read(write(tmp_path), options)
    vectors, place = foreign.poses()
    wanted = foreign.y_to_z(foreign.smpl_joints(table(), model, vectors[:, :joints], place))
    assert found.joint_names == smpl.names()[:joints]
    assert found.joints_frame == "world"
    np.testing.assert_allclose(found.joints_m, wanted, atol=1e-6)
    assert "without the twist of their bones" in found.reading
    np.testing.assert_allclose(np.diff(found.times_s), 1 / FPS, atol=1e-12)
    assert found.reading.startswith(layout.removesuffix(" SMPL-X"))
    assert "up " in found.reading
    assert len(found.sha256) == 64


def test_wham_keeps_frame_numbers(tmp_path: Path) -> None:
    found = evidence.read(wham(tmp_path), AT_30)
    np.testing.assert_allclose(found.times_s, (np.arange(T) + 3) / FPS)


@pytest.mark.parametrize("write", [wham, gvhmr])
def test_the_camera_frame_can_be_asked_for(tmp_path: Path, write: Callable[..., Path]) -> None:
    found = evidence.read(write(tmp_path), replace(AT_30, frame="camera"))
    seed, model, joints = (5, "smpl", 24) if write is wham else (0, "smplx", 22)
    vectors, place = foreign.poses(seed, joints=joints)
    wanted = foreign.smpl_joints(table(), model, vectors, place)
    assert found.joints_frame == "camera"
    np.testing.assert_allclose(found.joints_m, wanted, atol=1e-6)


def test_gvhmr_gives_its_lens_while_the_camera_stands(tmp_path: Path) -> None:
    still = evidence.read(gvhmr(tmp_path), replace(AT_30, landmarks=True))
    assert still.camera is not None
    np.testing.assert_allclose(still.camera.lens.matrix_px, K)
    assert still.camera.lens.image_size_px == (1280, 720)
    assert still.camera.path is None
    assert still.ground_known


def test_tram_without_a_camera_file_is_in_the_camera(tmp_path: Path) -> None:
    found = evidence.read(tram(tmp_path), AT_30)
    vectors, place = foreign.poses()
    assert found.joints_frame == "camera"
    np.testing.assert_allclose(
        found.joints_m, foreign.smpl_joints(table(), "smpl", vectors, place), atol=1e-6
    )
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.lens.matrix_px, K)


@pytest.mark.parametrize("world", [False, True])
def test_tram_with_a_moving_camera(tmp_path: Path, world: bool) -> None:
    path = tram(tmp_path)
    turn = rotations.matrix(rotations.exp(np.linspace(0, 0.5, T)[:, None] * [0.0, 1.0, 0.0]))
    move = np.linspace(0, 1, T)[:, None] * [0.2, 0.0, 0.1]
    tram_camera(tmp_path, turn, move, world)
    found = evidence.read(path, AT_30)
    vectors, place = foreign.poses()
    seen = foreign.smpl_joints(table(), "smpl", vectors, place)
    wanted = np.einsum("tij,tkj->tki", turn, seen) + move[:, None]
    assert found.joints_frame == ("world" if world else "camera")
    np.testing.assert_allclose(found.joints_m, foreign.y_to_z(wanted) if world else wanted, atol=1e-6)
    if not world:
        assert found.camera is None
        assert (
            "the camera moves, so its lens is not used (the file has no world that is level)" in found.reading
        )


# --- cameras that are carried

WITH_LENS = replace(AT_30, camera=Camera(Lens(K, np.zeros(5), (1280, 720))))


@dataclass(frozen=True)
class Pan:
    """A person in the world and before a camera that pans, as `foreign.carried` has them."""

    model: str
    joints: int
    jitter_m: float = 0.0

    def sets(self) -> tuple[np.ndarray, ...]:
        """World rotations and places, the camera's axes and places, rotations and places that it sees."""
        vectors, place = foreign.poses(joints=self.joints)
        axes, places, seen, there = foreign.carried(vectors, place, np.array(table()[self.model]["pelvis"]))
        noise = self.jitter_m * np.random.default_rng(1).normal(size=(T, 3))
        return (
            vectors,
            place,
            axes,
            places + noise,
            seen,
            there - (np.swapaxes(axes, 1, 2) @ noise[..., None])[..., 0],
        )


def panned_wham(folder: Path, jitter_m: float = 0.0) -> Path:
    vectors, place, _, _, seen, there = Pan("smpl", 24, jitter_m).sets()
    flat = {"pose": seen.reshape(T, 72), "pose_world": vectors.reshape(T, 72)}
    return wham(folder, trans=there, trans_world=place, **flat)


def panned_gvhmr(folder: Path, jitter_m: float = 0.0, group: str = "smpl_params") -> Path:
    vectors, place, _, _, seen, there = Pan("smplx", 22, jitter_m).sets()
    tree: dict[str, Any] = {"K_fullimg": np.tile(K, (T, 1, 1))}
    for name, root, where in (("global", vectors[:, 0], place), ("incam", seen[:, 0], there)):
        tree[f"{group}_{name}"] = params(0, global_orient=root, transl=where)
    return foreign.save_torch(folder / "hmr4d_results.pt", tree)


def panned_gem(folder: Path, jitter_m: float = 0.0) -> Path:
    return panned_gvhmr(folder, jitter_m, "body_params")


def panned_tram(folder: Path, jitter_m: float = 0.0) -> Path:
    _, _, axes, places, seen, there = Pan("smpl", 24, jitter_m).sets()
    tram_camera(folder, axes, places, world=True)
    return tram(folder, pred_rotmat=rotations.matrix(rotations.exp(seen)), pred_trans=there[:, None])


def panned_prompthmr(folder: Path, jitter_m: float = 0.0, **seen_change: Any) -> Path:
    vectors, place, axes, places, seen, there = Pan("smplx", 22, jitter_m).sets()
    hands = np.zeros((T, 99))
    world = {"pose": np.concatenate((vectors.reshape(T, 66), hands), axis=1), "trans": place}
    camera = {"pose": np.concatenate((seen.reshape(T, 66), hands), axis=1), "trans": there} | seen_change
    track = {"smplx_world": world, "smplx_cam": camera, "frames": np.arange(T)}
    film = {"Rwc": axes, "Twc": places, "img_focal": 900.0, "img_center": np.array([640.0, 360.0])}
    return foreign.save_joblib(folder / "results.pkl", {"people": {1: track}, "camera_world": film})


PANNED: dict[str, tuple[Callable[..., Path], Pan]] = {
    "WHAM": (panned_wham, Pan("smpl", 24)),
    "GVHMR": (panned_gvhmr, Pan("smplx", 22)),
    "GEM": (panned_gem, Pan("smplx", 22)),
    "TRAM": (panned_tram, Pan("smpl", 24)),
    "PromptHMR": (panned_prompthmr, Pan("smplx", 22)),
}


@pytest.mark.parametrize("layout", PANNED)
def test_a_path_brings_the_world_to_what_the_camera_sees(tmp_path: Path, layout: str) -> None:
    write, pan = PANNED[layout]
    seen = evidence.read(write(tmp_path), WITH_LENS if layout == "WHAM" else AT_30)
    _, _, _, _, vectors, place = pan.sets()
    expected = foreign.smpl_joints(table(), pan.model, vectors, place)
    assert seen.joints_frame == "world"
    assert seen.camera is not None
    np.testing.assert_allclose(cameras.to_camera(seen.camera, seen.joints_m), expected, atol=1e-6)
    np.testing.assert_allclose(seen.camera.lens.matrix_px, K)
    assert not seen.ground_known
    assert "along the path in the file" in seen.reading


@pytest.mark.parametrize("layout", PANNED)
def test_a_path_that_jumps_is_left_out(tmp_path: Path, layout: str) -> None:
    seen = evidence.read(PANNED[layout][0](tmp_path, 0.3), WITH_LENS if layout == "WHAM" else AT_30)
    assert seen.ground_known
    assert "its path jumps by" in seen.reading
    if layout == "WHAM":  # the user's lens
        assert seen.camera is not None
        assert seen.camera.path is None
        assert "taken for still" in seen.reading
    else:
        assert seen.camera is None
        assert "its lens is not used" in seen.reading


def test_a_path_that_is_not_where_the_person_is_seen_is_left_out(tmp_path: Path) -> None:
    _, _, _, _, _, there = Pan("smplx", 22).sets()
    aside = evidence.read(panned_prompthmr(tmp_path, trans=there + np.array([0.3, 0.0, 0.0])), AT_30)
    assert aside.camera is None
    assert "the person in the camera's frame is 0.30 m off" in aside.reading


def test_a_path_with_the_person_behind_it_is_left_out(tmp_path: Path) -> None:
    vectors, place, axes, places, _, _ = Pan("smplx", 22).sets()
    pose = np.concatenate((vectors.reshape(T, 66), np.zeros((T, 99))), axis=1)
    track = {"smplx_world": {"pose": pose, "trans": place}, "frames": np.arange(T)}
    around = axes @ np.diag([-1.0, 1.0, -1.0])
    film = {"Rwc": around, "Twc": places, "img_focal": 900.0, "img_center": np.array([640.0, 360.0])}
    path = foreign.save_joblib(tmp_path / "results.pkl", {"people": {1: track}, "camera_world": film})
    seen = evidence.read(path, AT_30)
    assert seen.camera is None
    assert "the person is behind it in 100 % of the frames" in seen.reading


def test_without_a_lens_a_path_is_of_no_use(tmp_path: Path) -> None:
    assert evidence.read(panned_wham(tmp_path), AT_30).camera is None


def test_a_camera_that_hardly_moves_is_placed_by_landmarks_where_there_are_any(tmp_path: Path) -> None:
    vectors, place = foreign.poses()
    pelvis = np.array(table()["smpl"]["pelvis"])
    _, _, seen, there = foreign.carried(vectors, place, pelvis, pan_rad=0.05, move_m=0.02)
    flat = {"pose": seen.reshape(T, 72), "pose_world": vectors.reshape(T, 72)}
    still = evidence.read(wham(tmp_path, trans=there, trans_world=place, **flat), WITH_LENS)
    assert still.camera is not None
    assert still.camera.path is not None
    assert "along the path in the file" in still.reading
    by_landmarks = evidence.read(
        wham(tmp_path, trans=there, trans_world=place, **flat), replace(WITH_LENS, landmarks=True)
    )
    assert by_landmarks.camera is not None
    assert by_landmarks.camera.path is None
    assert by_landmarks.ground_known


def test_smpl_joints_of_a_rest_pose_are_those_of_the_table() -> None:
    motion = smpl.SmplMotion(
        "smpl", "world", np.arange(2.0), np.tile([1.0, 0, 0, 0], (2, 24, 1)), np.zeros((2, 3))
    )
    places = smpl.joints_m(motion)[0]
    at = dict(zip(smpl.names(), places, strict=True))
    np.testing.assert_allclose(at["left_wrist"] * [-1, 1, 1], at["right_wrist"])
    assert 1.2 < at["head"][1] - at["left_ankle"][1] < 1.6


def test_files_without_a_frame_rate_ask_for_one(tmp_path: Path) -> None:
    assert_refused(wham(tmp_path), Options(), "frame rate", "--fps")
    by_video = evidence.read(wham(tmp_path), Options(video_fps=60.0))
    np.testing.assert_allclose(np.diff(by_video.times_s), 1 / 60)
    own = evidence.read(amass(tmp_path), Options(video_fps=60.0))
    np.testing.assert_allclose(np.diff(own.times_s), 1 / FPS)


def test_up_is_found_or_asked_for(tmp_path: Path) -> None:
    vectors, _ = foreign.poses()
    lying = vectors.copy()
    lying[:, 0] = [0.0, 0.0, np.pi / 2]
    path = plain(tmp_path, global_orient=lying[:, 0])
    assert_refused(path, Options(), "up axis", "--up x, y, z, -x, -y, -z")
    leaning = plain(tmp_path, global_orient=lying[:, 0] * np.linspace(0, 1, T)[:, None])
    assert_refused(leaning, Options(), "up axis: found a person who is upright along y in 50 % of the frames")
    asked = evidence.read(path, Options(up="y"))
    assert "up y (as given)" in asked.reading
    other = evidence.read(wham(tmp_path), replace(AT_30, up="z"))
    vectors, place = foreign.poses()
    np.testing.assert_allclose(
        other.joints_m, foreign.smpl_joints(table(), "smpl", vectors, place), atol=1e-6
    )


def people(folder: Path) -> Path:
    vectors, place = foreign.poses()
    tracks = {
        i: {
            "pose_world": vectors.reshape(T, 72),
            "trans_world": place + i,
            "betas": np.zeros(10),
            "frame_ids": np.arange(T),
        }
        for i in range(2)
    }
    return foreign.save_joblib(folder / "wham_output.pkl", tracks)


def test_of_several_people_one_is_asked_for(tmp_path: Path) -> None:
    path = people(tmp_path)
    assert_refused(path, AT_30, "people: found 2: 0 (12 frames), 1 (12 frames)", "--person")
    assert_refused(path, replace(AT_30, person="7"), "found '7'", "valid: 0 (12 frames), 1 (12 frames)")
    first, second = (evidence.read(path, replace(AT_30, person=name)) for name in "01")
    np.testing.assert_allclose(
        second.joints_m - first.joints_m, np.broadcast_to([1.0, -1, 1], first.joints_m.shape)
    )
    assert "person 1 of 2" in second.reading


def assert_refused(path: Path, options: Options, *parts: str) -> None:
    with pytest.raises(InputError) as error:
        evidence.read(path, options)
    message = str(error.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    assert [part for part in (*parts, "valid: ") if part not in message] == []


def nan(shape: tuple[int, ...]) -> np.ndarray:
    values = np.zeros(shape)
    values.flat[1] = np.nan
    return values


BAD: dict[str, tuple[Callable[..., Path], dict[str, Any], Options, str]] = {
    "WHAM, missing key": (wham, {"trans_world": None}, AT_30, "0.trans_world: found no such key"),
    "WHAM, wrong rank": (wham, {"pose_world": np.zeros(72)}, AT_30, "0.pose_world: found shape (72,)"),
    "WHAM, too few": (wham, {"pose_world": np.zeros((T, 66))}, AT_30, "0.pose_world: found shape (12, 66)"),
    "WHAM, NaN": (wham, {"pose_world": nan((T, 72))}, AT_30, "0.pose_world: found 1 NaN"),
    "WHAM, frames of another length": (wham, {"frame_ids": np.arange(T + 1)}, AT_30, "0.frame_ids"),
    "WHAM, frames back": (wham, {"frame_ids": np.arange(T)[::-1]}, AT_30, "11 then 10"),
    "GVHMR, missing key": (gvhmr, {"body_pose": None}, AT_30, "smpl_params_global.body_pose"),
    "GVHMR, wrong rank": (
        gvhmr,
        {"transl": np.zeros(3)},
        AT_30,
        "smpl_params_global.transl: found shape (3,)",
    ),
    "GVHMR, NaN": (gvhmr, {"transl": nan((T, 3))}, AT_30, "smpl_params_global.transl: found 1 NaN"),
    "GEM, NaN": (gem, {"global_orient": nan((T, 3))}, AT_30, "body_params_global.global_orient: found 1 NaN"),
    "GEM, missing key": (gem, {"transl": None}, AT_30, "body_params_global.transl"),
    "TRAM, missing key": (tram, {"pred_trans": None}, AT_30, "pred_trans: found no such key"),
    "TRAM, wrong rank": (
        tram,
        {"pred_rotmat": np.zeros((T, 72))},
        AT_30,
        "pred_rotmat: found shape (12, 72)",
    ),
    "TRAM, no rotations": (tram, {"pred_rotmat": np.zeros((T, 24, 3, 3))}, AT_30, "rotation matrices"),
    "TRAM, NaN": (tram, {"pred_trans": nan((T, 1, 3))}, AT_30, "pred_trans: found 1 NaN"),
    "TRAM, no world": (tram, {}, replace(AT_30, frame="world"), "camera.npy: found none"),
    "PromptHMR, missing key": (prompthmr, {"trans": None}, AT_30, "people.1.smplx_world.trans"),
    "PromptHMR, wrong rank": (prompthmr, {"pose": np.zeros((T, 30))}, AT_30, "people.1.smplx_world.pose"),
    "PromptHMR, NaN": (prompthmr, {"trans": nan((T, 3))}, AT_30, "people.1.smplx_world.trans: found 1 NaN"),
    "AMASS, wrong rank": (amass, {"poses": np.zeros((T, 100))}, Options(), "poses: found shape (12, 100)"),
    "AMASS, NaN": (amass, {"trans": nan((T, 3))}, Options(), "trans: found 1 NaN"),
    "AMASS, missing key": (amass, {"trans": None}, Options(), "of no known format"),
    "AMASS, no rate": (amass, {"mocap_framerate": -1.0}, Options(), "mocap_framerate: found -1"),
    "AMASS, a single frame": (
        amass,
        {"poses": np.zeros((1, 156)), "trans": np.zeros((1, 3))},
        Options(),
        "a single frame",
    ),
    "SMPL, lengths differ": (
        plain,
        {"transl": np.zeros((T + 1, 3))},
        Options(),
        "transl: found shape (13, 3)",
    ),
    "SMPL, text": (plain, {"transl": np.full((T, 3), "a")}, Options(), "transl: found values of type <U1"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_give_one_clear_line(tmp_path: Path, name: str) -> None:
    write, change, options, found = BAD[name]
    assert_refused(write(tmp_path, **change), options, found)


def test_nobody_in_a_file(tmp_path: Path) -> None:
    path = foreign.save_joblib(tmp_path / "results.pkl", {"people": {}, "camera_world": {}})
    assert_refused(path, AT_30, "people: found no person")
    path = foreign.save_joblib(tmp_path / "results.pkl", {"people": {"1": "text"}, "camera_world": {}})
    assert_refused(path, AT_30, "people.1: found a str")


def test_an_array_of_one_object_is_no_list_of_people(tmp_path: Path) -> None:
    np.savez(tmp_path / "odd.npz", poses=np.array({"a": 1}, dtype=object))
    with pytest.raises(InputError, match="of no known format"):
        evidence.read(tmp_path / "odd.npz")


def test_what_is_read_can_be_written_and_read(tmp_path: Path) -> None:
    found = evidence.read(wham(tmp_path), AT_30)
    evidence.write(tmp_path / "copy.npz", found)
    copy: Evidence = evidence.read(tmp_path / "copy.npz")
    np.testing.assert_allclose(copy.joints_m, found.joints_m, atol=1e-12)
    assert copy.joint_names == found.joint_names
