"""A fit of the example, from which planners go on."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon import kinematics, plan, resources
from simrecon import scene as scenes
from simrecon.evidence import resample
from simrecon.kinematics import layout
from simrecon.types import Evidence, KinematicFit

SETTINGS = plan.read("quick")


@pytest.fixture(scope="session")
def seen() -> Evidence:
    whole, _ = resample(readers.read(resources.folder("example") / "beam.npz"))
    return whole


@pytest.fixture(scope="session")
def fit(seen: Evidence) -> KinematicFit:
    scene = scenes.read(resources.folder("example") / "beam.toml")
    return kinematics.fit(seen, scene, SETTINGS.kinematics)


def variables_of(fit: KinematicFit) -> layout.Variables:
    """Those of a fit, on its own body."""
    root, _, rotvecs = layout.from_qpos(fit.qpos)
    leans = layout.leans(len(root), float(fit.times_s[1] - fit.times_s[0]))
    return layout.Variables(root, rotvecs, 0.0, 0.0, np.zeros(0), np.zeros((leans.shape[1], layout.LEAN)))
