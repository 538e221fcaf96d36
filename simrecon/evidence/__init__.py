"""Readers that turn files into `Evidence`: the only place that converts frames, units and joint names."""

from __future__ import annotations

from simrecon.evidence.camera.hidden import unknown_camera
from simrecon.evidence.content import is_video
from simrecon.evidence.cutting import Span, cut, within
from simrecon.evidence.formats import read
from simrecon.evidence.memory import from_arrays
from simrecon.evidence.npz import check_names, write
from simrecon.evidence.options import Options
from simrecon.evidence.own import image_size_px
from simrecon.evidence.resample import resample, visibility

__all__ = [
    "Options",
    "Span",
    "check_names",
    "cut",
    "from_arrays",
    "image_size_px",
    "is_video",
    "read",
    "resample",
    "unknown_camera",
    "visibility",
    "within",
    "write",
]
