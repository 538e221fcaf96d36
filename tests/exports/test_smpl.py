"""SMPL's tree: the joints where the person has them, and the layouts that other tools load."""

from __future__ import annotations

import io
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, exports
from simrecon.evidence.smpl import motion as tree
from simrecon.exports import legs, protomotions, segments, smpl, smpl_body, smplx
from simrecon.exports.axes import LOCAL
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.io.pickles import loads
from simrecon.io.pickles.torch_files import archive_pickle
from simrecon.types import Array, Skeleton
from tests.support.runs import person, squat

NAMES = smpl.NAMES
SHARED = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")


def smpl_skeleton(model: str = "smpl") -> Skeleton:
    """Our skeleton with the joint centres of SMPL's average body."""
    skeleton, offset = person().skeleton, dict(zip(NAMES, tree.offsets_m(model), strict=True))
    found = {
        "spine": offset["spine1"],
        "chest": offset["spine2"],
        "neck": offset["spine3"] + offset["neck"],
        "head": offset["head"],
    }
    for side in legs.SIDES:
        collar = offset["spine3"] + offset[f"{side}_collar"]
        found |= {f"{side}_{joint}": offset[f"{side}_{joint}"] for joint in SHARED}
        found[f"{side}_shoulder"] = collar + offset[f"{side}_shoulder"]
    rows = [np.zeros(3), *(LOCAL.T @ found[name] for name in skeleton.names[1:])]
    return replace(skeleton, offsets_m=np.array(rows))


def moved(skeleton: Skeleton, rng: np.random.Generator, frames: int = 30) -> Array:
    """Configurations anywhere within most of the joints' ranges, turned about all axes."""
    low, high = np.moveaxis(skeleton.limits_rad, -1, 0)
    middle = 0.7 * (low + (high - low) * rng.uniform(size=(frames, 16, 3)))
    root = rotations.canonical(rng.normal(size=(frames, 1, 4)))
    quats = np.concatenate((root, rotations.exp(middle)), axis=1)
    return np.concatenate((rng.normal(size=(frames, 3)), quats.reshape(frames, -1)), axis=1)


@pytest.mark.parametrize("model", ["smpl", "smplx"])
def test_on_a_body_like_smpls_joints_are_where_they_were(model: str, rng: np.random.Generator) -> None:
    """Within 5 mm, in any pose: axes, order of quaternions and rest pose all fit together."""
    skeleton = smpl_skeleton(model)
    posed = segments.of(skeleton, moved(skeleton, rng))
    still = np.zeros((30, 2), dtype=bool)
    pose = smpl.pose(skeleton, posed, smpl_body.average(model), still, -10.0, 1 / 30)
    read = tree.SmplMotion(model, "world", np.arange(30.0), rotations.exp(pose.rotvecs), pose.trans_m)
    places = tree.joints_m(read)
    for row, name in enumerate(skeleton.names):
        joint = {"spine": "spine1", "chest": "spine2"}.get(name, name)
        off = np.linalg.norm(places[:, NAMES.index(joint)] - posed.origins_m[:, row], axis=-1)
        assert off.max() < 5e-3, name


def test_feet_stay_on_a_body_of_other_proportions() -> None:
    body = person()
    qpos = squat(body, np.linspace(0.0, 0.9, 40))
    posed = segments.of(body.skeleton, qpos)
    for scale in (0.9, 1.0, 1.15):
        average = smpl_body.average("smpl", scale)
        pose = smpl.pose(body.skeleton, posed, average, np.ones((40, 2), dtype=bool), 0.0, 1 / 30)
        for side in legs.SIDES:
            ankle = pose.places_m[:, NAMES.index(f"{side}_ankle")]
            before = posed.origins_m[:, body.skeleton.names.index(f"{side}_ankle")]
            np.testing.assert_allclose(ankle, before, atol=1e-6)
            turn = rotations.multiply(pose.quats, rotations.from_matrix(LOCAL))
            own = posed.quats[:, body.skeleton.names.index(f"{side}_ankle")]
            assert rotations.angle_between(turn[:, NAMES.index(f"{side}_foot")], own).max() < 1e-6


@pytest.mark.parametrize(("name", "model"), [("amass", "smpl"), ("smplx", "smplx")])
def test_own_reader_finds_the_same_joints(
    finished: Path, view: ResultView, tmp_path: Path, name: str, model: str
) -> None:
    (path,) = exports.export(finished, (name,), tmp_path)
    found = evidence.read(path)
    np.testing.assert_allclose(found.times_s, view.times_s - view.times_s[0], atol=1e-6)
    average = smpl_body.average(model) if name == "amass" else smplx.of_height(view.body.height_m)
    scale = 1.0 + average.betas[0] * 0.1 / 1.66
    pose = smpl.of_view(view, average)
    ankle = pose.places_m[:, NAMES.index("left_ankle")] - pose.places_m[:, :1].mean(axis=1)
    theirs = found.joints_m - found.joints_m[:, found.joint_names.index("pelvis")][:, None]
    np.testing.assert_allclose(scale * theirs[:, found.joint_names.index("left_ankle")], ankle, atol=1e-6)


def test_layout_of_amass(finished: Path, view: ResultView, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("amass",), tmp_path)
    with np.load(path, allow_pickle=False) as file:
        count = len(view.times_s)
        assert file["poses"].shape == (count, 156)
        assert not file["poses"][:, 66:].any()
        assert file["trans"].shape == (count, 3)
        assert file["betas"].shape == (16,)
        assert str(file["gender"]) == "neutral"
        assert float(file["mocap_framerate"]) == pytest.approx(view.rate_hz)
        assert file["trans"][:, 2].mean() > 0.5  # z is up
        upright = rotations.rotate(rotations.exp(file["poses"][:, :3]), [0.0, 1.0, 0.0])
        assert upright[:, 2].min() > 0.8


def test_layout_of_gmr(finished: Path, view: ResultView, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("smplx",), tmp_path, fps=60.0)
    with np.load(path, allow_pickle=False) as file:
        count = file["pose_body"].shape[0]
        assert file["pose_body"].shape == (count, 63)
        assert file["root_orient"].shape == file["trans"].shape == (count, 3)
        assert file["betas"].shape == (16,)
        assert file["mocap_frame_rate"].item() == pytest.approx(60.0)
        assert 1.66 + 0.1 * file["betas"][0] == pytest.approx(view.body.height_m)
        assert str(file["gender"]) == "neutral"


@pytest.fixture
def state(finished: Path, tmp_path: Path) -> dict[str, Any]:
    (path,) = exports.export(finished, ("protomotions",), tmp_path)
    assert path.name == "protomotions.motion"
    raw, storages = archive_pickle(path.name, zipfile.ZipFile(io.BytesIO(path.read_bytes())))
    found = loads(path.name, raw, storages)
    return {key: np.asarray(value) for key, value in found.items()}


def test_layout_of_protomotions(state: dict[str, Any], view: ResultView) -> None:
    count = len(view.times_s)
    shapes = {
        "rigid_body_pos": (count, 24, 3),
        "rigid_body_rot": (count, 24, 4),
        "rigid_body_vel": (count, 24, 3),
        "rigid_body_ang_vel": (count, 24, 3),
        "dof_pos": (count, 69),
        "dof_vel": (count, 69),
        "local_rigid_body_rot": (count, 24, 4),
        "rigid_body_contacts": (count, 24),
    }
    assert set(state) == {"fps", *shapes}
    for key, shape in shapes.items():
        assert state[key].shape == shape, key
        assert state[key].dtype == (np.bool_ if key == "rigid_body_contacts" else np.float32), key
    assert float(state["fps"]) == pytest.approx(view.rate_hz)


def test_protomotions_bodies_have_our_axes_and_true_contacts(state: dict[str, Any], view: ResultView) -> None:
    order = list(protomotions.BODIES)
    names = view.body.skeleton.names
    for body, segment in (("Pelvis", "pelvis"), ("L_Ankle", "left_ankle"), ("Head", "head")):
        wxyz = state["rigid_body_rot"][:, order.index(body)][:, [3, 0, 1, 2]].astype(float)
        off = rotations.angle_between(rotations.canonical(wxyz), view.segments.quats[:, names.index(segment)])
        assert off.max() < 2e-3
    foot = state["rigid_body_pos"][:, order.index("R_Ankle")]
    row = names.index("right_ankle")
    off = np.linalg.norm(foot - view.segments.origins_m[:, row], axis=-1)
    assert off[view.touching[:, row]].max() < 1e-5  # a foot that stands
    assert off.max() < 5e-3
    touching = view.touching[:, names.index("left_ankle")]
    np.testing.assert_array_equal(state["rigid_body_contacts"][:, order.index("L_Toe")], touching)
    assert touching.any()
    assert not state["rigid_body_contacts"][:, order.index("Head")].any()


def test_protomotions_state_is_consistent(state: dict[str, Any]) -> None:
    local = rotations.canonical(state["local_rigid_body_rot"][..., [3, 0, 1, 2]].astype(float))
    world = rotations.canonical(state["rigid_body_rot"][..., [3, 0, 1, 2]].astype(float))
    for body, parent in enumerate(protomotions.PARENTS):
        own = local[:, body] if parent < 0 else rotations.multiply(world[:, parent], local[:, body])
        assert rotations.angle_between(own, world[:, body]).max() < 2e-3
    turns = rotations.exp(state["dof_pos"].reshape(len(local), 23, 3).astype(float))
    assert rotations.angle_between(turns, local[:, 1:]).max() < 2e-3
    steps = np.diff(state["rigid_body_pos"].astype(float), axis=0) * float(state["fps"])
    mean = 0.5 * (state["rigid_body_vel"][1:] + state["rigid_body_vel"][:-1])
    assert np.abs(steps - mean).max() < 0.2


def test_layout_of_holosoma(finished: Path, view: ResultView, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("holosoma",), tmp_path)
    with np.load(path, allow_pickle=False) as file:
        places, names = file["global_joint_positions"], file["joint_names"].tolist()
        assert places.shape == (len(view.times_s), 22, 3)
        assert float(file["height"]) == pytest.approx(view.body.height_m)
    row = view.body.skeleton.names.index("left_ankle")
    off = np.linalg.norm(places[:, names.index("left_ankle")] - view.segments.origins_m[:, row], axis=-1)
    assert off[view.touching[:, row]].max() < 1e-5  # a foot that stands
    assert off.max() < 5e-3


def test_torch_opens_protomotions(finished: Path, tmp_path: Path) -> None:
    """As their motion library does, without running what a pickle may hold."""
    torch = pytest.importorskip("torch", reason="ProtoMotions' files are opened with torch")
    (path,) = exports.export(finished, ("protomotions",), tmp_path, fps=30.0)
    state = torch.load(path, weights_only=True)
    assert float(state["fps"]) == pytest.approx(30.0)
    frames = len(state["rigid_body_pos"])
    for key, value in state.items():
        if key != "fps":
            assert value.shape[0] == frames, key
            assert value.dtype == (torch.bool if key == "rigid_body_contacts" else torch.float32), key
            assert value.is_contiguous(), key
    lengths = state["rigid_body_rot"].norm(dim=-1)
    assert float((lengths - 1.0).abs().max()) < 1e-5
