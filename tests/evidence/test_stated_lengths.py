"""Lengths that a file states of the person."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import evidence as readers
from simrecon.errors import InputError
from simrecon.evidence import from_arrays
from simrecon.types import Evidence

POSE = {"left_hip": (0.0, 0.09, 0.9), "left_knee": (0.0, 0.09, 0.5), "left_ankle": (0.0, 0.09, 0.09)}


def standing() -> Evidence:
    places = np.tile(np.array(list(POSE.values())), (2, 1, 1))
    return from_arrays(np.array([0.0, 0.1]), joint_names=tuple(POSE), joints_m=places)


def test_they_are_kept_and_go_before_what_is_measured(tmp_path: Path) -> None:
    seen = from_arrays(
        np.array([0.0, 0.1]),
        joint_names=tuple(POSE),
        joints_m=np.tile(np.array(list(POSE.values())), (2, 1, 1)),
    )
    assert bodies.measure(seen)["thigh"] == pytest.approx(0.4)
    path = tmp_path / "seen.npz"
    readers.write(path, replace(seen, lengths_m=(("thigh", 0.43), ("skull", 0.2))))
    again = readers.read(path)
    assert again.lengths_m == (("thigh", 0.43), ("skull", 0.2))
    assert bodies.measure(again)["thigh"] == 0.43


@pytest.mark.parametrize(
    ("lengths", "message"),
    [
        ((("nose", 0.1),), "length_names: found unknown nose; valid: trunk"),
        ((("thigh", -0.1),), "lengths_m: found -0.1 to -0.1; valid: above 0"),
    ],
)
def test_impossible_ones_are_refused(
    lengths: tuple[tuple[str, float], ...], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message):
        readers.write(tmp_path / "seen.npz", replace(standing(), lengths_m=lengths))
