"""A focal length that nobody knows: the parabola, and a walk whose steps in depth tell it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon.evidence.camera import fov
from simrecon.kinematics import lens
from simrecon.types import Evidence, KinematicFit


def test_without_a_word_of_the_motion_the_usual_lens_stands() -> None:
    offsets = 0.2 * np.array(lens.STEPS)
    assert lens.most_probable(offsets, np.full(5, 7.0), 0.2) == pytest.approx((0.0, 0.2))


def test_the_motion_and_the_usual_lens_are_weighed_by_their_variances() -> None:
    """Evidence of 0.1 ± 0.2 beside 0 ± 0.2: half-way, and more certain than either."""
    offsets = 0.2 * np.array(lens.STEPS)
    left = 3.0 + (offsets - 0.1) ** 2 / (lens.SHARE * 0.2**2)
    offset, deviation = lens.most_probable(offsets, left, 0.2)
    assert offset == pytest.approx(0.05)
    assert deviation == pytest.approx(0.2 / np.sqrt(2))


def test_evidence_that_bends_the_wrong_way_makes_nothing_more_certain() -> None:
    offsets = 0.2 * np.array(lens.STEPS)
    offset, deviation = lens.most_probable(offsets, -(offsets**2) - offsets, 0.2)
    assert 0 < offset < 0.4
    assert deviation == pytest.approx(0.2)


def evidence(focal_sigma: float) -> Evidence:
    frames = 40
    return Evidence(
        np.arange(frames) / 60, ("nose",), np.zeros((frames, 1, 2)), np.ones((frames, 1)),
        (), np.empty((frames, 0, 3)), "world", camera=fov.pinhole(900.0, (1280, 720), focal_sigma),
    )  # fmt: skip


def test_several_lenses_are_tried_on_a_thinned_clip() -> None:
    tried: list[float] = []

    def fit(seen: Evidence) -> KinematicFit:
        assert seen.camera is not None
        assert seen.camera.lens.focal_sigma == 0
        assert len(seen.times_s) == 14  # 20 Hz
        tried.append(float(seen.camera.lens.matrix_px[0, 0]))
        loss = {"keypoint": (np.log(tried[-1] / 1000.0) / 0.02) ** 2, "contact": 1e6}
        return KinematicFit(*[None] * 9, loss)  # type: ignore[call-arg, arg-type]

    found = lens.estimated(evidence(0.2), fit).camera
    assert found is not None
    assert found.lens.matrix_px[0, 0] == pytest.approx(1000.0, rel=0.005)
    assert 0 < found.lens.focal_sigma < 0.03
    assert len(tried) == 5
    known = evidence(0.0)
    assert lens.estimated(known, fit) is known
    blind = replace(evidence(0.2), camera=None, keypoint_names=())
    assert lens.estimated(blind, fit) is blind
