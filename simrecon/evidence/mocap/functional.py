"""Knees that no marker shows, from the motion of the bones on either side (Ehrig et al. 2007).

With R, t the pose of each of two bones in a frame, the points c of the axis that both share solve

    R₁ c₁ + t₁ = R₂ c₂ + t₂

in all frames; along the axis the solution is free, and the direction that the equations leave open is its
own: the symmetrical axis of rotation ("A survey of formal methods for determining functional joint axes",
J. Biomechanics 40). The limits below are this project's own, by trial.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.mocap.size import SIDES
from simrecon.geometry import rotations, vectors
from simrecon.types import Array

MARKERS_MIN, FRAMES_MIN = 3, 10
BENT_MIN = 0.05
"""The singular values that tell how much a joint bends, per frame: below, it is too still to be found."""


def knees(clusters: Mapping[str, Array], skin: Mapping[str, Array], points: dict[str, Array]) -> list[str]:
    """Add knees that clusters of markers give, where the axis meets the line from hip to heel; their names.

    Args:
        clusters: (T, M, 3) markers of `left_thigh`, `left_shank` and those of the right side.
        skin: markers by name.
        points: joint centres by name, which are filled up.
    """
    found = []
    for side in SIDES:
        name, hip, heel = f"{side}_knee", points.get(f"{side}_hip"), skin.get(f"{side}_heel")
        thigh, shank = clusters.get(f"{side}_thigh"), clusters.get(f"{side}_shank")
        if name in points or hip is None or heel is None or thigh is None or shank is None:
            continue
        if (axis := _axis(thigh, shank)) is not None:
            place, along = axis
            points[name] = place + _median(np.sum(((hip + heel) / 2 - place) * along, -1)) * along
            found.append(name)
    return found


def _axis(first: Array, second: Array) -> tuple[Array, Array] | None:
    """A point of the axis between two bones and its direction, (T, 3) each; None if they are too still.

    Args:
        first: (T, M, 3) markers of a bone.
        second: (T, N, 3) of the other.
    """
    if min(first.shape[1], second.shape[1]) < MARKERS_MIN:
        return None
    (r1, t1), (r2, t2) = _pose(first), _pose(second)
    known = np.isfinite(t1 + t2).all(-1)
    if known.sum() < FRAMES_MIN:
        return None
    a = np.concatenate((r1[known], -r2[known]), axis=-1).reshape(-1, 6)  # (3T, 6)
    b = (t2 - t1)[known].ravel()
    u, s, vt = np.linalg.svd(a, full_matrices=False)
    if s[-2] < BENT_MIN * np.sqrt(known.sum()):
        return None
    centre = vt[:-1].T @ ((u.T @ b)[:-1] / s[:-1])  # (6,)
    place = (r1 @ centre[:3, None])[..., 0] + t1
    return place, vectors.unit((r1 @ vt[-1, :3, None])[..., 0])


def _pose(markers: Array) -> tuple[Array, Array]:
    """Rotation (T, 3, 3) and place (T, 3) of a bone against a frame in which all of its markers are seen."""
    seen = np.isfinite(markers).all(axis=(1, 2))
    if not seen.any():
        return np.full((len(markers), 3, 3), np.nan), np.full((len(markers), 3), np.nan)
    shape = markers[np.argmax(seen)] - markers[np.argmax(seen)].mean(axis=0)  # (M, 3)
    middle = markers.mean(axis=1)
    turned = rotations.align(shape, np.nan_to_num(markers - middle[:, None]))
    return turned, middle


def _median(values: Array) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
