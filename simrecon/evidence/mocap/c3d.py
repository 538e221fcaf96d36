"""C3D: labelled markers by frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.mocap import c3d_file, markers
from simrecon.evidence.options import Options
from simrecon.types import Evidence

_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")


def matches(content: Content) -> bool:
    """Whether the file is C3D."""
    return content.kind == "c3d"


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the markers' joint centres."""
    file = c3d_file.parse(content)
    point = file.parameters.get("POINT", {})
    labels, outputs, units = _labels(point), _outputs(point), _words(point, "UNITS")
    if not labels:
        raise c3d_file.damage(content, "no labels of points")
    kept = [i for i, label in enumerate(labels[: file.places.shape[1]]) if label not in outputs]
    rate = options.fps or c3d_file.number(point.get("RATE"), file.rate_hz)
    if not rate > 0:
        raise content.fail("POINT.RATE", f"{rate:g}", "a frame rate above 0, or --fps")
    return markers.to_evidence(
        content,
        options,
        [labels[i] for i in kept],
        file.places[:, kept],
        np.arange(len(file.places)) / rate,
        units[0] if units else None,
        ["big-endian numbers"] if file.processor == c3d_file.MIPS else [],
    )


def _labels(point: Mapping[str, Any]) -> list[str]:
    """The labels of all points, which lie in several parameters where there are more than 255."""
    return [
        label for name in ("LABELS", *(f"LABELS{i}" for i in range(2, 10))) for label in _words(point, name)
    ]


def _outputs(point: Mapping[str, Any]) -> frozenset[str]:
    """Labels of what a model has computed: angles, forces and the like, in the columns of points."""
    return frozenset(label for name in _OUTPUTS for label in _words(point, name))


def _words(point: Mapping[str, Any], name: str) -> list[str]:
    """The words of a parameter, without padding; none where it holds numbers."""
    return [word.strip(" \0") for word in point.get(name, ()) if isinstance(word, str)]
