"""Parts of the body, labels by part, and the source `rules`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import contact
from simrecon.body import names, primitives
from simrecon.contact import Cues, labels, parts
from simrecon.errors import InputError
from simrecon.kinematics.contacts import contact_points
from simrecon.types import Array

FRAMES, STEP_S = 40, 1 / 30
POINTS = tuple(point["name"] for point in names.points())


def cues(moves: Callable[[str, Array], Array]) -> Cues:
    """A 3D estimate in which each point moves as a function of its name and the time says."""
    times = np.arange(FRAMES, dtype=np.float64) * STEP_S
    joints = np.stack([moves(name, times) for name in POINTS])  # (M, T, 3)
    count = len(POINTS)
    return Cues(
        STEP_S,
        None,
        np.zeros((count, FRAMES, 2)),
        np.zeros((count, FRAMES)),
        joints,
        np.ones((count, FRAMES)),
        True,
    )


def test_the_parts_of_the_right_side_are_those_of_the_left() -> None:
    known = {part.name: part for part in parts.parts()}
    assert len(known) == 11
    for name, part in known.items():
        if name.startswith("left_"):
            other = known[name.replace("left_", "right_", 1)]
            assert dict(other.at) == {p.replace("left_", "right_", 1): w for p, w in part.at.items()}
    for part in known.values():
        names.resolve(part.points)  # all of them are points of the body
    held = [point for part in known.values() for point in part.held]
    names.resolve(held)
    assert len(held) == len(set(held))


def test_contact_points_of_the_parts_lie_where_their_names_say() -> None:
    skeleton = bodies.scaled({}, 1.7)
    made = primitives.make(skeleton, 1.7, 65.0, 0.0)
    touch = contact_points(skeleton, made)
    rows = dict(zip(parts.names(), touch.parts, strict=True))
    for side, soles in zip(parts.SIDES, touch.soles, strict=True):
        heel, toe = rows[f"{side}_heel"], rows[f"{side}_toe"]
        assert (np.concatenate((heel, toe)) == soles).all()
        assert touch.offsets_m[heel, 0].max() < touch.offsets_m[toe, 0].min()
        knee = rows[f"{side}_knee"]
        rest = bodies.t_pose_m(skeleton)
        places = rest[touch.segments[knee]] + touch.offsets_m[knee]
        joint = rest[skeleton.names.index(f"{side}_knee")]
        assert np.linalg.norm(places - joint, axis=1).max() < 0.1
        assert len(rows[f"{side}_hand"]) == 8


def test_what_is_still_rests_by_the_rules() -> None:
    def moves(name: str, times: Array) -> Array:
        speed = 2.0 if name.startswith("right") else 0.0
        return np.outer(speed * times, [1.0, 0.0, 0.0])

    found = contact.label(cues(moves))
    assert found.source == "rules"
    assert found.probability.shape == (FRAMES, len(parts.names()))
    assert found.of("left_heel").min() > 0.99
    assert found.of("right_toe")[2:-2].max() < 1e-6
    assert found.of("left_buttock")[2:-2].max() < 1e-6  # one of the hips moves
    np.testing.assert_array_equal(labels.standing(found)[0], found.of("left_toe"))
    assert not found.known("left_hand")
    assert not found.known("back")


def test_nothing_rests_of_what_is_never_seen() -> None:
    bare = cues(lambda _, times: np.zeros((len(times), 3)))
    unseen = Cues(STEP_S, None, bare.rays, bare.scores, bare.joints_m, 0 * bare.known, True)
    assert np.nanmax(contact.label(unseen).probability) == 0.0


def test_either_end_of_a_foot_makes_it_stand() -> None:
    made = labels.of_feet_and_hips(np.full((2, 3), 0.2), np.zeros(3), "test")
    made.probability[:, made.parts.index("right_toe")] = [0.1, 0.2, 0.9]
    np.testing.assert_allclose(labels.standing(made), [[0.2, 0.2, 0.2], [0.2, 0.2, 0.9]])
    assert made.at(slice(0, 2)).probability.shape[0] == 2


def test_a_source_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match="no source of contacts 'guess'; valid: rules"):
        contact.label(cues(lambda _, times: np.zeros((len(times), 3))), "guess")
