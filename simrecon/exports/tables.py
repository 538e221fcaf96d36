"""Rows of numbers as text, the way files of biomechanics and spreadsheets have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.types import Array


def rows(columns: Sequence[Array], digits: int = 6, between: str = "\t") -> list[str]:
    """Lines of columns (G,) or (G, n) of numbers, all with so many digits behind the point."""
    table = np.column_stack([column.reshape(len(column), -1) for column in columns])
    form = between.join([f"%.{digits}f"] * table.shape[1])
    return [form % tuple(row) for row in table.tolist()]


def lines(*parts: Sequence[str]) -> bytes:
    """Lines of text as the content of a file."""
    return ("\n".join([line for part in parts for line in part]) + "\n").encode("ascii")
