"""An array of landmarks by frame, (T, J, 3) of x, y and confidence, as GVHMR keeps in `vitpose.pt`.

Also:

- (T, J, 2) without confidences, (T, 33, 4 or 5) of BlazePose: x, y, z, visibility, presence;
- with an axis of people before or behind that of the frames;
- (T, J, 3) of x, y, z: the third column holds no confidences. Then it is an estimate in space (`solid`).
- MoveNet's (T, 1, 1, 17, 3) has y before x.
"""

from __future__ import annotations

import numpy as np

from simrecon.evidence import people as choices
from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import anatomy, entries, layouts, pixels, solid, tracks
from simrecon.evidence.options import Options
from simrecon.types import Array, Evidence

ORDER = layouts.Order("array", layouts.all_names())
COLUMNS = (2, 3, 4, 5)
SCORE_MAX = 2.0
MOVENET_AXES = 5


def matches(content: Content) -> bool:
    """An array of landmarks by frame."""
    tree = content.tree if content.kind in ("torch", "npy", "pickle") else None
    if not isinstance(tree, np.ndarray) or tree.dtype.kind not in "fiu" or not 3 <= tree.ndim <= 5:
        return False
    return tree.shape[-1] in COLUMNS and tree.shape[-2] in layouts.counts()


def read(content: Content, options: Options) -> Evidence:
    """Evidence of an array of landmarks."""
    values = entries.floats(content, "array", content.tree)
    swapped = values.ndim == MOVENET_AXES
    people = _by_frame(content, values)  # (T, P, J, C)
    if swapped:
        people = people[..., [1, 0, *range(2, people.shape[-1])]]
    note = "y before x, as MoveNet has it" if swapped else ""
    if people.shape[-1] == 3 and not _is_scored(people):
        if not pixels.are_shares(people[..., :2]):
            return _in_space(content, people, options)
        people, note = people[..., :2], "third coordinates of an image left out"
    scores = _scores(people)
    detections = [
        tracks.detection(t, person[:, :2], scores[t, k])
        for t, row in enumerate(people)
        for k, person in enumerate(row)
    ]
    return tracks.to_evidence(content, detections, ORDER, options, note)


def _by_frame(content: Content, values: Array) -> Array:
    """The array as (T, P, J, C); of two axes before the landmarks the longer one is time."""
    count, columns = values.shape[-2:]
    leading = [size for size in values.shape[:-2] if size != 1]
    if len(leading) > 2:
        raise content.fail("array", f"shape {values.shape}", "(T, J, C), with an axis of people at most")
    if len(leading) < 2:
        return values.reshape(-1, 1, count, columns)
    both = values.reshape(*leading, count, columns)
    return both if leading[0] >= leading[1] else np.swapaxes(both, 0, 1)


def _is_scored(people: Array) -> bool:
    """Whether the third of three columns holds confidences."""
    third = people[..., 2][np.isfinite(people[..., 2])]
    if not len(third) or third.min() < 0 or third.max() > SCORE_MAX:
        return False
    sizes = anatomy.sizes(people[..., :2].reshape(-1, people.shape[-2], 2))
    return pixels.are_shares(people[..., :2]) or bool(np.median(sizes) >= pixels.PERSON_MIN_PX)


def _scores(people: Array) -> Array:
    """(T, P, J): as the array has them; without any, 1 but for landmarks at (0, 0)."""
    if people.shape[-1] == 3:
        return np.asarray(people[..., 2])
    if people.shape[-1] > 3:  # x, y, z, visibility, presence
        return np.asarray(np.prod(np.clip(people[..., 3:], 0.0, 1.0), axis=-1))
    return np.asarray((np.abs(people).sum(axis=-1) > 0), float)


def _in_space(content: Content, people: Array, options: Options) -> Evidence:
    frames = np.arange(len(people))
    there = [k for k in range(people.shape[1]) if np.isfinite(people[:, k]).any()]
    counts = {str(k): int(np.isfinite(people[:, k]).any(axis=(1, 2)).sum()) for k in there}
    chosen = int(choices.choose(content, counts, options.person))
    return solid.to_evidence(
        content, frames, people[:, chosen], ORDER, options, choices.named(counts, str(chosen))
    )
