from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence
from simrecon.body import names as body_names
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.mocap import centres, names
from tests.support import c3d_file
from tests.support import foreign_files as foreign

T = foreign.T
POINTS = {
    "neck": "Neck",
    "skull_base": "Head",
    "left_shoulder": "LeftArm",
    "left_elbow": "LeftForeArm",
    "left_wrist": "LeftHand",
    "left_hip": "LeftUpLeg",
    "left_knee": "LeftLeg",
    "left_ankle": "LeftFoot",
    "left_mtp": "LeftToeBase",
}


def written(folder: Path, text: str, name: str = "clip.bvh") -> Path:
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("order", "scale", "unit"), [("ZXY", 1.0, "cm"), ("XYZ", 0.01, "m"), ("YZX", 10.0, "mm")]
)
def test_bvh_round_trip(tmp_path: Path, order: str, scale: float, unit: str) -> None:
    text, places = foreign.bvh(order, scale=scale)
    found = evidence.read(written(tmp_path, text))
    wanted = foreign.y_to_z(places / scale / 100)
    at = {joint[0]: i for i, joint in enumerate(foreign.BVH_JOINTS)}
    assert len(found.joint_names) == 16
    for point, joint in POINTS.items():
        np.testing.assert_allclose(
            found.joints_m[:, found.joint_names.index(point)], wanted[:, at[joint]], atol=1e-5
        )
        if point.startswith("left_"):
            other = found.joints_m[:, found.joint_names.index(point.replace("left", "right"))]
            np.testing.assert_allclose(other, wanted[:, at[joint.replace("Left", "Right")]], atol=1e-5)
    np.testing.assert_allclose(np.diff(found.times_s), 0.0333333)
    assert f"unit {unit} (" in found.reading
    assert "up y (" in found.reading
    assert set(found.joint_names) <= set(body_names.valid_names())


def test_bvh_in_other_units_and_axes(tmp_path: Path) -> None:
    text, places = foreign.bvh(scale=1 / 2.54)
    path = written(tmp_path, text)
    assert_refused(path, Options(), "unit: found a person about", "--unit m, cm, mm, in, ft")
    found = evidence.read(path, Options(unit="in"))
    knee = places[:, [j[0] for j in foreign.BVH_JOINTS].index("LeftLeg")]
    at = found.joint_names.index("left_knee")
    np.testing.assert_allclose(found.joints_m[:, at], foreign.y_to_z(knee * 0.0254), atol=1e-5)
    upside = evidence.read(path, Options(unit="in", up="-y"))
    np.testing.assert_allclose(upside.joints_m[..., 2], -found.joints_m[..., 2], atol=1e-12)
    assert "up -y (as given)" in upside.reading


def test_axes_are_turned_and_never_mirrored() -> None:
    from simrecon.evidence.axes import AXES, to_z_up

    for axis in AXES:
        turn = to_z_up(axis)
        up = np.zeros(3)
        up["xyz".index(axis[-1])] = -1 if axis.startswith("-") else 1
        np.testing.assert_array_equal(turn @ up, [0, 0, 1])
        assert np.linalg.det(turn) == 1


def change(old: str, new: str, count: int = 1) -> Callable[[str], str]:
    def make(text: str) -> str:
        assert old in text
        return text.replace(old, new, count)

    return make


BVH = {
    "cut": (lambda text: text[: int(0.9 * len(text))], "MOTION: found"),
    "no motion": (lambda text: text.partition("MOTION")[0], "MOTION: found no such section"),
    "cut in the skeleton": (
        lambda text: text[:300] + "\nMOTION\nFrames: 1\nFrame Time: 0.03\n",
        "unfinished",
    ),
    "NaN": (lambda text: text.rsplit(" ", 1)[0] + " nan\n", "MOTION: found no number at frame 11"),
    "text": (
        lambda text: text.rsplit(" ", 1)[0] + " abc\n",
        "MOTION: found 'abc'; valid: numbers with a point",
    ),
    "too many frames claimed": (change("Frames: 12", "Frames: 2000000000"), "MOTION: found"),
    "more frames claimed": (change("Frames: 12", "Frames: 13"), "values for 13 frames"),
    "no frame time": (change("Frame Time: 0.0333333", "Frame Time: 0"), "Frame Time: found 0 s"),
    "a rate for a time": (change("Frame Time: 0.0333333", "Frame Time: 30"), "Frame Time: found 30 s; valid"),
    "a comma": (change("Frame Time: 0.0333333", "Frame Time: 0,0333"), "MOTION: found 'Frames: 12"),
    "unknown channel": (change("Zrotation", "Wrotation"), "CHANNELS: found Wrotation"),
    "two roots": (change("ROOT Hips", "ROOT A\n{\n}\nROOT Hips"), "a second ROOT"),
    "not a person": (
        lambda text: text.replace("\tJOINT LeftUpLeg", "\tJOINT Wheel").replace("0 -41 0", "0 -2 0", 2),
        "joints: found none that is left_hip",
    ),
    "word": (change("OFFSET", "OFSET"), "HIERARCHY: found 'OFSET'"),
    "nobody": (
        lambda _: "HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 0.03\n",
        "HIERARCHY: found an unfinished",
    ),
}


@pytest.mark.parametrize("name", BVH)
def test_bad_bvh_gives_one_clear_line(tmp_path: Path, name: str) -> None:
    spoil, found = BVH[name]
    assert_refused(written(tmp_path, spoil(foreign.bvh()[0])), Options(), found)


def test_a_frame_time_that_is_none_is_replaced_by_a_rate(tmp_path: Path) -> None:
    path = written(tmp_path, foreign.bvh()[0].replace("Frame Time: 0.0333333", "Frame Time: 33.3"))
    np.testing.assert_allclose(np.diff(evidence.read(path, Options(fps=30.0)).times_s), 1 / 30)


@pytest.mark.parametrize("code", ["utf-16", "utf-8-sig"])
def test_text_in_two_bytes_a_letter_and_with_a_mark_is_read(tmp_path: Path, code: str) -> None:
    path = tmp_path / "clip.bvh"
    path.write_text(foreign.bvh()[0], encoding=code)
    assert len(evidence.read(path).times_s) == 12


def assert_refused(path: Path, options: Options, *parts: str) -> None:
    with pytest.raises(InputError) as error:
        evidence.read(path, options)
    message = str(error.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    assert [part for part in (*parts, "valid: ") if part not in message] == []


@pytest.mark.parametrize(
    ("given", "points"),
    [
        (["mixamorig:LeftUpLeg", "mixamorig:RightUpLeg"], {"left_hip", "right_hip"}),
        (["CC_Base_L_Thigh", "CC_Base_R_Calf"], {"left_hip", "right_knee"}),
        (["Character1_LeftArm", "Character1_LeftShoulder"], {"left_shoulder"}),
        (["LeftShoulder", "LeftElbow", "rShin"], {"left_shoulder", "left_elbow", "right_knee"}),
        (["L_Hip", "R_Ankle", "thigh_r", "foot_l"], {"left_hip", "right_hip", "right_ankle", "left_ankle"}),
        (["Light", "Rail", "LeftEye"], set()),
    ],
)
def test_names_of_joints(given: list[str], points: set[str]) -> None:
    assert set(names.joints(given)) == points


def test_the_upper_arm_comes_before_a_shoulder_that_is_the_collar_bone() -> None:
    assert names.joints(["LeftShoulder", "LeftArm"])["left_shoulder"] == 1


# --- markers


@pytest.mark.parametrize(("units", "factor"), [("mm", 1000.0), ("m", 1.0), ("cm", 100.0)])
def test_trc_round_trip(tmp_path: Path, units: str, factor: float) -> None:
    labels, places = foreign.markers()
    places[3, labels.index("L_toe")] = np.nan
    found = evidence.read(written(tmp_path, foreign.trc(labels, places * factor, units), "clip.trc"))
    at = {name: found.joints_m[:, i] for i, name in enumerate(found.joint_names)}
    wanted = {label: foreign.y_to_z(places[:, i]) for i, label in enumerate(labels)}
    np.testing.assert_allclose(at["left_hip"], wanted["L_HJC"], atol=1e-5)
    soles = at["right_heel"] - wanted["r_calc"]
    np.testing.assert_allclose(soles, [[0, 0, -0.03]] * T, atol=2e-3)  # on the floor
    elbow = (wanted["L_elbow_lat"] + wanted["L_elbow_med"]) / 2
    np.testing.assert_allclose(at["left_elbow"], elbow, atol=1e-5)
    assert np.isnan(at["left_toe"][3]).all()
    np.testing.assert_allclose(found.times_s, np.arange(T) / 100)
    assert f"unit {units} (as the file says)" in found.reading
    # one-sided: 55 mm and 42 mm inward, here along x; acromia 0.38 m apart: 65 mm down
    np.testing.assert_allclose(at["left_knee"][0, 0], 0.09, atol=2e-3)
    np.testing.assert_allclose(at["right_ankle"][0, 0], -0.09, atol=2e-3)
    np.testing.assert_allclose(at["left_shoulder"][0, 2], 1.42 - 0.17 * 0.38, atol=1e-5)
    assert "left_knee" in found.reading


def test_hip_centres_of_harrington_2007() -> None:
    """Spines 240 mm wide and 130 mm deep: 41.1 mm back, 86.5 mm aside, 82.9 mm down."""
    left, right = centres.harrington(
        np.array([[0.12, 1.0, 0.0]]), np.array([[-0.12, 1.0, 0.0]]), np.array([[0.0, 1.0, -0.13]])
    )
    np.testing.assert_allclose(left, [[0.0865, 1 - 0.0829, -0.0411]], atol=1e-9)
    np.testing.assert_allclose(right, [[-0.0865, 1 - 0.0829, -0.0411]], atol=1e-9)


def trc(spoil: Callable[[str], str]) -> Callable[[Path], Path]:
    labels, places = foreign.markers()
    return lambda folder: written(folder, spoil(foreign.trc(labels, places)), "clip.trc")


TRC = {
    "cut in the header": (trc(lambda text: "\n".join(text.splitlines()[:3])), "header: found 3 lines"),
    "no header": (trc(change("DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits", "A\tB")), "header: found"),
    "no labels": (trc(change("Frame#\tTime\t", "Frame#\tTime\n")), "labels: found"),
    "unknown unit": (trc(change("\tmm\t", "\tfurlong\t")), "unit: found 'furlong'"),
    "text": (trc(lambda text: text[:-4] + "abc\n"), "line 18: found"),
    "too many cells": (trc(lambda text: text[:-1] + "\t1\t2\n"), "line 18: found 55 cells"),
    "no frames": (trc(lambda text: "\n".join(text.splitlines()[:5]) + "\n"), "Time: found no frames"),
    "some times": (trc(change("\n3\t0.0200", "\n3\t")), "Time: found frames without a time"),
    "not a person": (
        trc(lambda text: text.replace("knee", "wheel")),
        "markers: found none that give left_knee",
    ),
    "nothing seen": (
        lambda folder: written(
            folder, foreign.trc(foreign.markers()[0], np.full((T, 17, 3), np.nan)), "clip.trc"
        ),
        "markers: found none that is ever seen",
    ),
}


@pytest.mark.parametrize("name", TRC)
def test_bad_trc_gives_one_clear_line(tmp_path: Path, name: str) -> None:
    write, found = TRC[name]
    assert_refused(write(tmp_path), Options(), found)


def test_joint_angles_are_refused(tmp_path: Path) -> None:
    text = "Coordinates\nversion=1\nnRows=1\nnColumns=2\ninDegrees=yes\nendheader\ntime\tknee\n0.0\t1.0\n"
    assert_refused(written(tmp_path, text, "ik.mot"), Options(), "joint angles", "(TRC)")
    forces = "grf\nnRows=1\nendheader\ntime\tground_force_vx\n0.0\t1.0\n"
    assert_refused(written(tmp_path, forces, "grf.mot"), Options(), "found forces (MOT, STO)", "(TRC)")


def c3d(folder: Path, processor: str = "intel", scale: float | None = None, analog: int = 0) -> Path:
    labels, places = foreign.markers()
    places[3, labels.index("L_toe")] = np.nan
    path = folder / "clip.c3d"
    places = 1000 * places
    path.write_bytes(
        c3d_file.c3d(labels, places, rate_hz=200.0, processor=processor, scale=scale, analog=analog)
    )
    return path


@pytest.mark.parametrize("analog", [0, 12])
@pytest.mark.parametrize("scale", [None, 0.1])
@pytest.mark.parametrize("processor", ["intel", "dec", "mips"])
def test_c3d_round_trip(tmp_path: Path, processor: str, scale: float | None, analog: int) -> None:
    """Of every processor, as real or whole numbers, beside analog channels."""
    found = evidence.read(c3d(tmp_path, processor, scale, analog))
    labels, places = foreign.markers()
    at = {name: found.joints_m[:, i] for i, name in enumerate(found.joint_names)}
    wanted = foreign.y_to_z(places[:, labels.index("L_HJC")])
    np.testing.assert_allclose(at["left_hip"], wanted, atol=1e-5 if scale is None else 1e-4)
    assert np.isnan(at["left_toe"][3]).all()
    assert np.isfinite(at["left_toe"][4]).all()
    np.testing.assert_allclose(np.diff(found.times_s), 1 / 200)
    assert "unit mm (as the file says), up y" in found.reading


def test_bad_c3d_gives_one_clear_line(tmp_path: Path) -> None:
    path = c3d(tmp_path)
    raw = path.read_bytes()
    for share in (0.05, 0.3, 0.6, 0.8):
        path.write_bytes(raw[: int(share * len(raw))])
        assert_refused(path, Options())


def test_c3d_with_damaged_parameters_gives_one_clear_line(tmp_path: Path) -> None:
    """A chain that leads nowhere, shapes beyond the file, kinds that there are not, no parameters."""
    path = c3d(tmp_path)
    raw = path.read_bytes()
    scale, labels = raw.index(b"SCALE"), raw.index(b"LABELS")
    for at, put, said in (
        (labels + 6, b"\xff\xff", "after which none can begin"),
        (labels + 6, b"\x09\x00", "after which none can begin"),
        (labels + 8, b"\x7f", "a parameter of kind 127"),
        (labels + 9, b"\x02\xff\xff", "before what it announces"),
        (scale + 7, b"\x09", "a parameter of kind 9"),
        (516, b"\x00\x54", "no labels of points"),
    ):
        path.write_bytes(raw[:at] + put + raw[at + len(put) :])
        assert_refused(path, Options(), said)


def test_c3d_whose_rate_is_text_has_that_of_its_header(tmp_path: Path) -> None:
    path = c3d(tmp_path)
    raw = path.read_bytes()
    at = raw.index(b"RATE") + 6
    path.write_bytes(raw[:at] + b"\xff\x00" + raw[at + 2 :])
    np.testing.assert_allclose(np.diff(evidence.read(path).times_s), 1 / 200)


@pytest.mark.parametrize("how", ["LONG_FRAMES", "TRIAL"])
def test_c3d_of_many_frames_counts_them_where_a_word_is_too_short(tmp_path: Path, how: str) -> None:
    path = c3d(tmp_path)
    raw = path.read_bytes()
    raw = raw[:8] + b"\xff\xff" + raw[10:]
    path.write_bytes(raw)
    assert_refused(path, Options(), "65535 frames")
    more = parameter(1, "LONG_FRAMES", 4, b"\x00" + struct.pack("<f", 12.0))
    if how == "TRIAL":
        more = b"\x05\xfeTRIAL\x03\x00\x00"
        for name, words in (("START", (1, 0)), ("END", (12, 0))):
            more += parameter(2, f"ACTUAL_{name}_FIELD", 2, b"\x01\x02" + struct.pack("<2h", *words))
    end = raw.rindex(b"UNITS") - 2  # before the last parameter
    longer = raw[512:end] + more + raw[end:]
    block = longer.index(b"mm") + 3
    path.write_bytes(raw[:512] + longer[:block].ljust(512, b"\x00") + raw[1024:])
    assert len(evidence.read(path).times_s) == 12


def parameter(group: int, name: str, kind: int, value: bytes) -> bytes:
    """A parameter of a C3D file: its shape and numbers as bytes."""
    tail = bytes([kind]) + value + b"\x00"
    return bytes([len(name), group]) + name.encode() + struct.pack("<h", 2 + len(tail)) + tail


@pytest.mark.parametrize("clip", ["walk", "run", "dance", "kick", "backflip"])
def test_real_bvh(shared_data: Path, clip: str) -> None:
    found = evidence.read(shared_data / "mocap" / "mass_bvh" / f"{clip}.bvh")
    assert "unit cm" in found.reading
    assert "up y" in found.reading
    low = np.quantile(found.joints_m[..., 2].min(axis=1), 0.1)
    assert -0.1 < low < 0.15


@pytest.mark.parametrize("trial", ["walking1", "squatsAsym1", "DJ1"])
def test_real_trc(shared_data: Path, trial: str) -> None:
    found = evidence.read(shared_data / "grf" / "opencap_subject4" / f"{trial}.trc")
    at = {name: found.joints_m[:, i] for i, name in enumerate(found.joint_names)}
    thigh = np.nanmedian(np.linalg.norm(at["left_hip"] - at["left_knee"], axis=-1))
    shank = np.nanmedian(np.linalg.norm(at["left_knee"] - at["left_ankle"], axis=-1))
    assert 0.34 < thigh < 0.44
    assert 0.34 < shank < 0.44
