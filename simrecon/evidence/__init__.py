"""Readers that turn files into `Evidence`: the only place that converts frames, units and joint names."""

from __future__ import annotations

from simrecon.evidence.npz import check_names, read, write
from simrecon.evidence.resample import resample, visibility

__all__ = ["check_names", "read", "resample", "visibility", "write"]
