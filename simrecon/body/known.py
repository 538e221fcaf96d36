"""A person that exists already: read back from a model, or changed in size, mass and its distribution."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from simrecon.body import mass, mjcf, primitives
from simrecon.body.skeleton import rescaled, template
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.sim.quiet import unwarned
from simrecon.types import Body, Primitive, Skeleton


def of_mjcf(text: str, height_m: float) -> Body:
    """The person of a result's `model.xml`, to the six digits that MJCF keeps; its betas are not known.

    Args:
        text: MJCF of a person, perhaps in a scene.
        height_m: stature.

    Raises:
        InputError: it is not the model of such a person.
    """
    unit = template()
    try:
        with unwarned(), warnings.catch_warnings(action="error"):
            spec = mujoco.MjSpec.from_string(text)
            model = spec.compile()
        bodies = np.array([model.body(name).id for name in unit.names])
        sites = np.array([model.site(name).id for name in unit.point_names])
        parts = tuple(_primitive(model, spec, entry) for entry in primitives.entries())
    except KeyError as error:  # MuJoCo lists all valid names behind the one that is not there
        missing = str(error.args[0]).partition(". Valid names")[0]
        raise InputError(
            f"model of the person: {missing}; valid: the model of a result of this version"
        ) from error
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError, UserWarning) as error:
        why = " ".join(f"{error}".split())
        raise InputError(f"model of the person: {why}; valid: the model of a result") from error
    turns = model.body_quat[bodies]
    if not np.isfinite(turns).all() or not turns.any(axis=1).all():
        raise InputError(
            "model of the person: found a body without an orientation; valid: the model of a result"
        )
    skeleton = replace(
        unit,
        offsets_m=np.where(unit.parents[:, None] < 0, 0.0, model.body_pos[bodies]),
        rest=rotations.canonical(turns),
        point_offsets_m=model.site_pos[sites].copy(),
    )
    total = float(model.body_subtreemass[bodies[0]])
    return Body(np.zeros(0), height_m, total, skeleton, parts, mjcf.make(skeleton, parts, total))


def changed(
    body: Body,
    *,
    height_m: float | None = None,
    mass_kg: float | None = None,
    distribution: str | None = None,
) -> Body:
    """The same person taller or smaller as a whole, heavier or lighter, or with another distribution of mass.

    Args:
        body: whose proportions are kept.
        height_m: stature; that of the body if None.
        mass_kg: of the whole person; if None, as the volume changes.
        distribution: of mass, by name, on top of de Leva's shares; None: shares as they are.

    Raises:
        InputError: there is no such distribution.
    """
    scale = 1.0 if height_m is None else height_m / body.height_m
    total = body.mass_kg * scale**3 if mass_kg is None else mass_kg
    skeleton, parts = rescaled(body.skeleton, scale), body.primitives
    shares = {part.name: part.mass_kg / body.mass_kg for part in parts}
    if distribution is not None:
        usual = primitives.make(skeleton, body.height_m * scale, total, 0.0, distribution)
        shares = {part.name: part.mass_kg / total for part in usual}
    masses = mass.printable({name: total * share for name, share in shares.items()}, total)
    parts = tuple(
        replace(part, points_m=scale * part.points_m, size_m=scale * part.size_m, mass_kg=masses[part.name])
        for part in parts
    )
    text = mjcf.make(skeleton, parts, total)
    return Body(body.betas, body.height_m * scale, total, skeleton, parts, text, body.shape_space)


def leg_m(skeleton: Skeleton) -> float:
    """From the hip to under the heel, leg and foot stretched: what a person's steps scale with."""
    bones = [skeleton.names.index(f"left_{name}") for name in ("knee", "ankle")]
    heel = skeleton.point_names.index("left_heel")
    length = np.linalg.norm(skeleton.offsets_m[bones], axis=1).sum()
    return float(length - skeleton.point_offsets_m[heel, 2])


def _primitive(model: mujoco.MjModel, spec: mujoco.MjSpec, entry: dict[str, Any]) -> Primitive:
    """A primitive as the compiled model has it; its mass from the text, as models keep those of segments."""
    name, geom = entry["name"], model.geom(entry["name"])
    mass_kg = float(spec.geom(name).mass)
    if entry["kind"] == "box":
        return Primitive(name, entry["segment"], "box", geom.pos[None].copy(), geom.size.copy(), mass_kg)
    # MuJoCo's capsules point from their second end to the first
    along = rotations.rotate(geom.quat, [0.0, 0.0, geom.size[1]])
    ends = np.stack((geom.pos + along, geom.pos - along))
    return Primitive(name, entry["segment"], "capsule", ends, geom.size[:1].copy(), mass_kg)
