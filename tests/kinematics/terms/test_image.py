"""Distance in the image, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.kinematics.terms.image import reprojection

CAMERA = np.eye(4)
CAMERA[:3, :3] = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
CAMERA[2, 3] = 5.0


def test_reprojection_by_hand() -> None:
    # 5 m in front of the camera, which looks along x with y to its left
    point = np.array([[[0.0, -1.0, 0.5]]])
    loss, _ = reprojection(point, np.array([[[0.2, -0.1]]]), np.ones((1, 1)), CAMERA, 0.1)
    assert loss == pytest.approx(0.0, abs=1e-12)
    loss, _ = reprojection(point, np.array([[[0.3, -0.1]]]), np.full((1, 1), 0.5), CAMERA, 0.1)
    assert loss == pytest.approx(0.5 * np.log(2.0))
