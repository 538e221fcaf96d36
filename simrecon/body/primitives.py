"""The 26 primitives of a person and their masses."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.body import mass, names
from simrecon.body import skeleton as skeletons
from simrecon.types import Body, Primitive, Skeleton

FEET = ("left_foot", "right_foot")
"""Primitives that are feet."""
THINNEST_M = 0.01
"""Of a foot, whose sole a fit that is cut short may leave higher than the ankle."""


@cache
def entries() -> tuple[dict[str, Any], ...]:
    """The primitives of `models/body/primitives.toml`, left, right and centre."""
    data = resources.toml("models", "body", "primitives.toml")
    return tuple(side for entry in data["primitive"] for side in names.mirrored(entry))


def default_mass_kg(height_m: float) -> float:
    """Mass from stature, where it is not known: body mass index times stature² (`models/body/mass.toml`)."""
    return float(resources.toml("models", "body", "mass.toml")["whole"]["bmi_kgpm2"]) * height_m**2


def default_height_m() -> float:
    """Stature where nothing is known of the person."""
    return float(resources.toml("models", "body", "mass.toml")["whole"]["stature_m"])


def upright_m(body: Body) -> float:
    """Height of the primitives of a body in a T-pose, from the left sole to the top of the skull, m.

    It is the stature of what is simulated. The skeleton's (`skeleton.stature_m`) differs where the points of
    the head are of another size than the skull, which grows with stature.
    """
    origins = dict(zip(body.skeleton.names, skeletons.t_pose_m(body.skeleton), strict=True))
    parts = {part.name: part for part in body.primitives}
    skull, foot = parts["skull"], parts["left_foot"]
    top = origins[skull.segment][2] + skull.points_m[:, 2].max() + skull.size_m[0]
    sole = origins[foot.segment][2] + foot.points_m[0, 2] - foot.size_m[2]
    return float(top - sole)


def make(
    skeleton: Skeleton, height_m: float, mass_kg: float, sole_m: float, distribution: str = "standard"
) -> tuple[Primitive, ...]:
    """Primitives along the bones of a skeleton.

    Args:
        skeleton: with measured lengths.
        height_m: stature that proportions refer to.
        mass_kg: of the whole person, shared out by de Leva 1996.
        sole_m: how far the sole lies below the heel and toe points.
        distribution: of mass, by name (`mass.distribution`).

    Raises:
        InputError: there is no such distribution.
    """
    percent = resources.toml("models", "body", "mass.toml")
    bmi = mass_kg / height_m**2
    width = height_m * np.sqrt(bmi / percent["whole"]["bmi_kgpm2"])
    masses = _masses(mass_kg, distribution)
    parts = []
    for entry in entries():
        if entry["kind"] == "capsule":
            thick = height_m if entry.get("bone") else width
            points, size = _capsule(entry, skeleton, height_m), np.array([entry["radius"] * thick])
        elif "sole" in entry:
            points, size = _sole(entry, skeleton, height_m, width, sole_m)
        else:
            points, size = np.array([entry["centre"]]) * height_m, np.array(entry["half"]) * height_m
        parts.append(
            Primitive(entry["name"], entry["segment"], entry["kind"], points, size, masses[entry["name"]])
        )
    return tuple(parts)


def _masses(mass_kg: float, distribution: str) -> dict[str, float]:
    percent = mass.data()["percent"]
    shares = np.array([percent[entry["part"]] * entry["share"] for entry in entries()])
    shares = mass.spread(shares, [entry["segment"] for entry in entries()], mass.distribution(distribution))
    names = [entry["name"] for entry in entries()]
    return mass.printable(dict(zip(names, (mass_kg * shares).tolist(), strict=True)), mass_kg)


def _capsule(
    entry: dict[str, Any], skeleton: Skeleton, height_m: float
) -> np.ndarray[Any, np.dtype[np.float64]]:
    if "along" in entry:
        bone = skeleton.offsets_m[skeleton.names.index(entry["to_joint"])]
        return np.outer(entry["along"], bone)  # (2, 3)
    return np.array([entry["from"], entry["to"]]) * height_m  # (2, 3)


def _sole(
    entry: dict[str, Any], skeleton: Skeleton, height_m: float, width: float, sole_m: float
) -> tuple[np.ndarray[Any, np.dtype[np.float64]], np.ndarray[Any, np.dtype[np.float64]]]:
    side = entry["name"].split("_")[0]
    heel, toe = (
        skeleton.point_offsets_m[skeleton.point_names.index(f"{side}_{end}")] for end in ("heel", "toe")
    )
    measured = toe[0] - heel[0]
    # Some estimates give the tip of the toe, others its joint, and a foot is at most a third longer than
    # from heel to that joint.
    length = float(np.clip(entry["length"] * height_m, measured, 1.35 * measured))
    bottom = 0.5 * (heel[2] + toe[2]) - sole_m
    thickness = max(min(entry["thickness"] * height_m, -0.9 * bottom), THINNEST_M)
    centre = np.array([[heel[0] + 0.5 * length, 0.5 * (heel[1] + toe[1]), bottom + 0.5 * thickness]])
    return centre, np.array([0.5 * length, entry["half_breadth"] * width, 0.5 * thickness])
