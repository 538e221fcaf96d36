"""Whose pose a file of SMPL's family holds: a body of its tree in the rest pose, with its shape parameters.

That is the average body, or, if the person's shape is of a body model that the user brought and the file is
of that model's family, the user's: then joints come from the model, at the betas that the file holds. Those
are the person's own, or, where the person is larger or smaller than their betas say, the nearest ones whose
joints are where the person's are.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from simrecon import body as bodies
from simrecon.body import model_file, shape
from simrecon.body.shape import ShapeSpace
from simrecon.errors import InputError
from simrecon.evidence.smpl import motion as tree
from simrecon.exports.axes import LOCAL
from simrecon.exports.view import ResultView
from simrecon.io import provenance
from simrecon.job import request
from simrecon.types import Array, Body, Skeleton

BETAS, SHARED = 16, 22
"""Shape parameters in a file; joints that all models of the family have in the same order."""
FAMILIES = {24: "smpl", 52: "smpl", 55: "smplx"}
"""Layout of the joints by their number: SMPL, SMPL-H, SMPL-X."""
SIGMA_M = 0.004
"""Standard deviation of the person's joints in their parents, against betas' of 1."""
GENDERS = {"female": ("female", "_f_"), "male": ("male", "_m_")}
"""What names of the family's files say."""


@dataclass(frozen=True, eq=False)
class SmplBody:
    """A body in its rest pose; S segments of ours.

    Attributes:
        offsets_m: (24, 3) joint centres in their parents, the pelvis' in the body; x left, y up, z forward.
        axes: (S, 3, 3) of our segments in the rest pose, x forward, y left, z up.
        betas: (16,) shape parameters, zero for the average body.
        gender: of the model.
    """

    offsets_m: Array
    axes: Array
    betas: Array
    gender: str = "neutral"


def average(model: str, scale: float = 1.0) -> SmplBody:
    """The average body of `smpl` or `smplx`, times a scale, with the axes of a T-pose."""
    count = len(bodies.template().names)
    axes = np.broadcast_to(np.eye(3), (count, 3, 3))
    return SmplBody(scale * tree.offsets_m(model), axes, np.zeros(BETAS))


def own(view: ResultView, model: str) -> SmplBody | None:
    """The person's body in the user's body model; None if there is none, or of another family.

    Raises:
        InputError: the file of the model isn't there, is another one, or is given for a person without one.
    """
    person = view.result.body
    if person.shape_space in ("", "simrecon"):
        if view.choices.body_model is not None:
            raise InputError(
                f"--body-model: found {view.choices.body_model} for a person whose shape is simrecon's own; "
                "valid: leave it out"
            )
        return None
    space = model_file.read(_path(view))
    return of_space(person, space, model)


def of_space(person: Body, space: ShapeSpace, model: str) -> SmplBody | None:
    """The person's body in the space of a body model; None if that is not of the family `model`."""
    joints = space.joints
    if joints is None or not _is_of(model, joints.names, joints.axes):
        return None
    given = np.zeros(space.size)
    given[: len(person.betas)] = person.betas[: space.size]
    betas = nearest(person.skeleton, space, given)
    places = joints.places_m(betas)
    offsets = tree.offsets_m(model).copy()
    offsets[0] = places[0]
    parents = tree.parents()[1:SHARED]
    offsets[1:SHARED] = places[1:SHARED] - places[list(parents)]
    written = np.zeros(BETAS)
    written[: len(betas)] = betas
    return SmplBody(offsets, space.frames(betas)[1], written, _gender(space.name))


def nearest(person: Skeleton, space: ShapeSpace, given: Array) -> Array:
    """The betas that have the person's joints, near the given ones.

    Minimises Σ_s ‖o_s(β) − o_s‖² / σ² + ‖β − β₀‖², o_s the offset of a joint in its parent segment. The few
    lengths of a person are not enough: betas that have just them lie four times as far from β₀, for a person
    8 % larger, and joints are twice as far off.

    Args:
        person: skeleton of the person.
        space: of the body model.
        given: β₀ (B,).

    Returns:
        (B,) betas.
    """

    def residuals(betas: Array) -> Array:
        off = shape.skeleton(betas, space).offsets_m - person.offsets_m  # (S, 3)
        return np.concatenate((off.ravel() / SIGMA_M, betas - given))

    limit = 0.999 * shape.BETA_MAX
    start = np.clip(given, -limit, limit)
    solved = scipy.optimize.least_squares(residuals, start, bounds=(-limit, limit), max_nfev=30)
    return np.asarray(solved.x)


def _is_of(model: str, names: tuple[str, ...], axes: Array) -> bool:
    """Whether joints and axes of a file are those of the family."""
    same = names[:SHARED] == tree.names("smpl")[:SHARED]
    return FAMILIES.get(len(names)) == model and same and np.array_equal(axes, LOCAL.T)


def _gender(name: str) -> str:
    plain = name.lower()
    return next((gender for gender, words in GENDERS.items() if any(w in plain for w in words)), "neutral")


def _path(view: ResultView) -> Path:
    """Where the body model of the person is."""
    name, given = view.result.body.shape_space, view.choices.body_model
    job = view.result.job
    path, digest = given or job.person.body_model, request.known_digest(job, "body_model")
    valid = "valid: --body-model with the file that the result was made with"
    if path is None or not Path(path).is_file():
        raise InputError(f"{path or name}: found no such body model; {valid}")
    if Path(path).name != name or digest not in (None, provenance.file_digest(Path(path))):
        raise InputError(f"{path}: found another body model than the person's {name}; {valid}")
    return Path(path)
