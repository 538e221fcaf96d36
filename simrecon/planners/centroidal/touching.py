"""When a point touches what: its phases, and the planes that stand for the scene around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import scene as scenes
from simrecon.planners.centroidal.phases import Phase, phases
from simrecon.planners.centroidal.points import Point
from simrecon.types import Array, Flags, Scene

OVER_M, IN_M = 0.005, 0.01
"""How far over and beside an edge the face is looked for."""


@dataclass(frozen=True, eq=False)
class Plane:
    """A surface where a point may touch it: n · x = d.

    Attributes:
        normal: (3,) unit, away from what is solid.
        height_m: d of the point itself, which is its radius off the surface.
        friction: coefficient.
    """

    normal: Array
    height_m: float
    friction: float

    @property
    def tangents(self) -> Array:
        """Two unit vectors (2, 3) in the plane."""
        first = np.cross(self.normal, np.eye(3)[int(np.argmin(np.abs(self.normal)))])
        first /= np.linalg.norm(first)
        return np.stack((first, np.cross(self.normal, first)))


@dataclass(frozen=True, eq=False)
class Touching:
    """Phases of a point and the planes around it.

    Attributes:
        phases: contact and flight, in turn.
        planes: of each phase: what it rests on in contact, the nearest on the whole in flight.
        normals: (T, 3) of what is nearest in each frame; heights_m: (T,) d of it.
    """

    phases: tuple[Phase, ...]
    planes: tuple[Plane, ...]
    normals: Array
    heights_m: Array


def around(scene: Scene, point: Point, place_m: Array) -> tuple[Array, Array]:
    """Distances (S, T) of a point at places (T, 3) from all supports, and their gradients (S, T, 3)."""
    apart, normals = scenes.distances(scene, place_m)
    return apart - point.radius_m, normals


def touching(
    scene: Scene,
    point: Point,
    near: tuple[Array, Array],
    place_m: Array,
    contact: Flags,
    times_s: Array,
    shortest_s: float,
) -> Touching:
    """Phases and planes of a point.

    Args:
        scene: what it may touch.
        point: the point.
        near: distances and gradients, from `around`.
        place_m: (T, 3) of it.
        contact: (T,) when it is in contact.
        times_s: (T,) since the first frame.
        shortest_s: of a phase.
    """
    apart, normals = near
    found = phases(contact, times_s, shortest_s)
    planes = tuple(_plane(scene, point, apart, place_m, _rows(phase, times_s)) for phase in found)
    nearest, frames = np.argmin(apart, axis=0), np.arange(len(times_s))
    normal = normals[nearest, frames]
    heights = np.sum(normal * place_m, axis=1) - apart[nearest, frames]
    return Touching(found, planes, normal, heights)


def _rows(phase: Phase, times_s: Array) -> Flags:
    """Frames of a phase; one at least."""
    inside = phase.frames(times_s)
    if not inside.any():
        inside[np.argmin(np.abs(times_s - (phase.start_s + phase.end_s) / 2))] = True
    return inside


def _plane(scene: Scene, point: Point, apart: Array, place_m: Array, rows: Flags) -> Plane:
    """That of the support which is nearest over some frames; of an item under a foot its top."""
    support = int(np.argmin(np.abs(apart[:, rows]).mean(axis=1)))
    places = place_m[rows]
    away, normals = (values[support] for values in scenes.distances(scene, places))
    if support > 0 and point.sole:
        inside = _beside_edges(places - away[:, None] * normals, normals)
        over, faces = (values[support] for values in scenes.distances(scene, inside))
        places, away = np.concatenate((places, inside)), np.concatenate((away, over))
        normals = np.concatenate((normals, faces))
        best = np.flatnonzero(normals[:, 2] > normals[:, 2].max() - 1e-6)
        places, away, normals = places[best], away[best], normals[best]
    normal = normals.mean(axis=0)
    normal = normal / np.linalg.norm(normal)
    height = float(np.mean(np.sum(normals * places, axis=1) - away)) + point.radius_m
    surface = scene.ground if support == 0 else scene.items[support - 1]
    return Plane(normal, height, surface.friction.sliding)


def _beside_edges(surface_m: Array, normals: Array) -> Array:
    """Points over the face that ends at an edge, for points (F, 3) of a surface that may be on one.

    A sole may hang over the edge of a beam: nearest to its middle is the edge, whose normal is no face's.
    """
    return np.asarray(surface_m + np.array([0.0, 0.0, OVER_M]) - IN_M * normals * [1.0, 1.0, 0.0])
