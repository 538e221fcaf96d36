"""What every set of markers or keypoints that is known by name gives of a body whose joints are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence, kinematics
from simrecon import plan as plans
from simrecon.body import shape, stature_m
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.mocap.labels import table
from simrecon.types import Evidence, Scene
from tests.support import foreign_files as foreign
from tests.support import walker

MARKERS, JOINTS = walker.sets("markers"), walker.sets("joints")
TOLERANCE_M = {"hip": 0.003, "knee": 0.008, "ankle": 0.012, "heel": 0.012, "toe": 0.015, "shoulder": 0.006}
TOLERANCE_M |= {"elbow": 0.02, "wrist": 0.031, "neck": 0.012, "head_top": 0.012, "mtp": 0.03}


def read(
    folder: Path, labels: list[str], places: np.ndarray, options: Options | None = None, unit: str = "m"
) -> Evidence:
    path = folder / "clip.trc"
    path.write_text(foreign.trc(labels, places, unit))
    return evidence.read(path, options or Options())


def errors_m(found: Evidence, joints: dict[str, np.ndarray]) -> dict[str, float]:
    """Largest mean distance of each kind of point from the true one."""
    worst: dict[str, float] = {}
    for k, name in enumerate(found.joint_names):
        if name in joints:
            off = np.linalg.norm(found.joints_m[:, k] - foreign.y_to_z(joints[name]), axis=-1).mean()
            kind = name.removeprefix("left_").removeprefix("right_")
            worst[kind] = max(worst.get(kind, 0.0), float(off))
    return worst


@pytest.mark.parametrize("name", MARKERS)
def test_markers_give_the_joints(tmp_path: Path, name: str) -> None:
    joints, skin = walker.body()
    names = MARKERS[name]
    found = read(tmp_path, *walker.labelled(skin, names))
    off = errors_m(found, joints)
    assert {kind: round(error, 3) for kind, error in off.items() if error > TOLERANCE_M[kind]} == {}
    wanted = {"hip", "knee", "ankle"} | ({"shoulder"} if "acromion" in names else set())
    wanted |= {"elbow"} if "elbow_lateral" in names else set()
    wanted |= {"head_top"} if {"vertex", "head_front"} & set(names) else set()
    wanted |= {"heel", "toe"}
    assert wanted <= set(off)
    assert " markers (by " in found.reading
    assert found.trust == "mocap"


@pytest.mark.parametrize("name", JOINTS)
def test_keypoints_are_the_joints(tmp_path: Path, name: str) -> None:
    joints, _ = walker.body()
    names = JOINTS[name]
    found = read(tmp_path, *walker.labelled(joints, names))
    off = errors_m(found, joints)
    assert max(error for kind, error in off.items() if kind not in ("heel", "toe")) < 1e-5
    assert max(off.get("heel", 0.0), off.get("toe", 0.0)) < 0.005
    assert set(names) - {"nose"} <= set(off) | {"head"}
    assert " joints (by " in found.reading
    assert found.trust == "mocap"


@pytest.mark.parametrize(
    ("kind", "name"),
    [("markers", "Plug-in Gait"), ("markers", "Helen Hayes"), ("joints", "HALPE_26"), ("joints", "simrecon")],
)
@pytest.mark.parametrize("height_m", [1.55, 1.9])
def test_stature_of_a_body_of_known_height(tmp_path: Path, kind: str, name: str, height_m: float) -> None:
    joints, skin = walker.body(height_m, frames=24)
    labels, places = walker.labelled(skin if kind == "markers" else joints, walker.sets(kind)[name])
    found = read(tmp_path, labels, places)
    thinned = replace(
        found,
        times_s=found.times_s[::2],
        joints_m=found.joints_m[::2],
        keypoints_px=found.keypoints_px[::2],
        scores=found.scores[::2],
    )
    fit = kinematics.fit(thinned, Scene(), plans.read("quick").kinematics)
    assert stature_m(fit.body.skeleton) == pytest.approx(height_m, rel=0.02)


@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_knees_without_markers_follow_from_how_the_bones_move_and_ankles_from_the_feet(
    tmp_path: Path, noise_m: float
) -> None:
    joints, skin = walker.body()
    labels, places = walker.labelled(skin, MARKERS["OpenSim Gait2392, walking"])
    places = places + noise_m * np.random.default_rng(1).normal(size=places.shape)
    found = read(tmp_path, labels, places)
    off = errors_m(found, joints)
    assert off["knee"] < 0.005 + 5 * noise_m
    assert off["ankle"] < 0.008 + 2 * noise_m
    assert (
        "left_ankle, right_ankle, head_top; found by how the bones move: left_knee, right_knee;"
        in found.reading
    )


def test_bones_that_stand_still_tell_no_joint(tmp_path: Path) -> None:
    _, skin = walker.body()
    labels, places = walker.labelled(skin, MARKERS["OpenSim Gait2392, walking"])
    places[:] = places[:1]
    with pytest.raises(InputError, match="none that give left_knee"):
        read(tmp_path, labels, places)


def test_the_kind_can_be_told(tmp_path: Path) -> None:
    """The same labels as markers: knees 55 mm inward of them, and hips moved from the trochanters."""
    joints, _ = walker.body()
    labels, places = walker.labelled(joints, JOINTS["COCO"] | {"hip": "*HJC"})
    told = read(tmp_path, labels, places, Options(points="markers"))
    knee = told.joints_m[:, told.joint_names.index("left_knee")]
    np.testing.assert_allclose(
        np.linalg.norm(knee - foreign.y_to_z(joints["left_knee"]), axis=-1), 0.055, atol=1e-6
    )
    assert "markers (as given)" in told.reading
    as_joints = read(tmp_path, labels, places, Options(points="joints"))
    knee = as_joints.joints_m[:, as_joints.joint_names.index("left_knee")]
    np.testing.assert_allclose(knee, foreign.y_to_z(joints["left_knee"]), atol=1e-5)


def test_keypoints_beside_the_markers_of_opencap_are_left_out(tmp_path: Path) -> None:
    joints, skin = walker.body()
    labels, places = walker.labelled(skin, MARKERS["OpenCap"])
    others, there = walker.labelled(joints, JOINTS["HALPE_26"])
    found = read(tmp_path, others + labels, np.concatenate((there + 0.3, places), axis=1))
    assert errors_m(found, joints)["knee"] < 1e-5
    assert "keypoints beside OpenCap's markers are left out" in found.reading


@pytest.mark.parametrize(("share", "point"), [(1.0, "head_top"), (0.55, "head"), (0.3, "skull_base")])
def test_which_point_of_the_head_its_distance_tells(tmp_path: Path, share: float, point: str) -> None:
    joints, _ = walker.body()
    between = (joints["left_shoulder"] + joints["right_shoulder"]) / 2
    joints["head_top"] = between + share * (joints["head_top"] - between)
    found = read(tmp_path, *walker.labelled(joints, JOINTS["HALPE_26"]))
    assert point in found.joint_names
    assert len({"head", "head_top", "skull_base"} & set(found.joint_names)) == 1


def test_hips_as_wide_as_the_trochanters_are_no_joints(tmp_path: Path) -> None:
    joints, skin = walker.body()
    labels, places = walker.labelled(
        joints | {f"{side}_hip": skin[f"{side}_trochanter"] for side in walker.SIDES}, JOINTS["COCO"]
    )
    found = read(tmp_path, labels, places)
    assert errors_m(found, joints)["hip"] < 1e-5
    assert "lie on the trochanters" in found.reading


def test_a_medial_marker_that_is_hardly_seen_is_left_out(tmp_path: Path) -> None:
    joints, skin = walker.body()
    labels, places = walker.labelled(skin, MARKERS["CGM2"])
    places[2:, labels.index("LKNM")] = np.nan
    found = read(tmp_path, labels, places)
    assert np.isfinite(found.joints_m).all()
    assert errors_m(found, joints)["knee"] < 0.008


def test_the_band_around_the_head_is_as_high_as_the_brows_of_the_mean_body() -> None:
    """Foremost point of the forehead, in the plane of symmetry, above the eyes."""
    space, mean = shape.space(), np.zeros(shape.space().size)
    skin, points = space.vertices_m(mean), space.points_m(mean)
    edges = np.concatenate([space.faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
    heights = np.arange(points["left_eye"][2] + 0.005, points["crown"][2] - 0.02, 0.002)
    front = []
    for height in heights:
        ends = skin[edges]  # (E, 2, 3)
        crossing = (ends[:, 0, 2] > height) != (ends[:, 1, 2] > height)
        low, high = ends[crossing].swapaxes(0, 1)
        share = (height - low[:, 2]) / (high[:, 2] - low[:, 2])
        cut = low + share[:, None] * (high - low)
        front.append(cut[np.abs(cut[:, 1]) < 0.02, 0].max())
    under = points["crown"][2] - heights[int(np.argmax(front))]
    assert table("crown")["band"] == pytest.approx(under / shape.stature_m(mean), abs=0.001)
