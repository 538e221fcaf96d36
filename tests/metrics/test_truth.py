from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from simrecon.body.primitives import FEET
from simrecon.errors import InputError
from simrecon.metrics import truth as truths


def test_body_joints_start_with_the_hips() -> None:
    assert len(set(truths.BODY_JOINTS)) == 12
    assert truths.BODY_JOINTS[:2] == ("left_hip", "right_hip")


def test_forces_on_the_primitives_of_a_simulated_reference(tmp_path: Path) -> None:
    """They take the place of what plates measured; a reference without feet is refused."""
    force = np.arange(6 * 3 * 3.0).reshape(6, 3, 3)
    arrays: dict[str, ArrayLike] = {
        "schema": "simrecon.truth/1",
        "times_s": np.arange(6) / 30,
        "joint_names": np.array(truths.BODY_JOINTS),
        "joints_m": np.zeros((6, 12, 3)),
        "contact_body": np.array(["pelvis", "right_foot", "left_foot"]),
        "contact_force_N": force,
        "grf_left_N": np.zeros((6, 3)),
        "grf_right_N": np.zeros((6, 3)),
    }
    path = tmp_path / "truth.npz"
    np.savez(path, allow_pickle=False, **arrays)
    truth = truths.read_truth(path)
    assert truth.plates is None
    assert truth.pushes is not None
    np.testing.assert_array_equal(truth.pushes.on(FEET), force[:, [2, 1]])
    np.savez(path, allow_pickle=False, **arrays | {"contact_body": np.array(["pelvis", "right_foot", "l"])})
    with pytest.raises(InputError, match="contact_body: found no left_foot; valid: both feet"):
        truths.read_truth(path)


def test_read_truth(tmp_path: Path, rng: np.random.Generator) -> None:
    joints, times_s = rng.normal(size=(6, 12, 3)), np.arange(6) / 10
    path = tmp_path / "truth.npz"
    arrays: dict[str, ArrayLike] = {
        "schema": "simrecon.truth/1",
        "times_s": times_s,
        "joint_names": np.array(truths.BODY_JOINTS),
        "joints_m": joints,
        "peer_names": np.array(["other"]),
    }
    np.savez(path, allow_pickle=False, **arrays)
    truth = truths.read_truth(path)
    assert truth.joint_names == truths.BODY_JOINTS
    np.testing.assert_array_equal(truth.joints_m, joints)
    for key, value in (
        ("schema", "simrecon.evidence/1"), ("times_s", times_s[::-1]), ("joints_m", joints[:5]),
        ("joints_m", np.where(joints > 1, np.nan, joints)), ("joint_names", np.array(["a"] * 12)),
    ):  # fmt: skip
        np.savez(path, allow_pickle=False, **arrays | {key: value})
        with pytest.raises(InputError, match=f"truth.npz: {key}: found"):
            truths.read_truth(path)
