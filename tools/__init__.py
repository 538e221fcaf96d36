"""Programs that are not shipped, in groups; each runs from the checkout as `python -m tools.GROUP.NAME`."""

from __future__ import annotations

from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
"""The repository's root: its `docs/`, `models/` and `simrecon/` are what the tools read and write."""
