"""BVH of all kinds of rigs: which joints are the person's, what position channels mean, size and up axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.axes import to_z_up
from simrecon.evidence.mocap import names
from tests.support import rigs
from tests.support.rigs import PERSON, Bone, mirrored, renamed, split, without

CASES = Path(__file__).resolve().parents[1] / "data" / "cases"
Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
ANONYMOUS = {bone.name: f"Bone_{i:02d}" for i, bone in enumerate(PERSON)}


def read(folder: Path, text: str, **asked: Any) -> evidence.Evidence:  # type: ignore[name-defined]
    path = folder / "clip.bvh"
    path.write_text(text, encoding="utf-8")
    return evidence.read(path, Options(**asked))


def both_sides(points: dict[str, str]) -> dict[str, str]:
    """Names of joints by point, with those of the right side."""
    found = dict(points)
    for point, joint in points.items():
        if point.startswith("left_"):
            found[point.replace("left", "right")] = joint.replace("Left", "Right")
    return found


def assert_found(
    found: Any, places: dict[str, np.ndarray], name: Callable[[str], str], up: str = "y", cm: float = 1.0
) -> None:
    """All joints are where the file has them, in metres and z up."""
    wanted = both_sides(rigs.POINTS)
    assert set(found.joint_names) == set(wanted)
    for point, joint in wanted.items():
        ours = found.joints_m[:, found.joint_names.index(point)]
        theirs = places[name(joint)] @ to_z_up(up).T * cm / 100
        np.testing.assert_allclose(ours, theirs, atol=1e-4, err_msg=point)


FINGERS = tuple(
    Bone(f"LeftHand{finger}{i}", f"LeftHand{finger}{i - 1}" if i > 1 else "LeftHand", offset, None)
    for f, finger in enumerate(("Thumb", "Index", "Middle", "Ring", "Pinky"))
    for i, offset in ((1, (8.0, 0.0, 4.0 - 2 * f)), (2, (4.0, 0.0, 0.0)), (3, (3.0, 0.0, 0.0)))
)
FACE = (
    Bone("Jaw", "Head", (0, 2, 4), (0, -2, 6)), Bone("LeftEye", "Head", (3, 7, 8)),
    Bone("RightEye", "Head", (-3, 7, 8)), Bone("Hair1", "Head", (0, 16, -4)),
    Bone("Hair2", "Hair1", (0, -8, -8)), Bone("Hair3", "Hair2", (0, -12, 0)),
)  # fmt: skip
TWISTS = mirrored(
    (
        Bone("LeftUpLegTwist", "LeftUpLeg", (0, -20, 0)), Bone("LeftArmTwist", "LeftArm", (14, 0, 0)),
        Bone("LeftUpLegTwist2", "LeftUpLegTwist", (0, -10, 0)),
        Bone("LeftForeArmTwist", "LeftForeArm", (12, 0, 0)),
    )
)  # fmt: skip
SKIRT = mirrored(
    (
        Bone("LeftSkirt1", "Hips", (12, -6, 8)), Bone("LeftSkirt2", "LeftSkirt1", (2, -20, 2)),
        Bone("LeftSkirt3", "LeftSkirt2", (2, -20, 1)), Bone("LeftSkirt4", "LeftSkirt3", (0, -15, 0)),
    )
)  # fmt: skip


def in_both(bones: tuple[Bone, ...], name: str, *between: str) -> tuple[Bone, ...]:
    once = split(bones, name, *between)
    return split(once, name.replace("Left", "Right"), *(word.replace("Left", "Right") for word in between))


RIGS = {
    "as it is": PERSON,
    "fingers": (*PERSON, *mirrored(FINGERS)),
    "face and hair": (*PERSON, *FACE),
    "twist joints beside": (*PERSON, *TWISTS),
    "twist joints between": in_both(
        in_both(PERSON, "LeftLeg", "LeftUpLegTwist"), "LeftForeArm", "LeftArmTwist"
    ),
    "a skirt": (*PERSON, *SKIRT),
    "no collar bones": without(PERSON, "LeftShoulder", "RightShoulder"),
    "two collar bones": in_both(PERSON, "LeftArm", "LeftScapula"),
    "one joint of the spine": without(PERSON, "Spine"),
    "five joints of the spine": split(split(PERSON, "Spine1", "SpineA", "SpineB"), "Spine", "SpineC"),
    "two joints of the neck": split(PERSON, "Head", "Neck1"),
    "hip helpers": (
        *without(PERSON), Bone("LHipJoint", "Hips", (0, 0, 0)), Bone("RHipJoint", "Hips", (0, 0, 0)),
    ),
    "a robot's hips": in_both(PERSON, "LeftUpLeg", "LeftHipYaw", "LeftHipRoll"),
    "a tip of the head": (*PERSON, Bone("HeadTop_End", "Head", (0, 18, 0))),
    "a root on the ground": (
        Bone("Root", "", (0, 0, 0)), replace(PERSON[0], parent="Root", offset=(0, 90.5, 0)), *PERSON[1:],
    ),
}  # fmt: skip


def hung_from_helpers(bones: tuple[Bone, ...]) -> tuple[Bone, ...]:
    """Legs that hang from the hip helpers, which come before them."""
    helpers = [bone for bone in bones if bone.name.endswith("HipJoint")]
    rest = [
        replace(bone, parent=f"{bone.name[0]}HipJoint") if bone.name.endswith("UpLeg") else bone
        for bone in bones
        if bone not in helpers
    ]
    return (rest[0], *helpers, *rest[1:])


RIGS["hip helpers"] = hung_from_helpers(RIGS["hip helpers"])


@pytest.mark.parametrize("named", [True, False], ids=["names", "no names"])
@pytest.mark.parametrize("rig", RIGS)
def test_joints_are_found_by_their_place_in_the_tree(tmp_path: Path, rig: str, named: bool) -> None:
    bones = RIGS[rig]
    known = {} if named else {bone.name: f"Bone_{i:02d}" for i, bone in enumerate(bones)}
    back = {theirs: ours for ours, theirs in known.items()}
    other = renamed(bones, lambda name: known.get(name, name))
    text, places = rigs.bvh(other, meaning=lambda name: back.get(name, name))
    found = read(tmp_path, text)
    if rig == "two joints of the neck" and not named:  # either may be the neck
        at = found.joint_names.index("skull_base")
        np.testing.assert_allclose(
            found.joints_m[:, at], places[known["Head"]] @ to_z_up("y").T / 100, atol=1e-4
        )
    else:
        assert_found(found, places, lambda name: known.get(name, name))
    assert ("names don't say" in found.reading) == (not named)


STYLES: dict[str, Callable[[str], str]] = {
    "Mixamo": lambda name: f"mixamorig:{name}",
    "a character's": lambda name: f"Character1_{name}",
    "a namespace within": lambda name: f"rig|hero:{name}",
    "letters behind": lambda name: sided(name, "{}_L", "{}_R"),
    "letters behind a dot": lambda name: sided(name, "{}.L", "{}.R"),
    "letters before": lambda name: sided(name, "L_{}", "R_{}"),
    "a letter within": lambda name: f"Bip01 {sided(name, 'L {}', 'R {}')}",
    "small letters": lambda name: sided(name, "l{}", "r{}"),
    "numbers behind": lambda name: f"{name}_{len(name)}",
    "an armature": lambda name: f"Armature_{sided(name, '{}.l', '{}.r')}",
    "letters of Japan": lambda name: sided(name, "左{}", "右{}"),
}


def sided(name: str, left: str, right: str) -> str:
    for word, style in (("Left", left), ("Right", right)):
        if name.startswith(word):
            return style.format(name.removeprefix(word))
    return name


@pytest.mark.parametrize("style", STYLES)
def test_names_in_many_styles(tmp_path: Path, style: str) -> None:
    name = STYLES[style]
    back = {name(bone.name): bone.name for bone in PERSON}
    text, places = rigs.bvh(renamed(PERSON, name), meaning=lambda theirs: back[theirs])
    found = read(tmp_path, text)
    assert_found(found, places, name)
    assert "names don't say" not in found.reading


def test_the_name_of_a_side_counts_until_feet_and_knees_point_backward(tmp_path: Path) -> None:
    swap = {"Left": "Right", "Right": "Left"}

    def other(name: str) -> str:
        side = next((side for side in swap if name.startswith(side)), "")
        return swap.get(side, "") + name.removeprefix(side)

    text, places = rigs.bvh(renamed(PERSON, other), meaning=other)
    found = read(tmp_path, text)
    assert_found(found, places, other)
    assert "left and right are exchanged" in found.reading


def test_a_person_who_faces_the_other_way(tmp_path: Path) -> None:
    text, places = rigs.bvh(PERSON, world=np.diag([-1.0, 1.0, -1.0]))
    found = read(tmp_path, text)
    assert_found(found, places, lambda name: name)
    assert "exchanged" not in found.reading


def test_feet_that_point_down_in_the_rest_pose(tmp_path: Path) -> None:
    bones = tuple(
        replace(bone, offset=(0, -15, 0), end=(0, -6, 0)) if bone.name.endswith("ToeBase") else bone
        for bone in PERSON
    )
    extra = {f"{side}Foot": (-70.0, 0.0, 0.0) for side in ("Left", "Right")}
    for known in ({}, ANONYMOUS):
        back = {theirs: ours for ours, theirs in known.items()}
        other = renamed(bones, lambda name, known=known: known.get(name, name))  # type: ignore[misc]
        turned = {known.get(name, name): angles for name, angles in extra.items()}
        text, places = rigs.bvh(other, extra=turned, meaning=lambda name, back=back: back.get(name, name))  # type: ignore[misc]
        assert_found(read(tmp_path, text), places, lambda name, known=known: known.get(name, name))  # type: ignore[misc]


def test_a_forearm_may_end_at_the_wrist(tmp_path: Path) -> None:
    bones = tuple(
        replace(bone, end=(25.0 * (1 if bone.name.startswith("Left") else -1), 0, 0))
        if bone.name.endswith("ForeArm")
        else bone
        for bone in PERSON
        if not bone.name.endswith("Hand")
    )
    text, places = rigs.bvh(bones)
    found = read(tmp_path, text)
    elbow, wrist = (
        found.joints_m[:, found.joint_names.index(f"left_{joint}")] for joint in ("elbow", "wrist")
    )
    np.testing.assert_allclose(elbow, places["LeftForeArm"] @ to_z_up("y").T / 100, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(wrist - elbow, axis=-1), 0.25, atol=1e-4)


# --- position channels


@pytest.mark.parametrize("zero", [False, True], ids=["stand for it", "are added"])
def test_position_channels_and_offsets(tmp_path: Path, zero: bool) -> None:
    bones = tuple(replace(bone, six=True) for bone in PERSON)
    text, places = rigs.bvh(bones, zero=zero)
    found = read(tmp_path, text)
    assert_found(found, places, lambda name: name)
    said = "are added to OFFSET" if zero else "stand for OFFSET"
    assert f"position channels of {len(PERSON) - 1} joints {said}" in found.reading


def test_position_channels_of_a_file_whose_offsets_are_left_out(tmp_path: Path) -> None:
    bones = tuple(replace(bone, six=True) for bone in PERSON)
    text, places = rigs.bvh(bones)
    bare = "\n".join(
        "OFFSET 0 0 0" if line.strip().startswith("OFFSET") else line for line in text.splitlines()
    )
    assert_found(read(tmp_path, bare), places, lambda name: name)


def test_one_joint_that_never_moves_stays_at_its_offset(tmp_path: Path) -> None:
    """Its position channels are zero, where those of the others are the whole translation."""
    bones = tuple(replace(bone, six=True) for bone in PERSON)
    text, places = rigs.bvh(bones)
    head, rows = text.split("Frame Time: 0.0333333\n")
    at = 6 * [bone.name for bone in ordered(PERSON)].index("Neck")
    changed = [line.split() for line in rows.splitlines()]
    for row in changed:
        row[at : at + 3] = ["0", "0", "0"]
    body = "\n".join(" ".join(row) for row in changed)
    found = read(tmp_path, f"{head}Frame Time: 0.0333333\n{body}\n")
    assert_found(found, places, lambda name: name)
    assert "1 are added to OFFSET, the others stand for it" in found.reading


def ordered(bones: tuple[Bone, ...]) -> list[Bone]:
    """Bones as the file has them, depth first."""

    def walk(bone: Bone) -> list[Bone]:
        return [bone, *(b for child in bones if child.parent == bone.name for b in walk(child))]

    return walk(bones[0])


def test_a_reference_pose_before_the_motion_is_left_out(tmp_path: Path) -> None:
    text, places = rigs.bvh(PERSON)
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    lines[first] = " ".join(["0"] * len(lines[first].split()))
    found = read(tmp_path, "\n".join([*lines, ""]))
    assert_found(found, {name: place[1:] for name, place in places.items()}, lambda name: name)
    assert "the first frame is left out" in found.reading
    assert found.times_s[0] == pytest.approx(1 / 30, abs=1e-4)
    assert len(read(tmp_path, text).times_s) == rigs.FRAMES


# --- the up axis


def test_z_up(tmp_path: Path) -> None:
    text, places = rigs.bvh(PERSON, world=Z_UP)
    found = read(tmp_path, text)
    assert_found(found, places, lambda name: name, up="z")


@pytest.mark.parametrize("world", [np.eye(3), Z_UP], ids=["y", "z"])
def test_a_cartwheel_keeps_the_up_axis(tmp_path: Path, world: np.ndarray) -> None:
    """One turn sideways: upright for a quarter of the time."""
    text, places = rigs.bvh(PERSON, world=world, turned=lambda t: rigs.turn(2, 2 * np.pi * t / rigs.FRAMES))
    up = "y" if world is not Z_UP else "z"
    found = read(tmp_path, text)
    assert_found(found, places, lambda name: name, up=up)


def test_a_handstand_is_not_upside_down(tmp_path: Path) -> None:
    text, places = rigs.bvh(PERSON, turned=lambda t: rigs.turn(2, np.pi + 0.02 * t), hips=65.0)
    found = read(tmp_path, text)
    assert_found(found, places, lambda name: name)


# --- size


@pytest.mark.parametrize("unit", [1.0, 2.5, 5.6444])
def test_a_height_alone_settles_size_and_path(tmp_path: Path, unit: float) -> None:
    text, places = rigs.bvh(PERSON, unit=unit)
    found = read(tmp_path, text, height_m=1.71)
    hips = found.joints_m[:, found.joint_names.index("left_hip")]
    wanted = places["LeftUpLeg"] @ to_z_up("y").T * unit / 100
    np.testing.assert_allclose(hips - hips[0], wanted - wanted[0], atol=0.02)


def test_a_unit_may_be_a_number(tmp_path: Path) -> None:
    text, places = rigs.bvh(PERSON, unit=5.6444)
    found = read(tmp_path, text, unit=0.056444)
    assert_found(found, places, lambda name: name, cm=5.6444)
    assert "unit 0.056444 m (as given)" in found.reading


# --- joints that the user names


def test_joints_as_the_user_names_them(tmp_path: Path) -> None:
    text, places = rigs.bvh(PERSON)
    found = read(tmp_path, text, joints=("left_knee=LeftFoot", "left_ankle = lefttoebase"))
    knee = found.joints_m[:, found.joint_names.index("left_knee")]
    np.testing.assert_allclose(knee, places["LeftFoot"] @ to_z_up("y").T / 100, atol=1e-4)
    assert "as given: left_knee=LeftFoot" in found.reading
    for told, said in (
        ("left_kne=LeftLeg", "found 'left_kne', did you mean 'left_knee'"),
        ("left_knee=LeftLeg1", "found 'LeftLeg1', did you mean 'LeftLeg'"),
        ("left_knee", "found ''"),
    ):
        with pytest.raises(InputError, match=f"--joints: {said}"):
            read(tmp_path, text, joints=(told,))


def test_joints_are_named_for_hierarchies_only(tmp_path: Path) -> None:
    from tests.support import foreign_files as foreign

    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(*foreign.markers()))
    with pytest.raises(InputError, match=r"--joints: found .* which has no meaning for the format trc"):
        evidence.read(path, Options(joints=("left_knee=LKNE",)))


def test_what_is_missing_is_named(tmp_path: Path) -> None:
    bones = tuple(bone for bone in PERSON if bone.name not in ("LeftArm", "LeftForeArm", "LeftHand"))
    text, _ = rigs.bvh(bones)
    with pytest.raises(InputError, match=r"none that is left_shoulder.*--joints left_shoulder=NAME") as error:
        read(tmp_path, text.replace("LeftShoulder", "Stump"))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("first", "second", "left"),
    [
        ("LeftLeg", "RightLeg", True), ("thigh_r", "thigh_l", False), ("lShin", "rShin", True),
        ("R_Knee.001", "L_Knee.007", False), ("左ひざ", "右ひざ", True), ("Bone_12", "Bone_17", None),
        ("Leg", "Leg", None), ("LinksKnie", "RechtsKnie", True), ("tail_a", "tail_b", None),
    ],
)  # fmt: skip
def test_names_of_a_pair(first: str, second: str, left: bool | None) -> None:
    assert names.is_left(first, second) is left


# --- the cases


def case(name: str, **asked: Any) -> tuple[Any, dict[str, np.ndarray]]:
    found = evidence.read(CASES / f"{name}.bvh", Options(**asked))
    return found, {point: found.joints_m[:, i] for i, point in enumerate(found.joint_names)}


def length(at: dict[str, np.ndarray], a: str, b: str) -> float:
    return float(np.median(np.linalg.norm(at[a] - at[b], axis=-1)))


@pytest.mark.parametrize(
    "name",
    [
        "bvh_names_daz_cmu", "bvh_names_jnt", "bvh_names_mocopi", "bvh_names_smpl_unity", "bvh_unreal_names",
        "bvh_height_1m71", "bvh_six_channels", "bvh_stands_on_platform",
    ],
)  # fmt: skip
def test_cases_have_all_joints_on_both_sides(name: str) -> None:
    found, at = case(name)
    assert set(at) == set(both_sides(rigs.POINTS))
    for side in ("left", "right"):
        for a, b, wanted in (
            ("hip", "knee", 0.41), ("knee", "ankle", 0.40),
            ("shoulder", "elbow", 0.28), ("elbow", "wrist", 0.25),
        ):  # fmt: skip
            assert length(at, f"{side}_{a}", f"{side}_{b}") == pytest.approx(wanted, abs=1e-3)
    assert float(np.median(at["left_hip"][:, 0] - at["right_hip"][:, 0])) == pytest.approx(0.18, abs=0.01)
    assert "the person is about 1.71 m tall" in found.reading


def test_case_of_six_channels() -> None:
    found, at = case("bvh_six_channels", unit="cm")
    assert "position channels of 20 joints stand for OFFSET" in found.reading
    assert float(np.ptp(np.concatenate(list(at.values()))[:, 2])) < 1.7


def test_case_of_a_stated_height() -> None:
    for asked in ({}, {"height_m": 1.71}):
        _, at = case("bvh_height_1m71", **asked)
        assert length(at, "left_hip", "left_knee") == pytest.approx(0.41, rel=0.01)


def test_case_of_scaled_units() -> None:
    with pytest.raises(InputError, match=r"unit: found a person about 68\.3 tall; valid: --unit m, cm"):
        case("bvh_scaled_units")
    found, at = case("bvh_scaled_units", height_m=1.75)
    assert length(at, "left_hip", "left_knee") == pytest.approx(0.41 * 1.75 / 1.71, rel=0.01)
    assert at["left_hip"][0, 2] == pytest.approx((0.895 - 0.04) * 1.75 / 1.71, rel=0.01)
    assert "the person is 1.75 m tall, as given" in found.reading
    found, _ = case("bvh_scaled_units", unit=0.0564)
    assert "stature: found 3.7" in found.reading or "stature: found 3.8" in found.reading


def test_case_of_a_platform() -> None:
    found, at = case("bvh_stands_on_platform")
    assert at["left_hip"][0, 2] == pytest.approx(1.17, abs=0.005)
    assert "floor: found the lowest of the feet at 0.30 m" in found.reading
