"""TRC and C3D files as programs write them: sloppy headers, several people, wrong units, no depth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.mocap import labels as meaning
from simrecon.types import Evidence
from tests.support import foreign_files as foreign
from tests.support import walker

CASES = Path(__file__).parents[1] / "data" / "cases"
PIG = walker.sets("markers")["Plug-in Gait"]


def case(name: str, options: Options | None = None) -> Evidence:
    return evidence.read(CASES / name, options or Options())


def raw(name: str) -> dict[str, np.ndarray]:
    """Points of a case by label, z up, as they stand in the file."""
    lines = (CASES / name).read_text().splitlines()
    names = [label for label in lines[3].split("\t")[2:] if label]
    rows = np.array([[float(cell) for cell in line.split("\t")] for line in lines[5:]])
    return {label: foreign.y_to_z(rows[:, 2 + 3 * i : 5 + 3 * i]) for i, label in enumerate(names)}


def point(found: Evidence, name: str) -> np.ndarray:
    return found.joints_m[:, found.joint_names.index(name)]


def refusal(path: Path, options: Options | None = None) -> str:
    with pytest.raises(InputError) as error:
        evidence.read(path, options or Options())
    message = str(error.value)
    assert "\n" not in message
    return message


# --- the cases


@pytest.mark.parametrize("name", ["trc_keypoint_names.trc", "trc_says_mm_is_m.trc", "trc_cut_numframes.trc"])
def test_keypoints_are_joints_and_stay_where_they_are(name: str) -> None:
    found, file = case(name), raw(name)
    for label, joint in {
        "LKnee": "left_knee",
        "RAnkle": "right_ankle",
        "LHip": "left_hip",
        "Neck": "neck",
    }.items():
        np.testing.assert_allclose(point(found, joint), file[label], atol=1e-6)
    assert "joints (by RHip, RBigToe, LHip)" in found.reading
    assert found.trust == "mocap"


def test_a_unit_that_makes_no_person_is_not_believed() -> None:
    reading = case("trc_says_mm_is_m.trc").reading
    assert "unit m (the file says mm, in which the person is about 1.6 mm tall, and 1.63 m in m)" in reading


def test_rows_count_and_the_header_is_noted() -> None:
    found = case("trc_cut_numframes.trc")
    assert len(found.times_s) == 60
    assert "the header says 900 where there are 60 frames" in found.reading


def test_a_person_seen_from_one_side_gets_a_breadth() -> None:
    found, file = case("trc_planar_sports2d.trc"), raw("trc_planar_sports2d.trc")
    for joint, label in {"left_knee": "LKnee", "right_shoulder": "RShoulder"}.items():
        np.testing.assert_allclose(point(found, joint)[:, [0, 2]], file[label][:, [0, 2]], atol=1e-6)
    for joint, wide in {"hip": 0.104, "shoulder": 0.224}.items():
        right = point(found, f"left_{joint}")[:, 1] - point(found, f"right_{joint}")[:, 1]  # looks along +x
        np.testing.assert_allclose(right, wide * 1.64, rtol=0.04)
    assert "a plane without depth along y" in found.reading
    assert found.trust.startswith("mocap,joints_m=0.03")


def test_a_lower_body_is_read_without_arms() -> None:
    found = case("trc_lower_body.trc")
    assert {"left_hip", "right_knee", "left_ankle", "right_toe"} <= set(found.joint_names)
    assert "left_shoulder" not in found.joint_names
    assert "no shoulders: the arms are unseen" in found.reading


def test_two_people_are_kept_apart() -> None:
    name = "trc_two_subjects.trc"
    message = refusal(CASES / name)
    assert (
        "people: found 2: Subject01 (24 markers), Other (26 markers); valid: one of them, by --person"
        in message
    )
    message = refusal(CASES / name, Options(person="Subject01"))  # whose right ankle the other one had
    assert "none that give right_ankle" in message
    found, file = case(name, Options(person="Other")), raw(name)
    assert np.linalg.norm(point(found, "left_knee") - file["Other:LKNE"], axis=-1).max() < 0.06
    assert "person Other of 2" in found.reading


def test_big_endian_c3d_is_read_and_said() -> None:
    found = case("c3d_big_endian.c3d")
    assert "big-endian numbers" in found.reading
    assert "unit mm (as the file says), up z" in found.reading
    assert len(found.times_s) == 60
    legs = np.linalg.norm(point(found, "left_hip") - point(found, "left_ankle"), axis=-1)
    assert 0.7 < legs.min() < legs.max() < 0.9


@pytest.mark.parametrize(("trial", "travel_m"), [("walking2", 1.69), ("DJ1", None)])
def test_recorded_trials_keep_their_path(shared_data: Path, trial: str, travel_m: float | None) -> None:
    found = evidence.read(shared_data / "grf" / "opencap_subject4" / f"{trial}.trc")
    hips = (point(found, "left_hip") + point(found, "right_hip")) / 2
    if travel_m is not None:
        assert np.linalg.norm((hips[-1] - hips[0])[:2]) == pytest.approx(travel_m, abs=0.02)
    else:
        assert hips[:, 2].min() == pytest.approx(0.51, abs=0.01)
        assert hips[:, 2].max() == pytest.approx(1.25, abs=0.01)
    soles = np.minimum(point(found, "left_heel")[:, 2], point(found, "right_heel")[:, 2])
    assert abs(np.nanquantile(soles, 0.1)) < 0.02  # heels lie on the laboratory's floor


# --- sloppy TRC


def text(spoil: str) -> str:
    """A file of Plug-in Gait's markers that is written as some program writes it."""
    names, places = walker.labelled(walker.body(frames=12)[1], PIG)
    lines = foreign.trc(names, places, "m").splitlines()
    if spoil == "runs of tabs":
        lines[1:3] = [
            lines[1].replace("\t", "\t\t"),
            "  100.0\t\t  100.0\t\t 12\t\t 30\t\t m\t100.0\t 1\t 12",
        ]
        lines[3] = "Frame#\tTimes\t\t" + "\t\t".join(names)
    elif spoil == "trailing tabs":
        lines = [line + 40 * "\t" for line in lines]
    elif spoil == "wrong counts":
        lines[2] = "100\t100\t900\t7\tm\t100\t1\t900"
    elif spoil == "spaces":
        lines = [" ".join(line.split()) for line in lines]
    elif spoil == "no header values":
        lines[2] = "100"
    elif spoil == "no axes":
        del lines[4:6]
    elif spoil == "no unit":
        lines[1:3] = [line.replace("\tUnits", "").replace("\tm\t", "\t") for line in lines[1:3]]
    elif spoil == "no times":
        lines[6:] = ["\t".join((line.split("\t")[0], "", *line.split("\t")[2:])) for line in lines[6:]]
    elif spoil == "NaN":
        lines[-1] += "\t" + "\t".join(("NaN", "-nan", "1.#QNAN"))
        lines[3] += "\t\t\tProp"
    elif spoil == "an unnamed marker":
        lines[3] = "Frame#\tTime\t\t\t\t" + "\t\t\t".join(names)
        lines[4] += "\tX31\tY31\tZ31"
        lines[6:] = [
            "\t".join((*line.split("\t")[:2], "9", "9", "9", *line.split("\t")[2:])) for line in lines[6:]
        ]
    return "\n".join(lines) + "\n"


SPOILT = {
    "runs of tabs": "",
    "trailing tabs": "",
    "wrong counts": "the header says 7 where there are 30 labels",
    "spaces": "",
    "no header values": "the header says nothing where there are 12 frames",
    "no axes": "",
    "no unit": "the person is about",
    "no times": "no times: 100 frames per second",
    "NaN": "",
    "an unnamed marker": "",
}


@pytest.mark.parametrize("spoil", SPOILT)
def test_what_opensim_reads_is_read(tmp_path: Path, spoil: str) -> None:
    path = tmp_path / "clip.trc"
    path.write_text(text(spoil))
    found = evidence.read(path)
    path.write_text(text(""))
    np.testing.assert_allclose(found.joints_m, evidence.read(path).joints_m, atol=1e-9)
    np.testing.assert_allclose(np.diff(found.times_s), 0.01, atol=1e-9)
    assert SPOILT[spoil] in found.reading


def test_a_last_line_that_is_cut_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "clip.trc"
    path.write_text(text("")[:-100])
    found = evidence.read(path)
    assert len(found.times_s) == 11
    assert "the last line is cut short and left out" in found.reading


@pytest.mark.parametrize(
    ("without", "missing"),
    [
        ("asis", "left_hip"),
        ("knee_lateral", "left_knee"),
        ("ankle_lateral", "left_ankle"),
        ("psis", "left_hip"),
    ],
)
def test_the_first_missing_thing_is_named(tmp_path: Path, without: str, missing: str) -> None:
    names, places = walker.labelled(walker.body(frames=6)[1], {k: v for k, v in PIG.items() if k != without})
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names, places, "m"))
    message = refusal(path)
    assert f"found none that give {missing} among" in message
    assert "valid: after L, in a set of joints" in message


# --- units


@pytest.mark.parametrize(
    ("says", "is_in", "factor"),
    [("mm", "m", 1.0), ("m", "mm", 1000.0), ("m", "cm", 100.0), ("cm", "mm", 1000.0)],
)
def test_the_unit_is_found_before_offsets_are_used(
    tmp_path: Path, says: str, is_in: str, factor: float
) -> None:
    joints, skin = walker.body(frames=6)
    names, places = walker.labelled(skin, PIG)
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names, factor * places, says))
    found = evidence.read(path)
    np.testing.assert_allclose(point(found, "left_knee"), foreign.y_to_z(joints["left_knee"]), atol=0.01)
    assert f"unit {is_in} (the file says {says}, in which" in found.reading


def test_a_unit_that_nothing_explains_is_refused(tmp_path: Path) -> None:
    names, places = walker.labelled(walker.body(frames=6)[1], PIG)
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names, 30.0 * places, "m"))
    assert "unit: found m, in which the person is about 5" in refusal(path)
    child = tmp_path / "child.trc"
    child.write_text(foreign.trc(names, 0.5 * places, "m"))
    assert "unit m (as the file says)" in evidence.read(child).reading


# --- people


@pytest.mark.parametrize(
    "pattern",
    ["{who}:{label}", "{who}|{label}", "{who}_{label}", "{label}_{who}", "{who}.{label}", "{label} {who}"],
)
def test_people_by_prefix_or_suffix(tmp_path: Path, pattern: str) -> None:
    names, places = walker.labelled(walker.body(frames=6)[1], PIG)
    both = [pattern.format(who=who, label=label) for who in ("Ann", "Bob") for label in names]
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(both, np.concatenate((places, places + 1.0), axis=1), "m"))
    assert "people: found 2: Ann (30 markers), Bob (30 markers)" in refusal(path)
    found = evidence.read(path, Options(person="Bob"))
    alone = tmp_path / "alone.trc"
    alone.write_text(foreign.trc(names, places + 1.0, "m"))
    np.testing.assert_allclose(found.joints_m, evidence.read(alone).joints_m, atol=1e-9)
    assert "--person: found 'Eve'; valid: Ann" in refusal(path, Options(person="Eve"))


def test_one_person_with_things_is_one_person(tmp_path: Path) -> None:
    names, places = walker.labelled(walker.body(frames=6)[1], PIG)
    path = tmp_path / "clip.trc"
    everything = [*(f"Ann:{label}" for label in names), "Box:corner", "Box:edge"]
    path.write_text(foreign.trc(everything, np.concatenate((places, places[:, :2]), axis=1), "m"))
    assert "30 markers" in evidence.read(path).reading


def test_people_without_names_are_numbered(tmp_path: Path) -> None:
    names, places = walker.labelled(walker.body(frames=6)[1], PIG)
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names + names, np.concatenate((places, places + 1.0), axis=1), "m"))
    assert "people: found 2: 1 (30 markers), 2 (30 markers)" in refusal(path)
    assert point(evidence.read(path, Options(person="2")), "left_knee")[0, 0] > 0.9


@pytest.mark.parametrize("name", walker.sets("markers"))
def test_no_set_of_one_person_is_taken_apart(tmp_path: Path, name: str) -> None:
    names, places = walker.labelled(walker.body(frames=20)[1], walker.sets("markers")[name])
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names, places, "m"))
    assert "person" not in evidence.read(path).reading.replace("the person stands", "")


# --- planes


@pytest.mark.parametrize("towards", [1.0, -1.0])
@pytest.mark.parametrize("depth", ["zero", "constants"])
def test_which_side_is_nearer_follows_from_where_the_feet_point(
    tmp_path: Path, towards: float, depth: str
) -> None:
    joints, _ = walker.body()
    names, places = walker.labelled(joints, walker.sets("joints")["HALPE_26"])
    constants = {
        "Hip": 0.105,
        "Knee": 0.0886,
        "Ankle": 0.0972,
        "Shoulder": 0.2016,
        "Elbow": 0.1613,
        "Wrist": 0.12,
    }
    places[..., 0] *= towards
    places[..., 2] = 0.0
    for i, label in enumerate(names):
        if depth == "constants" and label[1:] in constants:
            places[:, i, 2] = towards * constants[label[1:]] * (1 if label[0] == "R" else -1)
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names, places, "m"))
    found = evidence.read(path)
    left = point(found, "left_hip") - point(found, "right_hip")
    np.testing.assert_allclose(left, [[0.0, towards * 0.104 * walker.HEIGHT_M, 0.0]] * len(left), atol=0.01)
    assert "a plane without depth" in found.reading


def test_a_person_seen_from_the_front_has_a_breadth(tmp_path: Path) -> None:
    joints, _ = walker.body()
    names, places = walker.labelled(joints, walker.sets("joints")["HALPE_26"])
    places = np.stack((places[..., 2], places[..., 1], 0 * places[..., 0]), axis=-1)
    path = tmp_path / "clip.trc"
    path.write_text(foreign.trc(names, places, "m"))
    found = evidence.read(path)
    left = point(found, "left_hip") - point(found, "right_hip")
    np.testing.assert_allclose(np.abs(left[:, 0]), 0.104 * walker.HEIGHT_M, atol=1e-6)
    assert np.abs(left[:, 1]).max() < 0.06


# --- labels


@pytest.mark.parametrize(
    ("label", "found"),
    [
        ("L_knee", "left_knee_lateral"),
        ("r.Knee", "right_knee_lateral"),
        ("KneeL", "left_knee_lateral"),
        ("Left Knee", "left_knee_lateral"),
        ("LKNE", "left_knee_lateral"),
        ("WaistRFront", "right_asis"),
        ("R.ASIS", "right_asis"),
        ("V.Sacral", "sacrum"),
        ("Top.Head", "vertex"),
        ("R.Acromium", "right_acromion"),
        ("RLMAL", "right_ankle_lateral"),
        ("LMEPI", "left_knee_medial"),
        ("RACR", "right_acromion"),
        ("L_5meta", "left_toe_lateral"),
        ("C7_study", "c7"),
        ("RFLE", "right_knee_lateral"),
        ("R.Heel", "right_heel"),
    ],
)
def test_labels(label: str, found: str) -> None:
    assert [name for name, _ in meaning.meanings("skin", label)] == [found]


@pytest.mark.parametrize(
    "label",
    ["Heel", "Rail", "Box1", "LeftEar", "Light", "Prop:1", "T12", "L5", "STRN", "Sternum", "LHipAngles"],
)
def test_labels_that_mean_no_marker(label: str) -> None:
    assert [name for name, _ in meaning.meanings("skin", label)] == []
