"""DeepLabCut's CSV, of one individual and of several."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.types import Array, Camera, Lens
from tests.support.foreign_files import FPS, T, landmarks

NAMES = ("nose", "left_hip", "Right Hip", "left_ankle", "tail")
LENS = Camera(Lens(np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]), np.zeros(5), (640, 480)))
ASKED = Options(fps=FPS, camera=LENS)


def table(path: Path, people: tuple[str, ...] = ("",), names: tuple[str, ...] = NAMES) -> tuple[Path, Array]:
    """A file of moving landmarks, the last of which is not seen in frame 3; and those of the last person."""
    owners = [person for person in people for _ in names for _ in range(3)]
    head = [["scorer", *["net"] * len(owners)]]
    if people != ("",):
        head.append(["individuals", *owners])
    head.append(["bodyparts", *[name for _ in people for name in names for _ in range(3)]])
    head.append(["coords", *["x", "y", "likelihood"] * (len(owners) // 3)])
    seen = [landmarks(len(names), seed=k + 1) for k in range(len(people))]
    for t in range(T):
        row = [str(t)]
        for points, scores in seen:
            row += [f"{v:.4f}" for v in np.concatenate((points[t], scores[t][:, None]), axis=1).ravel()]
        if t == 3:
            row[-3:] = ["", "", ""]
        head.append(row)
    path.write_text("\n".join(",".join(row) for row in head) + "\n", encoding="utf-8")
    return path, seen[-1][0]


def test_landmarks_of_known_names_are_read(tmp_path: Path) -> None:
    path, points = table(tmp_path / "one.csv")
    seen = evidence.read(path, ASKED)
    assert seen.reading.startswith("DeepLabCut")
    assert seen.keypoint_names == ("nose", "left_hip", "right_hip", "left_ankle")  # a person has no tail
    np.testing.assert_allclose(seen.keypoints_px, points[:, :4], atol=1e-3)
    np.testing.assert_allclose(seen.times_s, np.arange(T) / FPS)


def test_of_several_people_one_is_chosen(tmp_path: Path) -> None:
    path, points = table(tmp_path / "two.csv", people=("anna", "ben"), names=NAMES[:4])
    seen = evidence.read(path, Options(fps=FPS, camera=LENS, person="ben"))
    assert np.isnan(seen.keypoints_px[3, 3]).all()
    kept = np.isfinite(seen.keypoints_px)
    np.testing.assert_allclose(seen.keypoints_px[kept], points[kept], atol=1e-3)
    assert kept.sum() == points.size - 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("coords,x,y", "coords,y,x", "coords: found y, x"),
        ("bodyparts,", "bodyparts,nose,", "bodyparts: found 16 cells; valid: 15, as coords has"),
        ("\n2,", "\ntwo,", "line 6: found could not convert"),
        ("\n2,", "\n2,1.0,", "line 6: found 16 numbers after the first"),
        ("nose,nose,nose,left_hip", "nose,nose,nose,paw", "bodyparts: found"),
    ],
)
def test_damage_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    path, _ = table(tmp_path / "one.csv")
    text = path.read_text(encoding="utf-8").replace(old, new, 1)
    if "paw" in new:
        for i, name in enumerate(NAMES):
            text = text.replace(name, f"paw{i}")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        evidence.read(path, ASKED)
    assert "\n" not in str(caught.value)
