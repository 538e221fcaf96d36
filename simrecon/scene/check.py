"""Which things a motion goes through, when and how deep."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.scene import mjcf
from simrecon.types import Array, IntArray, Scene

START_MAX_M = 0.1
"""A thing deeper than this in the person at the first frame is in the wrong place."""


@dataclass(frozen=True, eq=False)
class Penetration:
    """How a motion goes through one thing.

    Attributes:
        name: of the thing, or `ground`.
        depth_m: (T,) depth of its deepest contact with the person, 0 without.
        parts: T names of the part of the body that is deepest, empty without contact.
    """

    name: str
    depth_m: Array
    parts: tuple[str, ...]

    @property
    def deepest(self) -> int:
        """The frame of the greatest depth."""
        return int(np.argmax(self.depth_m))

    def spans(self, least_m: float) -> tuple[tuple[int, int], ...]:
        """First and last frame of every run of frames that are deeper than `least_m`."""
        deep = np.concatenate(([False], self.depth_m > least_m, [False])).astype(np.int8)
        starts, ends = np.flatnonzero(np.diff(deep) == 1), np.flatnonzero(np.diff(deep) == -1) - 1
        return tuple(zip(starts.tolist(), ends.tolist(), strict=True))


def penetrations(model: mujoco.MjModel, scene: Scene, qpos: Array) -> tuple[Penetration, ...]:
    """Depths in the ground and in every thing, deepest first; a thing that is never touched is left out.

    Args:
        model: of person and scene.
        scene: that it was built from.
        qpos: (T, nq) configurations of the model.
    """
    things = (mjcf.GROUND_GEOM, *(item.name for item in scene.items))
    owners = _owners(model, scene, things)
    depth = np.zeros((len(things), len(qpos)))
    part = np.full(depth.shape, -1)
    data = mujoco.MjData(model)
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_fwdPosition(model, data)
        pair = owners[data.contact.geom].reshape(-1, 2)  # (ncon, 2)
        for row in np.flatnonzero((pair >= 0).sum(axis=1) == 1):
            thing = int(pair[row].max())
            deep = -float(data.contact.dist[row])
            if deep > depth[thing, frame]:
                depth[thing, frame] = deep
                part[thing, frame] = data.contact.geom[row][int(np.argmin(pair[row]))]
    found = [
        Penetration(name, depth[i], tuple(model.geom(p).name if p >= 0 else "" for p in part[i]))
        for i, name in enumerate(things)
        if depth[i].any()
    ]
    return tuple(sorted(found, key=lambda entry: -entry.depth_m.max()))


def refuse_start(model: mujoco.MjModel, scene: Scene, qpos: Array) -> None:
    """Check that nothing goes through the person at the first frame.

    Args:
        model: of person and scene.
        scene: that it was built from.
        qpos: (nq,) of the first frame.

    Raises:
        InputError: a thing does; it names thing, part and depth.
    """
    for found in penetrations(model, scene, qpos[None]):
        if found.name != mjcf.GROUND_GEOM and found.depth_m[0] > START_MAX_M:
            deep = 1e3 * float(found.depth_m[0])
            raise InputError(
                f"scene: item {found.name!r} goes {deep:.0f} mm through the person ({found.parts[0]}) at "
                f"the first frame, more than {1e3 * START_MAX_M:.0f} mm: move it; `simrecon scene show` "
                f"draws it"
            )


def _owners(model: mujoco.MjModel, scene: Scene, things: tuple[str, ...]) -> IntArray:
    """Row of `things` for every geom (ngeom,), -1 for the person's."""
    names = [mjcf.owner(model.geom(i).name, scene) for i in range(model.ngeom)]
    return np.array([-1 if name is None else things.index(name) for name in names], np.int64)
