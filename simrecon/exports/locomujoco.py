"""A trajectory of LocoMuJoCo 1.x (`Trajectory.load`), of the person with hinges, with the model it is of.

Bodies are those of the model without the world's; velocities `cvel` are MuJoCo's, about the centre of mass of
the person.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.body import hinges
from simrecon.exports.view import ResultView
from simrecon.io import atomic
from simrecon.sim.models import compile_text
from simrecon.sim.poses import differentiate, posed
from simrecon.types import Array

STATE = ("xpos", "xquat", "cvel", "subtree_com", "site_xpos", "site_xmat")
OF_BODIES = ("rootid", "weldid", "mocapid", "pos", "quat", "ipos", "iquat")


def write(view: ResultView) -> dict[str, bytes]:
    """The trajectory, and the model."""
    text = hinges.mjcf(view.body)
    model = compile_text(text)
    qpos = hinges.configurations(view.qpos)
    qvel = differentiate(model, qpos, view.interval_s)
    content: dict[str, Any] = {
        "joint_names": np.array(hinges.joint_names(view.body.skeleton)),
        "body_names": np.array([model.body(row).name for row in range(model.nbody)]),
        "site_names": np.array([model.site(row).name for row in range(model.nsite)]),
        "frequency": view.rate_hz,
        "njnt": model.njnt,
        "jnt_type": model.jnt_type.copy(),
        "nbody": model.nbody,
        "nsite": model.nsite,
        "split_points": np.array([0, len(qpos)]),
        "qpos": qpos,
        "qvel": qvel,
        **{f"body_{key}": getattr(model, f"body_{key}").copy() for key in OF_BODIES},
        **{f"site_{key}": getattr(model, f"site_{key}").copy() for key in ("bodyid", "pos", "quat")},
        **_states(model, qpos, qvel),
    }
    return {"locomujoco.npz": atomic.npz_bytes(content), "locomujoco.xml": text.encode("utf-8")}


def _states(model: Any, qpos: Array, qvel: Array) -> dict[str, Array]:
    """What MuJoCo's data hold at each configuration."""
    rows: dict[str, list[Array]] = {name: [] for name in STATE}
    for data in posed(model, qpos, qvel):
        for name in STATE:
            rows[name].append(getattr(data, name).copy())
    return {name: np.stack(values) for name, values in rows.items()}
