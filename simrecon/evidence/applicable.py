"""Which options have a meaning for which formats: one that has none is refused, never silently ignored."""

from __future__ import annotations

from simrecon.evidence.content import Content
from simrecon.evidence.options import Options

FLAGS = {
    "up": "--up",
    "unit": "--unit",
    "frame": "--frame",
    "person": "--person",
    "person_at": "--person-at",
    "model": "--model",
    "joints": "--joints",
    "points": "--points",
    "layout": "--layout",
    "turn_deg": "--rotate",
}
"""Fields of `Options` that have a meaning for some formats only."""
OF_VIDEOS = ("person_at", "model")
OF_SECOND = (*OF_VIDEOS, "turn_deg")
"""Those that may be meant for a second file beside the input, whose landmarks are in an image."""
_PLAIN, _PEOPLE, _MARKERS, _IMAGE = ("up", "frame"), ("person",), ("up", "unit"), ("turn_deg",)
TAKES: dict[str, tuple[str, ...]] = {
    "evidence": _IMAGE,
    **dict.fromkeys(("gvhmr", "gem", "tram"), (*_PLAIN, *_IMAGE)),
    **dict.fromkeys(("amass", "smpl"), _PLAIN),
    **dict.fromkeys(("wham", "prompthmr"), (*_PLAIN, *_PEOPLE, *_IMAGE)),
    "3dpw": ("up", *_PEOPLE, *_IMAGE),
    "phc": ("up", *_PEOPLE),
    "humanml3d": ("up",),
    **dict.fromkeys(("phalp", "sam3d", "deeplabcut"), (*_PEOPLE, *_IMAGE)),
    **dict.fromkeys(("openpose", "alphapose", "coco"), (*_PEOPLE, "layout", *_IMAGE)),
    **dict.fromkeys(("mmpose", "array"), (*_PEOPLE, *_MARKERS, "layout", *_IMAGE)),
    **dict.fromkeys(("vitpose", "mediapipe"), (*_PEOPLE, *_IMAGE)),
    "freemocap": _MARKERS,
    "bvh": (*_MARKERS, "joints"),
    **dict.fromkeys(("trc", "c3d"), (*_MARKERS, *_PEOPLE, "points")),
    "mot": tuple(FLAGS),  # refused whatever is said of it
    "video": (*_PEOPLE, *OF_VIDEOS, *_IMAGE),
}
"""Those of `FLAGS` that the reader of a format looks at, by the name of the format."""


def refuse(
    content: Content,
    options: Options,
    format_name: str,
    *,
    other: str | None = None,
    person: str = FLAGS["person"],
) -> None:
    """Refuse what the user says of a file although its reader never looks at it.

    Args:
        content: the file.
        options: of the user.
        format_name: of the file.
        other: format of a second file, which options for videos may be meant for.
        person: flag of the person.

    Raises:
        InputError: names the option, and the formats that it is for.
    """
    usable = set(TAKES[format_name])
    if other is not None:
        usable |= set(OF_SECOND) & set(TAKES[other])
    if options.camera is not None and options.camera.path is not None:
        usable.add("up")  # of the world in which --camera has its place
    for name, flag in FLAGS.items():
        value = getattr(options, name)
        if value not in (None, ()) and name not in usable:
            takers = ", ".join(key for key, taken in TAKES.items() if name in taken and key != "mot")
            found = f"{value!r}, which has no meaning for the format {format_name}"
            raise content.fail(
                person if name == "person" else flag, found, f"leave it out; it is for {takers}"
            )
