"""The labelled points of one person: whose they are, and whether they are joints or markers on the skin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import functional, labels, size, subjects
from simrecon.evidence.options import Options
from simrecon.types import Array

NEEDED = tuple(f"{side}_{joint}" for joint in ("hip", "knee", "ankle") for side in size.SIDES)
NEAR = {
    "hip": ("asis", "trochanter"),
    "knee": ("knee_lateral",),
    "ankle": ("ankle_lateral",),
    "shoulder": ("acromion",),
}
"""Markers near a joint, with which size and up axis are found."""


@dataclass(frozen=True, eq=False)
class PointSet:
    """Points of one person.

    Attributes:
        names: M labels, without the person's name.
        places: (T, M, 3), NaN = not seen; each is seen at some time.
        kind: one of `POINTS`: `joints` or `markers`.
        notes: whose they are, what they are and how that was found, for the reading.
    """

    names: tuple[str, ...]
    places: Array
    kind: str
    notes: tuple[str, ...]

    def named(self, group: str) -> dict[str, Array]:
        """Places (T, 3) of the points of a group of `markers.toml`."""
        return {point: self.places[:, i] for point, i in labels.find(group, self.names).items()}

    def near_joints(self) -> dict[str, Array]:
        """Joints, or the markers near them, (T, 3) by the joint's name."""
        found = self.named("centre")
        if self.kind == "joints":
            found |= self.named("keypoint")
            return found
        skin = self.named("skin")
        for side in size.SIDES:
            for joint, markers in NEAR.items():
                for marker in (f"{side}_{marker}" for marker in markers):
                    if marker in skin:
                        found.setdefault(f"{side}_{joint}", skin[marker])
            self._amid(found, skin, side)
        if "c7" in skin:
            found.setdefault("neck", skin["c7"])
        return found

    def clusters(self) -> dict[str, Array]:
        """Markers (T, N, 3) of thighs and shanks, of the bones that have any."""
        members = {
            f"{side}_{bone}": labels.cluster(bone, side, self.names)
            for side in size.SIDES
            for bone in labels.table("cluster")
        }
        return {bone: self.places[:, rows] for bone, rows in members.items() if rows}

    def _amid(self, found: dict[str, Array], skin: Mapping[str, Array], side: str) -> None:
        """Stand-ins for knees and ankles without a marker: between thigh and shank, and the heel."""
        bones = self.clusters()
        thigh, shank, heel = bones.get(f"{side}_thigh"), bones.get(f"{side}_shank"), skin.get(f"{side}_heel")
        if min(len(bone[0]) if bone is not None else 0 for bone in (thigh, shank)) < functional.MARKERS_MIN:
            return
        if thigh is not None and shank is not None and heel is not None:
            found.setdefault(f"{side}_knee", (thigh.mean(axis=1) + shank.mean(axis=1)) / 2)
            found.setdefault(f"{side}_ankle", heel)

    def at(self, places: Array) -> PointSet:
        """The same points at other places (T, M, 3)."""
        return replace(self, places=places)


def of(content: Content, options: Options, names: Sequence[str], places: Array) -> PointSet:
    """The points of one person of a file.

    Args:
        content: the file, for messages.
        options: of the user.
        names: labels of all M points.
        places: (T, M, 3) of all points; NaN = not seen.

    Raises:
        InputError: nothing is seen, or several people and no choice.
    """
    if not len(names) or not len(places):
        raise content.fail("markers", "none", "a file with markers and frames")
    seen = np.asarray(np.isfinite(places).all(axis=-1).any(axis=0))  # (M,)
    if not seen.any():
        raise content.fail("markers", "none that is ever seen", "finite positions")
    notes = []
    rows = list(range(len(names)))
    augmented = [i for i in rows if names[i].strip().endswith(labels.OPENCAP_SUFFIX)]
    if augmented:
        notes.append(f"the {len(rows) - len(augmented)} keypoints beside OpenCap's markers are left out")
        rows = augmented
    kept, bare, person = subjects.of_one(content, [names[i] for i in rows], options.person)
    chosen = [(label, row) for label, row in zip(bare, (rows[i] for i in kept), strict=True) if seen[row]]
    if not chosen:
        raise content.fail("markers", f"none of {person} that is ever seen", "finite positions")
    alone = tuple(label for label, _ in chosen)
    kind, how = _kind(alone, options.points)
    return PointSet(
        alone, places[:, [row for _, row in chosen]], kind, (person, f"{len(alone)} {kind} ({how})", *notes)
    )


def _kind(names: Sequence[str], choice: str | None) -> tuple[str, str]:
    """Whether the set as a whole is of joints or of markers, and how that was found.

    Some names belong to both, such as `LKnee`, `LHeel` and `RShoulder`; those that belong to one decide.
    """
    if choice is not None:
        return choice, "as given"
    skin = [name for name in names if labels.is_skin(name)]
    joints = [name for name in names if labels.is_keypoint(name)]
    kind, telling = ("markers", skin) if skin and len(skin) >= len(joints) else ("joints", joints)
    return kind, f"by {', '.join(telling[:3])}" if telling else "by their names"


def missing(content: Content, points: PointSet, name: str) -> InputError:
    """The error of a set without a joint, to be raised: what would give it."""
    joint, side = name.split("_")[1], name[0].upper()
    hips = f"{_names('asis')} with {_names('psis')} or {_names('sacrum')}"
    markers = hips if joint == "hip" else _names(f"{joint}_lateral")
    valid = (
        f"after {side}, in a set of joints, {labels.example('keypoint', joint)}; in one of markers, {markers}"
    )
    there = f"{', '.join(points.names[:60])} (a set of {points.kind})"
    return content.fail("markers", f"none that give {name} among {there}", f"{valid}; --points tells which")


def _names(marker: str) -> str:
    return labels.example("skin", marker)
