"""A person in the view: a mesh that segments move, as viser draws it."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.studio import clip as clips
from simrecon.studio import shapes
from simrecon.studio.clip import Clip
from simrecon.types import Array, Body

FORCE_MPN = 0.5 / 700
"""Length of an arrow: half a metre for some body weight."""
LEAST_N = 20.0


class Figure:
    """One person in the view, in any frame of a motion.

    Attributes:
        clip: whose motion is shown.
    """

    def __init__(
        self,
        view: Any,
        name: str,
        clip: Clip,
        qpos: Array,
        *,
        skin: bool,
        colour: tuple[int, int, int],
        opacity: float | None = None,
    ) -> None:
        """Add it.

        Args:
            view: viser's scene.
            name: of the node.
            clip: of the person.
            qpos: (T, 7 + 4 * 16) what is shown.
            skin: or else primitives.
            colour: red, green, blue.
            opacity: None: opaque.
        """
        self.clip = clip
        self._poses = clips.poses(clip.body, qpos)
        rigged = _rigged(clip.body, skin)
        self._mesh = view.add_mesh_skinned(
            name,
            rigged.mesh.vertices_m,
            rigged.mesh.faces,
            bone_wxyzs=rigged.turns,
            bone_positions=rigged.places_m,
            skin_weights=rigged.weights,
            color=colour,
            opacity=opacity,
            flat_shading=False,
            cast_shadow=opacity is None,
            receive_shadow=False,
        )

    def show(self, frame: int) -> None:
        """Show a frame."""
        places, turns = self._poses.places_m[frame], self._poses.turns[frame]
        for bone, place, turn in zip(self._mesh.bones, places, turns, strict=True):
            bone.position, bone.wxyz = place, turn

    def see(self, visible: bool) -> None:
        """Show it at all, or not."""
        self._mesh.visible = visible

    def remove(self) -> None:
        """Take it away."""
        self._mesh.remove()


class Forces:
    """Arrows of the forces from the scene on a person."""

    def __init__(self, view: Any, name: str, clip: Clip, colour: tuple[int, int, int]) -> None:
        self._clip = clip
        self._arrows = view.add_arrows(
            name, _NONE, colour, shaft_radius=0.014, head_radius=0.035, head_length=0.07
        )

    def show(self, frame: int) -> None:
        """Show those of a frame."""
        self._arrows.points = arrows(self._clip, frame)

    def see(self, visible: bool) -> None:
        """Show them at all, or not."""
        self._arrows.visible = visible

    def remove(self) -> None:
        """Take them away."""
        self._arrows.remove()


_NONE = np.array([[[0.0, 0.0, -50.0], [0.0, 0.0, -49.9]]])
"""An arrow that nobody sees: one without length can't be drawn."""


def arrows(clip: Clip, frame: int) -> Array:
    """From and to of the forces in a frame (N, 2, 3); one far under the floor where there is none."""
    motion = clip.motion
    if motion is None or not motion.loaded[frame]:
        return _NONE
    force, point = motion.contact_force_N[frame], motion.contact_point_m[frame]
    loaded = np.linalg.norm(force, axis=-1) > LEAST_N
    if not (loaded & np.isfinite(point).all(axis=-1)).any():
        return _NONE
    start = point[loaded]
    return np.stack((start, start + FORCE_MPN * force[loaded]), axis=1)


def _rigged(body: Body, skin: bool) -> shapes.Rigged:
    return shapes.skin(body) if skin else shapes.primitives(body)
