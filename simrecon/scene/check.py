"""Which items a motion goes through, when and how deep."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.errors import InputError
from simrecon.scene import mjcf
from simrecon.sim import contacts
from simrecon.sim.poses import touching
from simrecon.types import Array, IntArray, Scene, runs

START_MAX_M = 0.1
"""An item deeper than this in the person at the first frame is in the wrong place."""


@dataclass(frozen=True, eq=False)
class Penetration:
    """How a motion goes through one item.

    Attributes:
        name: of the item, or `ground`.
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
        return tuple((rows.start, rows.stop - 1) for rows in runs(self.depth_m > least_m))


def penetrations(model: mujoco.MjModel, scene: Scene, qpos: Array) -> tuple[Penetration, ...]:
    """Depths in the ground and in every item, deepest first; an item that is never touched is left out.

    Args:
        model: of person and scene.
        scene: that it was built from.
        qpos: (T, nq) configurations of the model.
    """
    names = (*(item.name for item in scene.items), mjcf.GROUND_GEOM)
    own_row = owners(model, scene)
    person = np.where(own_row < 0, np.arange(model.ngeom), -1)  # each geom of the person is a part
    depth = np.zeros((len(names), len(qpos)))
    part = np.full(depth.shape, -1)
    for frame, data in enumerate(touching(model, qpos)):
        inside = contacts.find(data, person)
        rows = own_row[inside.other]
        deeper = np.maximum(inside.depth_m, _sunk_m(model, data, inside))
        for row, geom, deep in zip(rows, inside.part, deeper, strict=True):
            if deep > depth[row, frame]:
                depth[row, frame], part[row, frame] = deep, geom
    entries = [
        Penetration(name, depth[i], tuple(model.geom(p).name if p >= 0 else "" for p in part[i]))
        for i, name in enumerate(names)
        if depth[i].any()
    ]
    return tuple(sorted(entries, key=lambda entry: -entry.depth_m.max()))


def _sunk_m(model: mujoco.MjModel, data: mujoco.MjData, inside: contacts.Contacts) -> Array:
    """How far below the rest height of sprung tiles parts of the person are (c,); 0 for other contacts.

    A contact's own depth is that to the nearest face, which deep in a bed is the side of a tile.
    """
    body = model.geom_bodyid[inside.other]
    first = np.where(model.body_jntnum[body] == 1, model.body_jntadr[body], 0)
    sprung = (model.body_jntnum[body] == 1) & (model.jnt_type[first] == mujoco.mjtJoint.mjJNT_SLIDE)
    top = data.geom_xpos[inside.other, 2] + model.geom_size[inside.other, 2]
    along = np.abs(data.geom_xmat[inside.part, 6:9])  # (c, 3) the geom's axes, upwards
    lowest = data.geom_xpos[inside.part, 2] - np.sum(along * model.geom_aabb[inside.part, 3:], axis=1)
    return np.where(sprung, np.maximum(top - lowest, 0.0), 0.0)


def owners(model: mujoco.MjModel, scene: Scene) -> IntArray:
    """Index of the item that each geom belongs to (ngeom,); that after the last: the ground, -1: a person."""
    names = [*(item.name for item in scene.items), mjcf.GROUND_GEOM]
    by_geom = [mjcf.owner(model.geom(i).name, scene) for i in range(model.ngeom)]
    return np.array([-1 if name is None else names.index(name) for name in by_geom], np.int64)


def refuse_start(model: mujoco.MjModel, scene: Scene, qpos: Array) -> None:
    """Check that nothing goes through the person at the first frame.

    Args:
        model: of person and scene.
        scene: that it was built from.
        qpos: (nq,) of the first frame.

    Raises:
        InputError: an item does; the message names item, part and depth.
    """
    for entry in penetrations(model, scene, qpos[None]):
        if entry.name != mjcf.GROUND_GEOM and entry.depth_m[0] > START_MAX_M:
            deep = 1e3 * float(entry.depth_m[0])
            raise InputError(
                f"scene: item {entry.name!r} goes {deep:.0f} mm through the person ({entry.parts[0]}) at "
                f"the first frame, more than {1e3 * START_MAX_M:.0f} mm: move it; `simrecon scene show` "
                f"draws it"
            )
