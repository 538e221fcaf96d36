"""The maker of the suite `possible`, without its simulations."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon.bench import suite
from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.metrics.truth import BODY_JOINTS
from tests.support.standing import NAMES, standing
from tools.make import possible

OBSERVER = """
import sys
from pathlib import Path
result, name, folder, seed = sys.argv[1:]
Path(folder, name + ".txt").write_text(result + " " + seed)
"""


def report(mean_m: float = 0.01, worst_m: float = 0.05, *, fell: bool = False, fallback: int = 0) -> Any:
    agreement = {"fit_mean_m": mean_m, "fit_max_m": worst_m, "fell": fell}
    person = {"height_m": 1.7}
    return {
        "agreement": agreement, "frames": {"fallback": fallback}, "person": person, "totals": {"cpu_s": 1.0}
    }  # fmt: skip


@pytest.fixture
def making(tmp_path: Path) -> possible.Making:
    """Two seconds of a person who stands, at 60 frames a second, and a program that looks at results."""
    data = tmp_path / "data"
    data.mkdir()
    times_s, joints = np.arange(120) / 60, np.repeat(standing()[None], 120, axis=0)
    np.savez(data / "stand.npz", times_s=times_s, joint_names=NAMES, joints_m=joints)
    (tmp_path / "look.py").write_text(OBSERVER, encoding="utf-8")
    return possible.Making(data, tmp_path / "made", tmp_path / "look.py", "overnight", 0, 1)


MOTION = possible.Motion("stand", "stand.npz", 70.0, 3, span_s=(0.5, 1.5))


def test_the_suite_has_the_motions_of_the_list() -> None:
    motions = tables.read(possible.Motions, possible.MOTIONS, "list").motion
    assert [clip.name for clip in suite.read("possible").clip] == [motion.name for motion in motions]
    assert len({motion.view for motion in motions}) == len(motions)


def test_a_recording_is_cut_to_thirty_frames_a_second(making: possible.Making) -> None:
    seen = possible.recording(making.data, MOTION)
    np.testing.assert_allclose(seen.times_s, np.arange(31) / 30)
    assert set(BODY_JOINTS) <= set(seen.joint_names)
    assert (seen.mass_kg, seen.trust) == (70.0, possible.TRUST)


def test_what_is_there_is_kept(making: possible.Making, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def simulated(*_: Any) -> Any:
        calls.append(1)
        return report()

    monkeypatch.setattr(possible, "_simulated", simulated)
    possible.make(making, [MOTION])
    looked = (making.folder / "stand.txt").read_text(encoding="utf-8")
    assert looked == f"{making.folder / 'made' / 'stand' / 'result'} 3"
    (row,) = possible.make(making, [MOTION])
    assert row["kept"]
    assert len(calls) == 1
    possible.make(making, [replace(MOTION, mass_kg=71.0)])
    possible.make(replace(making, plan="default"), [MOTION])
    assert len(calls) == 3
    listed = json.loads((making.folder / "possible.json").read_text(encoding="utf-8"))
    assert [(row["name"], row["plan"], row["height_m"]) for row in listed] == [("stand", "default", 1.7)]


@pytest.mark.parametrize(
    ("said", "verdict"),
    [
        (report(0.07), "left out: 70 mm from its reference, 50 mm in the worst frame"),
        (report(0.01, 0.3), "left out: 10 mm from its reference, 300 mm in the worst frame"),
        (report(fell=True, fallback=2), "left out: not all frames are simulated, the person fell"),
    ],
)
def test_a_bad_truth_is_left_out(
    making: possible.Making, monkeypatch: pytest.MonkeyPatch, said: Any, verdict: str
) -> None:
    monkeypatch.setattr(possible, "_simulated", lambda *_: said)
    (row,) = possible.make(making, [MOTION])
    assert (row["kept"], row["verdict"]) == (False, verdict)
    assert not (making.folder / "stand.txt").exists()


def test_what_is_missing_is_named(making: possible.Making) -> None:
    with pytest.raises(
        InputError, match=r"no\.py: cannot be read .*; give the program that looks at motions"
    ):
        possible.make(replace(making, observer=Path("no.py")), [MOTION])
    with pytest.raises(InputError, match="--only: found run; valid: stand"):
        possible.chosen((MOTION,), ["run"])
    (row,) = possible.make(making, [replace(MOTION, span_s=(5.0, 6.0))])
    assert row["verdict"].startswith("left out: stand.npz: --from 5 --to 6")
