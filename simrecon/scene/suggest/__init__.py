"""Supports that a motion needs where the scene has none: a seat, a bed, a beam, a step."""

from __future__ import annotations

from dataclasses import replace

from simrecon.scene.suggest.motion import measure
from simrecon.scene.suggest.seats import under_pelvis
from simrecon.scene.suggest.stands import FOOT_LEAST_M, stance_heights, under_feet
from simrecon.scene.suggest.suggestion import Suggestion
from simrecon.types import Array, Body, Scene

__all__ = ["Suggestion", "stance_heights", "suggest"]


def suggest(
    person: Body,
    scene: Scene,
    times_s: Array,
    qpos: Array,
    *,
    least_m: float = FOOT_LEAST_M,
    seats: bool = True,
) -> tuple[Suggestion, ...]:
    """Supports under a pelvis at rest, and under feet that stand over the floor.

    Args:
        person: whose motion it is.
        scene: floor and items that are known already; nothing is suggested where they bear the person.
        times_s: (T,) uniform.
        qpos: (T, 7 + 4 * 16) kinematic motion, fitted without the items that are missing.
        least_m: height over what is under a foot, from which it needs a support.
        seats: whether to look under the pelvis too.
    """
    motion = measure(person, times_s, qpos)
    suggestions = under_feet(motion, scene, least_m)
    if seats:
        suggestions = [*under_pelvis(motion, scene, person.height_m), *suggestions]
    taken = {item.name for item in scene.items}
    named = []
    for suggestion in suggestions:
        name, count = suggestion.item.name, 2
        while name in taken:
            name, count = f"{suggestion.item.name}_{count}", count + 1
        taken.add(name)
        named.append(replace(suggestion, item=replace(suggestion.item, name=name)))
    return tuple(named)
