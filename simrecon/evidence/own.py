"""simrecon's own evidence as one of the formats: what the file says, less what the user says instead."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from simrecon.evidence import npz
from simrecon.evidence.content import Content, open_content
from simrecon.evidence.options import Options
from simrecon.geometry import camera as cameras
from simrecon.types import Camera, Evidence

SIZE_ERROR_MAX = 0.01


def matches(content: Content) -> bool:
    """Whether the file is `simrecon.evidence/1`, or means to be."""
    return content.kind == "npz" and ("schema" in content.tree or "times_s" in content.tree)


def read(content: Content, options: Options) -> Evidence:
    """The evidence of the file, at the user's frame rate and through the user's lens where there are such."""
    seen = npz.read(content.path)
    notes = [seen.reading] if seen.reading else []
    if options.fps is not None:
        interval_s = float(np.median(np.diff(seen.times_s)))
        seen = replace(seen, times_s=seen.times_s / (interval_s * options.fps))
        notes.append(f"{options.fps:g} Hz as given")
    if options.camera is not None:
        seen = replace(seen, camera=_camera(content, seen, options.camera))
        notes.append(f"lens: {options.lens}")
    return replace(seen, reading=f"simrecon evidence: {'; '.join(notes)}" if notes else "")


def image_size_px(path: str | os.PathLike[str]) -> tuple[int, int] | None:
    """Width and height of the images of an evidence file; None for other files, and where it has no camera.

    Raises:
        InputError: as `read`.
    """
    content = open_content(path)
    camera = npz.read(content.path).camera if matches(content) else None
    return None if camera is None else camera.lens.image_size_px


def _camera(content: Content, seen: Evidence, given: Camera) -> Camera:
    """The given lens; where the camera stands is as the file has it, if the given one does not say."""
    if seen.camera is None:
        return cameras.lasting(given, len(seen.times_s))
    size, other = seen.camera.lens.image_size_px, given.lens.image_size_px
    if any(abs(a - b) > SIZE_ERROR_MAX * a for a, b in zip(size, other, strict=True)):
        sizes = f"a camera of {other[0]} x {other[1]} px for images of {size[0]} x {size[1]} px"
        raise content.fail("image_size_px", sizes, "the size in the file, which needs no --size")
    if given.path is None:
        return Camera(given.lens, seen.camera.path)
    return cameras.lasting(given, len(seen.times_s))
