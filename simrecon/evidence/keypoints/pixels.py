"""Whether the coordinates of landmarks are pixels of the image, by their size and place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import anatomy
from simrecon.evidence.keypoints.following import Detection
from simrecon.evidence.options import Options
from simrecon.types import Array

# No image is so wide, and nobody in an image so small.
PLACE_MAX_PX, PERSON_MIN_PX = 1e6, 8.0
# Shares of the image's sides: landmarks lie in it, except for some of people whom its edge cuts off.
SHARE_RANGE, SHARE_INSIDE = (-0.25, 1.25), 0.9
# Landmarks may lie so far outside the image, as a share of it; of those with such scores so many must lie
# inside, and usually do.
EDGE, SCORE_SURE, INSIDE_MIN, INSIDE_USUAL = 0.02, 0.5, 0.75, 0.97
SMALL_SHARE = 0.55
NEEDS_SIZE = "--size WIDTHxHEIGHT with --fov or --camera, or --video, to make pixels of them"


def in_pixels(
    content: Content, detections: Sequence[Detection], options: Options, *, centred: bool = False
) -> tuple[list[Detection], str]:
    """The same detections in pixels, and what was done.

    Args:
        content: the file, for messages.
        detections: of everybody.
        options: of the user; the camera has the size of the image.
        centred: whether the format knows coordinates from -1 to 1.

    Raises:
        InputError: no pixels and no shares of the image, or shares and no size of it.
    """
    seen = [one for one in detections if np.isfinite(one.points_px).all(axis=-1).any()]
    if not seen:
        return list(detections), ""
    size = float(np.median([anatomy.sizes(one.points_px[None])[0] for one in seen]))
    values = np.concatenate([one.points_px[np.isfinite(one.points_px).all(axis=-1)] for one in seen])
    if size >= PERSON_MIN_PX:
        if (np.abs(values) > PLACE_MAX_PX).any():
            text = f"a landmark {np.abs(values).max():.3g} px away"
            raise content.fail("keypoints", text, f"at most {PLACE_MAX_PX:g}")
        return list(detections), ""
    if are_shares(values):
        name, offset, factor = "0 to 1", 0.0, 1.0
    elif centred and (np.abs(values) <= SHARE_RANGE[1]).all():
        name, offset, factor = "-1 to 1", 1.0, 0.5
    else:
        text = f"coordinates from {values.min():.3g} to {values.max():.3g}, a person {size:.2g} across"
        raise content.fail(
            "keypoints", text, "pixels of the image, or shares of its width and height, 0 to 1"
        )
    if options.camera is None:
        raise content.fail("keypoints", f"coordinates from {name}, shares of the image's sides", NEEDS_SIZE)
    sides = np.array(options.camera.lens.image_size_px, float)
    wide, high_px = options.camera.lens.image_size_px
    scaled = [replace(one, points_px=(one.points_px + offset) * factor * sides) for one in detections]
    return scaled, f"coordinates from {name} taken as shares of {wide} x {high_px} px"


def are_shares(points: Array) -> bool:
    """Whether x and y of points (…, 2) are shares of the image's sides."""
    values = points[np.isfinite(points).all(axis=-1)]
    low, high = SHARE_RANGE
    inside = ((values >= 0) & (values <= 1)).all(axis=-1)
    return bool(
        len(values) and values.min() >= low and values.max() <= high and inside.mean() >= SHARE_INSIDE
    )


def check(content: Content, points: Array, scores: Array, options: Options) -> str:
    """Doubts about where one person's landmarks (T, J, 2) with scores (T, J) lie in the image, to be said.

    Raises:
        InputError: they don't lie in the image that the lens is of.
    """
    if options.camera is None:
        return ""
    return _place(content, points, scores, np.array(options.camera.lens.image_size_px, float))


def _place(content: Content, points: Array, scores: Array, sides: Array) -> str:
    sure = np.isfinite(points).all(axis=-1) & (scores >= min(SCORE_SURE, float(np.nanmax(scores))))
    values = points[sure]
    size, turned = f"{sides[0]:g}x{sides[1]:g}", f"{sides[1]:g}x{sides[0]:g}"
    share, other = _inside(values, sides), _inside(values, sides[::-1])
    extent = f"landmarks at x {_span(values[:, 0])}, y {_span(values[:, 1])} px"
    exchanged = other >= INSIDE_USUAL and sides[0] != sides[1]
    if share < INSIDE_MIN:
        hint = (
            f"--size {turned}, width and height exchanged"
            if exchanged
            else "--size of the images they are of"
        )
        raise content.fail("image size", f"{extent} in an image of {size}", hint)
    if share < INSIDE_USUAL:
        doubt = (
            f", {other:.0%} would in one of {turned}: are width and height exchanged?" if exchanged else ""
        )
        return f"{share:.0%} of the landmarks lie in the image of {size}{doubt}"
    if (values.max(axis=0) < SMALL_SHARE * sides).all():
        return (
            f"{extent} take up the upper left of an image of {size} only: is that the size that they are of?"
        )
    return ""


def _inside(values: Array, sides: Array) -> float:
    edge = EDGE * sides
    return float(((values >= -edge) & (values <= sides + edge)).all(axis=-1).mean())


def _span(values: Array) -> str:
    return f"{values.min():.0f} to {values.max():.0f}"


def upright(points: Array, names: Sequence[str]) -> Array:
    """From the feet, or else the hips, to the shoulders, (T, 2 or 3); NaN where unknown."""
    at = {name: i for i, name in enumerate(anatomy.canonical(names)) if name}
    result = np.full((len(points), points.shape[-1]), np.nan)
    for low in ("hip", "ankle"):  # the feet outweigh the hips
        pairs = [(at.get(f"{side}_{low}"), at.get(f"{side}_shoulder")) for side in ("left", "right")]
        for foot, shoulder in pairs:
            if foot is not None and shoulder is not None:
                along = points[:, shoulder] - points[:, foot]
                result = np.where(np.isfinite(along).all(axis=-1, keepdims=True), along, result)
    return result
