"""BVH: where the joints of a hierarchy are in every frame, and which of them are a person's.

The text is read in `hierarchy`; joints are found by their place in the tree (`tree`), where that fails by
their names (`names`), and last of all as the user says.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.mocap import hierarchy, names, tree
from simrecon.evidence.mocap.hierarchy import BoolArray, Joint
from simrecon.evidence.mocap.points import NEEDED, points_evidence, stance
from simrecon.evidence.options import Options
from simrecon.geometry import vectors
from simrecon.io.messages import counted, hint
from simrecon.types import Array, Evidence

SHOWN = 60  # names of joints in a message
FEW = 5  # frames, among which none is apart
APART, APART_SIZE = 4.0, 0.2

INTERVAL_S = (1e-4, 1.0)
"""Between frames; what is beyond is milliseconds, a frame rate, or nothing."""


def matches(content: Content) -> bool:
    """Whether the file is BVH."""
    return content.kind == "text" and content.text[:64].lstrip().startswith("HIERARCHY")


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the skeleton's joints."""
    joints, interval_s, values = hierarchy.parse(content)
    on_top = hierarchy.added(joints, values)
    places = hierarchy.positions(joints, values, on_top)
    at, notes = points_of(content, joints, places, options.joints)
    if on_top is not None:
        notes.insert(0, _placed(joints, on_top))
    apart = int(_begins_apart(places[:, list(at.values())]))
    if apart:
        notes.append("the first frame is left out: a pose apart from the motion")
    rest = hierarchy.rest(joints)
    at_rest = {name: rest[index] for name, index in at.items()}
    if options.fps is None and not INTERVAL_S[0] < interval_s < INTERVAL_S[1]:
        low, high = INTERVAL_S
        raise content.fail("Frame Time", f"{interval_s:g} s", f"{low:g} to {high:g} s, or --fps")
    rate = interval_s if options.fps is None else 1 / options.fps
    return points_evidence(
        content,
        options,
        {name: places[apart:, index] for name, index in at.items()},
        np.arange(apart, len(places), dtype=np.float64) * rate,
        notes="; ".join(notes),
        rest=at_rest,
        stated=_stated(joints, at, places, at_rest),
    )


def points_of(
    content: Content, joints: list[Joint], places: Array, told: tuple[str, ...] = ()
) -> tuple[dict[str, int], list[str]]:
    """Index of the joint that each point of the body is, and what there is to say of it.

    Args:
        content: the file, for messages.
        joints: of the hierarchy.
        places: (T, K, 3) of them.
        told: by the user, `ours=theirs`.

    Raises:
        InputError: too few are found, or the user names a joint that isn't there.
    """
    given = [joint.name for joint in joints]
    at, notes = tree.find(joints, places)
    if not at:
        notes.append("joints by their names alone")
    at = names.joints(given) | at
    at |= _told(content, given, told)
    if told:
        notes.append(f"as given: {', '.join(told)}")
    if missing := [name for name in NEEDED if name not in at]:
        there = ", ".join(name for name in given[:SHOWN] if name)
        raise content.fail(
            "joints",
            f"none that is {', '.join(missing)} (there are {there})",
            f"a human skeleton, or --joints {missing[0]}=NAME,…",
        )
    order = [name for name in names.joint_points() if name in at]
    return {name: at[name] for name in (*order, *(name for name in at if name not in order))}, notes


def _told(content: Content, given: list[str], told: tuple[str, ...]) -> dict[str, int]:
    """Joints that the user names."""
    at = {}
    for entry in told:
        ours, _, theirs = (part.strip() for part in entry.partition("="))
        valid = names.joint_points()
        if ours not in valid:
            raise content.fail(
                "--joints", f"{ours!r}{hint(ours, valid)}", f"NAME=JOINT of {', '.join(valid)}"
            )
        same = [i for i, name in enumerate(given) if name == theirs]
        same = same or [i for i, name in enumerate(given) if name and names.flat(name) == names.flat(theirs)]
        if len(same) != 1:
            there = f"{theirs!r}{hint(theirs, tuple(name for name in given if name))}"
            found = f"{there}, the name of {counted(len(same), 'joint')}" if same else there
            raise content.fail(
                "--joints", found, f"one of {', '.join(name for name in given[:SHOWN] if name)}"
            )
        at[ours] = same[0]
    return at


def _placed(joints: list[Joint], on_top: BoolArray) -> str:
    """How the position channels below the root were understood."""
    count = sum(
        joint.parent >= 0 and any(name.endswith("position") for name in joint.channels) for joint in joints
    )
    added = int(on_top.sum())
    channels = f"position channels of {counted(count, 'joint')}"
    if not added:
        return f"{channels} stand for OFFSET"
    if added == count:
        return f"{channels} are added to OFFSET"
    return f"{channels}: {added} are added to OFFSET, the others stand for it"


def _begins_apart(places: Array) -> bool:
    """Whether the first frame of joints (T, K, 3) is a reference pose, which some programs put first.

    Then some joint goes farther after it than any ever does again, by far, and by a good part of the body.
    """
    if len(places) < FEW:
        return False
    steps = np.linalg.norm(np.diff(places, axis=0), axis=-1).max(axis=-1)  # (T - 1,)
    size = float(np.median(np.ptp(places, axis=1).max(axis=-1)))
    return bool(steps[0] > APART_SIZE * size and steps[0] > APART * steps[1:].max())


def _stated(
    joints: list[Joint], at: Mapping[str, int], places: Array, rest: Mapping[str, Array]
) -> dict[str, float]:
    """What no pair of joints shows: the skull, and how far the ball of the foot is below the ankle at rest.

    Args:
        joints: of the hierarchy.
        at: which of them are ours, by name.
        places: (T, K, 3) of all of them, file units.
        rest: (3,) of ours in the rest pose, file units.
    """
    lengths: dict[str, float] = {}
    top = _top(joints, at.get("skull_base"))
    if top is not None:
        skull = np.linalg.norm(places[:, top] - places[:, at["skull_base"]], axis=-1)
        lengths["skull"] = float(np.median(skull))
    up = stance(rest)
    if up is not None and {"left_mtp", "right_mtp"} <= set(rest):
        down = [rest[f"{side}_ankle"] - rest[f"{side}_mtp"] for side in ("left", "right")]
        lengths["mtp_rest_drop"] = float(np.mean(down, axis=0) @ vectors.unit(up))
    return {name: length for name, length in lengths.items() if length > 0}


def _top(joints: list[Joint], head: int | None) -> int | None:
    """The end of a head from which nothing branches off."""
    if head is None:
        return None
    top = head
    for i, joint in enumerate(joints[head + 1 :], head + 1):  # depth first
        if joint.parent != top:
            return top if joint.parent < head and top != head else None
        top = i
    return top if top != head else None
