"""What a run has solved so far, as a clip, while the other windows are still to come."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simrecon import scene as scenes
from simrecon.results.kinematic import coordinates
from simrecon.sim.models import compile_text
from simrecon.sim.state import qpos_of, state_size
from simrecon.studio.clip import Clip
from simrecon.types import Scene, WindowResult

_RATE_HZ = 30.0


def of_windows(clip: Clip, scene: Scene, windows: Sequence[WindowResult]) -> Clip | None:
    """The solved beginning of a run of the same person; None where there is none.

    Args:
        clip: of the person, before the run; its times begin with the run's.
        scene: that the run is in.
        windows: solved, in order.
    """
    if not windows:
        return None
    model = compile_text(scenes.build(clip.body.mjcf, scenes.hard_floor(scene), 0.01))
    states = np.concatenate([window.states[:-1] for window in windows] + [windows[-1].states[-1:]])
    if states.shape[1] != state_size(model):
        return None  # of a floor whose stiffness is fitted meanwhile
    since = states[:, 0]  # the first number of a state is its time
    rows = np.unique(np.searchsorted(since, np.arange(since[0], since[-1] + 1e-9, 1 / _RATE_HZ)))
    rows = rows[rows < len(states)]
    qpos = qpos_of(model, states[rows])[:, : coordinates(clip.body)]
    times = float(clip.times_s[0]) + since[rows] - since[0]
    bare = replace(clip, title="solved so far", scene=scene, times_s=times, qpos=qpos)
    return replace(bare, fit_qpos=None, motion=None, touched={}, moved={})
