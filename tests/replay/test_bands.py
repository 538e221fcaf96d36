"""Bands of force and pose: what they are made of, and that files keep them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import replay
from simrecon.evidence import resample
from simrecon.replay import bands
from simrecon.results import motion_file


@pytest.fixture(scope="module")
def grid(run: Any) -> Any:
    return resample(run.evidence)[1]


def test_a_run_has_bands_about_what_it_shows(run: Any) -> None:
    motion = run.motion
    low, high = np.moveaxis(motion.band_joints_m, -1, 0)
    np.testing.assert_allclose((low + high) / 2, motion.joints_m, atol=1e-12)
    assert (high > low).all()
    loaded = motion.loaded
    assert not loaded[0]
    for band in (motion.band_grf_N, motion.band_feet_N):
        assert np.isfinite(band[loaded]).all()
        assert np.isnan(band[~loaded]).all()
        assert (band[loaded][..., 1] > band[loaded][..., 0]).all()
        assert band[loaded][..., 2, 0].min() >= 0.0
    least = 2 * bands.calibration().floor * 9.81 * run.fit.body.mass_kg
    width = np.diff(motion.band_grf_N[loaded], axis=-1)[..., 0]
    assert (width[:, 0] > 0.9 * least).all()
    assert ((motion.contact_probability[loaded] >= 0) & (motion.contact_probability[loaded] <= 1)).all()
    foot = motion.contact_body.index("left_foot")
    assert motion.contact_probability[-1, foot] > 0.5


def test_a_population_that_agrees_leaves_floor_and_share(run: Any, grid: Any) -> None:
    """No spread, a plan that asks for nothing, and forces that do not change: all that is left is chosen."""
    weight_N, told = 9.81 * run.fit.body.mass_kg, bands.calibration()
    feet = [run.motion.contact_body.index(f"{side}_foot") for side in ("left", "right")]
    force = np.zeros_like(run.motion.contact_force_N)
    force[:, feet, 2] = weight_N / 2
    motion = replace(run.motion, contact_force_N=force)
    windows = [
        replace(one, spread=replace(one.spread, force_N=0 * one.spread.force_N)) for one in run.windows
    ]
    bare = replace(run.reference, contact_force_N=None)
    known = bands.forces(motion, run.problem, run.fit.body, bare, windows, grid)
    assert known is not None
    assert not known.planned
    inner = motion.loaded
    np.testing.assert_allclose(
        known.centre_N[inner, :, 2], [[weight_N / 2, weight_N / 2, weight_N]] * inner.sum()
    )
    np.testing.assert_allclose(known.sigma_N[inner, 2], told.floor * weight_N, rtol=1e-6)
    assert known.sigma_N[inner, 0, 2].max() <= np.hypot(told.floor, told.share) * weight_N + 1e-6
    assert known.sigma_N[inner, 0, 2].max() > 1.5 * told.floor * weight_N


def test_a_plan_that_asks_for_something_else_widens_them(run: Any, grid: Any) -> None:
    names = tuple(run.fit.body.skeleton.names)
    count = len(run.reference.times_s)
    asked = replace(
        run.reference,
        contact_names=("left",),
        contact_segments=(names[names.index("left_ankle")],),
        contact_parts=("left_foot",),
        contact_force_N=np.zeros((count, 1, 3)),
        contact_place_m=np.zeros((count, 1, 3)),
    )
    args = run.motion, run.problem, run.fit.body
    wide = bands.forces(*args, asked, run.windows, grid)
    bare = bands.forces(*args, replace(asked, contact_force_N=None), run.windows, grid)
    assert wide is not None
    assert bare is not None
    at = run.motion.loaded
    own = run.motion.grf_N[at, 2]
    assert (wide.sigma_N[at, 2, 2] > 0.3 * np.abs(own)).all()
    assert wide.centre_N[at, 2, 2].mean() == pytest.approx(bare.centre_N[at, 2, 2].mean() / 2)


def test_without_draws_there_are_none(run: Any, grid: Any) -> None:
    windows = [replace(one, spread=None) for one in run.windows]
    bare = replace(run.motion, band_grf_N=None, band_feet_N=None, contact_probability=None)
    motion = replay.banded(bare, run.problem, run.fit, run.reference, windows, grid)
    assert motion.band_grf_N is None
    assert motion.band_joints_m is not None


def test_a_file_keeps_them(run: Any, tmp_path: Path) -> None:
    (tmp_path / "motion.npz").write_bytes(motion_file.dumps(run.motion))
    back = motion_file.read(tmp_path)
    for key in ("band_joints_m", "band_grf_N", "band_feet_N", "contact_probability"):
        np.testing.assert_array_equal(getattr(back, key), getattr(run.motion, key))
