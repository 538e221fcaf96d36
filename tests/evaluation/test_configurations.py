from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.evaluation.configurations import configurations, foot_rest
from simrecon.types import Scene


def test_soles_of_someone_who_stands(standing: Any) -> None:
    model, body, qpos = standing.problem.model, standing.fit.body, standing.fit.qpos[:2].copy()
    parts = tuple(primitive.name for primitive in body.primitives)
    shown = configurations(model, Scene(), qpos, parts, body.skeleton.point_names)
    np.testing.assert_allclose(shown.soles_m, 0, atol=1e-6)
    np.testing.assert_allclose(shown.feet_m, 0, atol=1e-6)
    qpos[:, 2] += 0.1
    raised = configurations(model, Scene(), qpos, parts, body.skeleton.point_names)
    np.testing.assert_allclose(raised.soles_m, 0.1, atol=1e-6)
    np.testing.assert_allclose(raised.corners_m - shown.corners_m, [[[0, 0, 0.1]] * 8] * 2, atol=1e-6)
    assert {"left_heel", "right_toe"} <= set(foot_rest(model))
    heels = shown.points_m[0, [body.skeleton.point_names.index(f"{side}_heel") for side in ("left", "right")]]
    rest = [foot_rest(model)[f"{side}_heel"] for side in ("left", "right")]
    np.testing.assert_allclose(heels[:, 2], rest, atol=1e-6)
