"""What rollouts show at the frames of a window, beside what they are compared with; shared by all terms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simrecon.engines.borne import Borne
from simrecon.engines.problem import Problem
from simrecon.engines.wished import Wished
from simrecon.sim.rollout import Rollouts
from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Targets:
    """What the loss compares rollouts with at F frames.

    Attributes:
        com_m: (F, 3). points_m: (F, M, 3). orientations: (F, 17, 4).
        rays: (F, M, 2) undistorted detections x/z, y/z; scores: (F, M), zero where not seen.
        planted: (F, M) how surely each point stands.
        world_to_camera: (F, 4, 4), or None without a camera.
        wished: where points are by a user's wishes of contact, or None.
        wrenches: (F, 2, 6) planned on the feet, mean since the frame before, zero at the first; or None.
        borne: what segments are to bear that are to touch, mean since the frame before; or None.
    """

    com_m: Array
    points_m: Array
    orientations: Array
    rays: Array
    scores: Array
    planted: Array
    world_to_camera: Array | None
    wished: Wished | None = None
    wrenches: Array | None = None
    borne: Borne | None = None

    @classmethod
    def at(cls, problem: Problem, frames: IntArray) -> Targets:
        """Those of some frames (F,) of a clip."""
        camera = problem.world_to_camera
        return cls(
            com_m=problem.com_m[frames],
            points_m=problem.points_m[frames],
            orientations=problem.orientations[frames],
            rays=problem.rays[frames],
            scores=problem.scores[frames],
            planted=problem.planted[frames],
            world_to_camera=None if camera is None else camera[frames],
            wished=None if problem.wished is None else problem.wished.at(frames),
            wrenches=_means(problem.pushed, frames),
            borne=_borne(problem.borne, frames),
        )


@dataclass(frozen=True, eq=False)
class Seen:
    """P rollouts at the F frames of a window.

    Attributes:
        com_m: (P, F, 3) centre of mass. points_m: (P, F, M, 3) points of the body.
        orientations: (P, F, 17, 4) root and joint quaternions.
        targets: of the same frames.
        wrenches: (P, F, K, 6) on bodies that are felt, as in `sim.rollout.Rollouts`.
    """

    com_m: Array
    points_m: Array
    orientations: Array
    targets: Targets
    wrenches: Array

    @classmethod
    def of(cls, rolled: Rollouts, point_rows: IntArray, targets: Targets) -> Seen:
        """Rollouts whose sites `point_rows` (M,) are the points of the body; `targets` of their frames."""
        orientations = rolled.qpos[..., 3:].reshape(*rolled.qpos.shape[:2], -1, 4)
        return cls(rolled.com_m, rolled.points_m[:, :, point_rows], orientations, targets, rolled.wrenches)

    @cached_property
    def com_off_m(self) -> Array:
        """Centre of mass from its target, (P, F, 3)."""
        return self.com_m - self.targets.com_m

    @cached_property
    def points_off_m(self) -> Array:
        """Points from their targets, (P, F, M, 3)."""
        return self.points_m - self.targets.points_m


def _borne(whole: Borne | None, frames: IntArray) -> Borne | None:
    """That of frames (F,), its wrenches means since the frame before; nothing is asked at the first."""
    if whole is None:
        return None
    own, mean = whole.at(frames), _means(whole.wrenches, frames)
    sure = own.sure * (np.arange(len(frames)) > 0)[:, None]
    return replace(own, wrenches=own.wrenches if mean is None else mean, sure=sure)


def _means(values: Array | None, frames: IntArray) -> Array | None:
    """Means (F, ...) of values (T, ...) between frames (F,), by the trapezoidal rule; zero at the first."""
    if values is None:
        return None
    sums = np.zeros_like(values)
    np.cumsum((values[1:] + values[:-1]) / 2, axis=0, out=sums[1:])
    found = np.zeros((len(frames), *values.shape[1:]))
    found[1:] = np.diff(sums[frames], axis=0) / np.diff(frames).reshape(-1, *np.ones(values.ndim - 1, int))
    return found
