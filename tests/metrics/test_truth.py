from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.metrics import truth as truths


def test_body_joints_start_with_the_hips() -> None:
    assert len(set(truths.BODY_JOINTS)) == 12
    assert truths.BODY_JOINTS[:2] == ("left_hip", "right_hip")


def test_read_truth(tmp_path: Path, rng: np.random.Generator) -> None:
    joints = rng.normal(size=(6, 12, 3))
    path = tmp_path / "truth.npz"
    arrays = {
        "schema": "simrecon.truth/1",
        "times_s": np.arange(6) / 10,
        "joint_names": np.array(truths.BODY_JOINTS),
        "joints_m": joints,
        "peer_names": np.array(["other"]),
    }
    np.savez(path, **arrays)
    truth = truths.read_truth(path)
    assert truth.joint_names == truths.BODY_JOINTS
    np.testing.assert_array_equal(truth.joints_m, joints)
    for key, value in (
        ("schema", "simrecon.evidence/1"), ("times_s", arrays["times_s"][::-1]), ("joints_m", joints[:5]),
        ("joints_m", np.where(joints > 1, np.nan, joints)), ("joint_names", np.array(["a"] * 12)),
    ):  # fmt: skip
        np.savez(path, **arrays | {key: value})
        with pytest.raises(InputError, match=f"truth.npz: {key}: found"):
            truths.read_truth(path)
