"""A support that a motion needs, as the rules report it."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon.types import SceneItem


@dataclass(frozen=True)
class Suggestion:
    """A support that the motion needs.

    Attributes:
        item: for the scene file.
        why: one line with the evidence.
        spans: first and last frames of the evidence.
    """

    item: SceneItem
    why: str
    spans: tuple[tuple[int, int], ...]
