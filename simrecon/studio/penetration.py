"""What the motion goes through in the scene as it is edited: which item, how deep, when."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon import scene as scenes
from simrecon.scene import check
from simrecon.sim.address import with_items_at_rest
from simrecon.sim.models import compile_text
from simrecon.types import Array, Body, Interval, Scene

LEAST_M = 0.01
"""Rounded parts of a body that rests are some millimetres deep; this much is said."""
_STEP_S = 0.01


@dataclass(frozen=True)
class Inside:
    """How a motion goes through one item or the floor.

    Attributes:
        name: of the item, or `ground`.
        depth_m: of the deepest contact; at_s: when; part: of the body there.
        spans_s: when it is deeper than `LEAST_M`.
        frames: so many.
    """

    name: str
    depth_m: float
    at_s: float
    part: str
    spans_s: tuple[Interval, ...]
    frames: int

    @property
    def words(self) -> str:
        """For people."""
        when = ", ".join(f"{low:.2f}-{high:.2f}" for low, high in self.spans_s[:3])
        more = ", …" if len(self.spans_s) > 3 else ""
        deep = f"{100 * self.depth_m:.0f} cm deep at {self.at_s:.2f} s ({self.part.replace('_', ' ')})"
        return f"{self.name}: {deep}, {self.frames} frames: {when}{more} s"


def find(body: Body, scene: Scene, times_s: Array, qpos: Array) -> tuple[Inside, ...]:
    """What a motion goes through by more than `LEAST_M`, deepest first.

    Args:
        body: whose motion it is.
        scene: floor and items; movable ones and sprung sheets are at rest.
        times_s: (T,).
        qpos: (T, 7 + 4 * 16).

    Raises:
        InputError: the scene can't be built, such as for a mesh.
    """
    hard = scenes.hard_floor(scene)
    model = compile_text(scenes.build(body.mjcf, hard, _STEP_S))
    entries = check.penetrations(model, hard, with_items_at_rest(model, qpos))
    return tuple(_inside(entry, times_s) for entry in entries if entry.depth_m.max() > LEAST_M)


def _inside(entry: check.Penetration, times_s: Array) -> Inside:
    deepest = entry.deepest
    spans = tuple((float(times_s[a]), float(times_s[b])) for a, b in entry.spans(LEAST_M))
    frames = int((entry.depth_m > LEAST_M).sum())
    depth = float(entry.depth_m[deepest])
    return Inside(entry.name, depth, float(times_s[deepest]), entry.parts[deepest], spans, frames)
