"""What is to be solved: a person, a scene, evidence, and the plan that weighs it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from simrecon import body as bodies
from simrecon.kinematics.contacts import ContactPoints
from simrecon.kinematics.layout import Variables, leans
from simrecon.kinematics.observations import Observations
from simrecon.plan import Kinematics
from simrecon.types import Array, IntArray, Scene, Skeleton


@dataclass(frozen=True, eq=False)
class Problem:
    """The kinematic fit of a clip of T frames, or of some of its frames.

    Attributes:
        skeleton: unscaled.
        contacts: points of its primitives.
        scene: what they may touch.
        base: (T, 3, 3) orientation from which the root's rotation is counted.
        observations: evidence.
        plan: weights and scales of the terms.
        feet: rows of the landmarks at the ends of the feet.
        drop: (M, 3) how each landmark moves as the sole goes down by a metre.
        tallness: (L,) how stature grows with the logarithms of the lengths.
        stretch: (L, SEGMENTS, 3) how offsets grow with the lengths.
        leans: (T, F) slow cosines by which the 3D estimate may lean.
    """

    skeleton: Skeleton
    contacts: ContactPoints
    scene: Scene
    base: Array
    observations: Observations
    plan: Kinematics
    feet: IntArray
    drop: Array
    tallness: Array
    stretch: Array
    leans: Array

    @classmethod
    def of_clip(
        cls,
        skeleton: Skeleton,
        contacts: ContactPoints,
        scene: Scene,
        base: Array,
        observations: Observations,
        plan: Kinematics,
        *,
        lengths: bool = True,
    ) -> Self:
        """That of a whole clip.

        Args:
            skeleton: unscaled.
            contacts: points of its primitives.
            scene: what they may touch.
            base: (T, 3, 3) orientation from which the root's rotation is counted.
            observations: evidence.
            plan: weights and scales of the terms.
            lengths: whether the skeleton's lengths are unknowns; else L is 0.
        """
        names = skeleton.point_names
        ends = [name.endswith(("_heel", "_toe")) for name in names]
        count = None if lengths else 0
        return cls(
            skeleton=skeleton,
            contacts=contacts,
            scene=scene,
            base=base,
            observations=observations,
            plan=plan,
            feet=np.flatnonzero(ends),
            drop=drops(skeleton),
            tallness=bodies.length_shares(skeleton)[:count],
            stretch=bodies.length_offsets(skeleton)[:count],
            leans=leans(len(base), observations.interval_s),
        )

    @property
    def frames(self) -> int:
        """T."""
        return len(self.base)

    @property
    def dt(self) -> float:
        """Time from a frame to the next, s."""
        return self.observations.interval_s

    def unpack(self, x: Array) -> Variables:
        """The variables of a packed vector."""
        return Variables.unpack(x, self.frames, len(self.stretch))

    def part(self, frames: slice) -> Problem:
        """That of some frames, with the priors on what all share."""
        see = self.observations.part(frames)
        return replace(self, base=self.base[frames], leans=self.leans[frames], observations=see)

    def person(self, variables: Variables) -> Skeleton:
        """The skeleton with the lengths of the variables, unscaled."""
        longer = np.tensordot(np.expm1(variables.lengths), self.stretch, axes=1)
        return replace(self.skeleton, offsets_m=self.skeleton.offsets_m + longer)


def drops(skeleton: Skeleton) -> Array:
    """How each landmark moves as the sole goes down by a metre, (M, 3)."""
    low = [name.endswith(("_heel", "_toe", "_mtp")) for name in skeleton.point_names]
    return np.outer(low, [0.0, 0.0, -1.0])
