"""The path of a camera that turns about its centre, and zooms, from homographies of its background.

A camera with the intrinsic matrix K that turns by R sees what it saw before through K' R K⁻¹, where K' is K
with another focal length if it zooms (Hartley and Zisserman, Multiple View Geometry, section 8.4). Camera
frame x right, y down, z forward.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simrecon.types import Array, Lens

STILL_PX = 0.006
"""Of the image's diagonal: a background whose corners never move farther stands still."""
ZOOM_LEAST = 0.04
"""Of the focal length: less is not told from errors."""
UNLIKE_MAX = 0.035
"""Distance of K⁻¹ H K from a rotation above which a camera is carried, as well: near things pass far ones."""
KNOWN_LEAST, AGREE_LEAST = 0.5, 0.55
"""Share of frames in which the background is followed, and of its features that agree on average."""
PIXEL_SIGMA = 0.004
"""Of an entry of K⁻¹ H K: what the focal length is weighed with."""
CALIBRATED = 60
"""Frames that the focal length is found from."""


@dataclass(frozen=True, eq=False)
class Views:
    """What the background of a video did.

    Attributes:
        homographies: (T, 3, 3) from pixels of the first frame to those of each.
        shares: (T,) of the features that agree with it; 0 where it is not known, and the one before holds on.
    """

    homographies: Array
    shares: Array


@dataclass(frozen=True, eq=False)
class Turn:
    """How a camera turned.

    Attributes:
        rotations: (T, 3, 3) from the camera's frame in the first image to that in each.
        zooms: (T,) focal length over that of the first frame; exactly 1 without a zoom.
        unlike: how far the homographies are from those of a camera that turns only, root mean square.
    """

    rotations: Array
    zooms: Array
    unlike: float


def is_still(views: Views, size_px: tuple[int, int]) -> bool:
    """Whether the background stands still in all frames that are known."""
    width, height = size_px
    corners = np.array([[0, 0, 1], [width, 0, 1], [0, height, 1], [width, height, 1]], float).T  # (3, 4)
    seen = views.homographies[views.shares > 0] @ corners  # (S, 3, 4)
    if not len(seen):
        return True
    moved = np.linalg.norm(seen[:, :2] / seen[:, 2:] - corners[:2], axis=1)  # (S, 4)
    return float(moved.max()) <= STILL_PX * float(np.hypot(width, height))


def turned(views: Views, lens: Lens) -> Turn:
    """Rotations and zooms through a lens that is known; distortion is left aside."""
    rotations, zooms = _apart(views.homographies, lens.matrix_px)
    known = views.shares > 0
    if not known.any() or np.abs(zooms[known] - 1).max() < ZOOM_LEAST:
        zooms = np.ones_like(zooms)
    unlike = _unlike(views.homographies[known], lens.matrix_px, zooms[known])
    return Turn(rotations, zooms, unlike)


def focal_offset(views: Views, lens: Lens) -> tuple[float, float]:
    """Offset of ln f from that of the lens at which the background turns most rigidly, and its deviation.

    J(f) = Σ |K⁻¹ H K - R|² / σ² + (ln f - ln f₀)² / σ₀², over frames of the whole clip, with σ₀ of the lens.
    """
    seen = np.flatnonzero(views.shares > 0)
    some = seen[np.unique(np.linspace(0, len(seen) - 1, min(len(seen), CALIBRATED)).round().astype(int))]
    homographies, sigma = views.homographies[some], lens.focal_sigma

    def cost(offset: float) -> float:
        matrix = lens.matrix_px.copy()
        matrix[[0, 1], [0, 1]] *= np.exp(offset)
        unlike = _unlike(homographies, matrix, np.ones(len(some)))
        return len(some) * (unlike / PIXEL_SIGMA) ** 2 + (offset / sigma) ** 2

    return _least(cost, sigma)


def _least(cost: Callable[[float], float], sigma: float) -> tuple[float, float]:
    """Where a cost is least within three deviations, and its own deviation there."""
    grid = np.linspace(-3 * sigma, 3 * sigma, 61)
    step = float(grid[1] - grid[0])
    costs = np.array([cost(float(offset)) for offset in grid])
    best = int(np.clip(np.argmin(costs), 1, len(grid) - 2))
    bend = float(costs[best - 1] - 2 * costs[best] + costs[best + 1]) / step**2
    slope = float(costs[best + 1] - costs[best - 1]) / (2 * step)
    shift = float(np.clip(-slope / bend, -step, step)) if bend > 0 else 0.0
    return float(grid[best]) + shift, float(np.sqrt(2 / max(bend, 2 / sigma**2)))


def _apart(homographies: Array, matrix_px: Array) -> tuple[Array, Array]:
    """Rotations (T, 3, 3) and zooms (T,) of homographies: K⁻¹ H K = λ diag(z, z, 1) R."""
    bare = np.linalg.inv(matrix_px) @ homographies @ matrix_px  # (T, 3, 3)
    lengths = np.linalg.norm(bare, axis=2)  # (T, 3) of the rows
    zooms = lengths[:, :2].mean(axis=1) / lengths[:, 2]
    return _nearest_rotation(bare / lengths[:, :, None]), zooms


def _unlike(homographies: Array, matrix_px: Array, zooms: Array) -> float:
    """Distance of K⁻¹ H K from rotations, root mean square over the frames."""
    if not len(homographies):
        return 0.0
    bare = np.linalg.inv(matrix_px) @ homographies @ matrix_px
    bare[:, :2] /= zooms[:, None, None]
    bare /= np.cbrt(np.linalg.det(bare))[:, None, None]
    off = np.linalg.norm(bare - _nearest_rotation(bare), axis=(1, 2))  # (T,)
    return float(np.sqrt(np.mean(off**2)))


def _nearest_rotation(matrices: Array) -> Array:
    """The rotations (T, 3, 3) nearest to matrices."""
    left, _, right = np.linalg.svd(matrices)
    signs = np.ones((len(matrices), 3))
    signs[:, 2] = np.linalg.det(left @ right)
    return np.asarray((left * signs[:, None]) @ right)
