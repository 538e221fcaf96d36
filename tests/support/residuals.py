"""The weighted vectors of a loss, one beside the other: what Gauss-Newton steps take the squares of."""

from __future__ import annotations

import numpy as np

from simrecon.optim.gauss_newton import Term
from simrecon.types import Array


def residuals(terms: list[Term], roots: list[Array]) -> Array:
    """All vectors times their √ω, by the frame at which they are known: (P, F, K).

    F is the most frames that a term has. The vectors of a term with fewer, such as velocities, are those of
    the last frames; before them are zeros. Of roots of more frames the last ones count.
    """
    count, frames = len(terms[0].vectors), max(term.vectors.shape[1] for term in terms)
    widths = [int(np.prod(term.vectors.shape[2:])) for term in terms]
    rows, end = np.zeros((count, frames, sum(widths))), 0
    for term, root, width in zip(terms, roots, widths, strict=True):
        weighted = (root[-term.vectors.shape[1] :] * term.vectors).reshape(count, -1, width)
        rows[:, frames - weighted.shape[1] :, end : end + width] = weighted
        end += width
    return rows
