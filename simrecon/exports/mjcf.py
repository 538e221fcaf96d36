"""The person as MJCF with hinges only, and their motion, for tools without ball joints.

The result itself holds the model that was simulated, with ball joints (`model.xml`), and its states.
"""

from __future__ import annotations

import numpy as np

from simrecon.body import hinges
from simrecon.exports.view import ResultView
from simrecon.io import atomic
from simrecon.sim.models import compile_text
from simrecon.sim.poses import differentiate


def write(view: ResultView) -> dict[str, bytes]:
    """A model of the person alone, and `qpos`, `qvel` of each frame."""
    text = hinges.mjcf(view.body)
    qpos = hinges.configurations(view.qpos)
    content = {
        "joint_names": np.array(hinges.joint_names(view.body.skeleton)),
        "times_s": view.times_s - view.times_s[0],
        "qpos": qpos,
        "qvel": differentiate(compile_text(text), qpos, view.interval_s),
    }
    return {"hinges.xml": text.encode("utf-8"), "hinges.npz": atomic.npz_bytes(content)}
