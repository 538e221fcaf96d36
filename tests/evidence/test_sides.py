"""Left and right that were mixed up in runs of frames are found in any evidence, and put in order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import evidence, resources
from simrecon.evidence import sides
from simrecon.types import Evidence

T = 60
PARTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "heel", "toe")
RUNS = [[7], [0, 1, 2], [57, 58, 59], list(range(20, 28)), [*range(5, 9), *range(30, 35), 50]]


@pytest.fixture
def walk() -> Evidence:
    """Someone who walks across the image, seen from the side and a little from behind: limbs cross."""
    rng = np.random.default_rng(0)
    names = ("nose", *(f"{side}_{part}" for part in PARTS for side in ("left", "right")))
    times = np.arange(T) / 30
    joints = np.zeros((T, len(names), 3))
    joints[:, :, 0] = 1.2 * times[:, None]
    for i, name in enumerate(names[1:], 1):
        side = 1 if name.startswith("left") else -1
        free = name.split("_")[1] not in ("shoulder", "hip")
        joints[:, i, 0] += side * (0.3 if free else 0.03) * np.sin(2 * np.pi * times)
        joints[:, i, 1:] = 0.15 * side, 1.5 - 0.1 * i
    joints += rng.normal(scale=0.01, size=joints.shape)
    image = np.stack((300 * joints[..., 0] + 60 * joints[..., 1], 800 - 300 * joints[..., 2]), axis=-1)
    image += rng.normal(scale=2.0, size=image.shape)
    return Evidence(times, names, image, np.full(image.shape[:2], 0.9), names, joints, "world")


def mixed(given: Evidence, rows: list[int], limbs: str, kind: str = "both") -> Evidence:
    points, scores, joints = given.keypoints_px.copy(), given.scores.copy(), given.joints_m.copy()
    index, at = sides.pairs(given.joint_names, limbs), np.array(rows)[:, None]
    for values in (
        (points, scores) if kind == "2D" else (joints,) if kind == "3D" else (points, scores, joints)
    ):
        values[at, index.ravel()] = values[at, index[:, ::-1].ravel()]
    return replace(given, keypoints_px=points, scores=scores, joints_m=joints)


def test_what_is_in_order_is_left_alone(walk: Evidence) -> None:
    assert sides.find(walk).as_dict() == {}
    assert sides.in_order(walk) is walk
    shipped = evidence.read(resources.folder("example") / "beam.npz")
    assert sides.in_order(shipped) is shipped


@pytest.mark.parametrize("rows", RUNS)
@pytest.mark.parametrize("limbs", ["arms", "legs"])
def test_runs_of_frames_are_put_in_order(walk: Evidence, rows: list[int], limbs: str) -> None:
    given = mixed(walk, rows, limbs)
    found = {name: frames.tolist() for name, frames in sides.find(given).as_dict().items()}
    assert found == {f"{limbs} 2D": rows, f"{limbs} 3D": rows}
    back = sides.in_order(given)
    np.testing.assert_array_equal(back.keypoints_px, walk.keypoints_px)
    np.testing.assert_array_equal(back.scores, walk.scores)
    np.testing.assert_array_equal(back.joints_m, walk.joints_m)
    assert sides.in_order(back) is back


@pytest.mark.parametrize("kind", ["2D", "3D"])
def test_image_and_estimate_are_told_apart(walk: Evidence, kind: str) -> None:
    found = sides.find(mixed(mixed(walk, [10, 11, 12], "legs", kind), [40], "arms", kind)).as_dict()
    assert {name: frames.tolist() for name, frames in found.items()} == {
        f"arms {kind}": [40], f"legs {kind}": [10, 11, 12]
    }  # fmt: skip


def test_unseen_landmarks_frames_and_gaps(walk: Evidence) -> None:
    given = mixed(walk, [20, 21, 22], "legs")
    points, joints = given.keypoints_px.copy(), given.joints_m.copy()
    points[21], joints[21] = np.nan, np.nan
    points[30:45, sides.pairs(walk.keypoint_names, "legs")[0]] = np.nan
    found = sides.find(replace(given, keypoints_px=points, joints_m=joints)).as_dict()
    assert {name: frames.tolist() for name, frames in found.items()} == {
        "legs 2D": [20, 22], "legs 3D": [20, 22]
    }  # fmt: skip
    unseen = replace(given, keypoints_px=np.full_like(points, np.nan), joints_m=np.full_like(joints, np.nan))
    assert sides.in_order(unseen) is unseen


def test_nothing_is_interpolated_between_two_sides(walk: Evidence) -> None:
    # a clock that is off by a third of an interval in the middle, so that its frames are interpolated
    times = walk.times_s + np.where(np.arange(T) >= 30, 0.01, 0.0)
    clean, _ = evidence.resample(replace(walk, times_s=times))
    back, _ = evidence.resample(replace(mixed(walk, [35, 36, 37, 38], "legs"), times_s=times))
    np.testing.assert_array_equal(back.joints_m, clean.joints_m)
    np.testing.assert_array_equal(back.keypoints_px, clean.keypoints_px)


def test_a_spin_is_no_exchange() -> None:
    """Someone who turns about the vertical at 900 degrees a second, with arms stretched out."""
    angle = np.radians(900) * np.arange(T) / 30
    arm = np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=-1)
    joints = np.stack([side * reach * arm for side in (1, -1) for reach in (0.2, 0.45, 0.7)], axis=1)
    names = tuple(f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "elbow", "wrist"))
    given = Evidence(
        np.arange(T) / 30, names, 200 * joints[..., ::2], np.ones((T, 6)), names, joints, "world"
    )
    assert sides.in_order(given) is given
