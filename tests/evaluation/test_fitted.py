"""Kinematic fits as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evaluation import fitted
from simrecon.io import atomic
from tests.support import runs


@pytest.mark.parametrize(("value", "found"), [(1j, "values of type complex128"), (1e300, "a number of ")])
def test_distances_that_are_none_are_refused(tmp_path: Path, value: complex, found: str) -> None:
    path = tmp_path / "fit.npz"
    fitted.write(path, runs.reconstructed().fit, 1.0)
    assert fitted.read(path).mpjpe_2d_px > 0
    with np.load(path) as whole:
        arrays = dict(whole)
    atomic.write_npz(path, arrays | {"reprojection_px": arrays["reprojection_px"] * value + value})
    with pytest.raises(InputError, match=rf"reprojection_px: found {found}"):
        fitted.read(path)
