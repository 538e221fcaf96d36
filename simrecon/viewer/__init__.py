"""The page of a result (`report.html`): motion in 3D, curves and figures in one offline file."""

from __future__ import annotations

from simrecon.viewer.page import Ghosts, add, render, write

__all__ = ["Ghosts", "add", "render", "write"]
