"""The formats that can be read, by content, and the reading of two files as one.

A reader is a row of `READERS`: a name for `--format`, a test of the content, a function that makes evidence.
Readers are tried in order; the first whose test holds reads the file.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence import npz
from simrecon.evidence.content import Content, open_content
from simrecon.evidence.keypoints import flat, people3d
from simrecon.evidence.mocap import bvh, c3d, trc
from simrecon.evidence.options import Options
from simrecon.evidence.smpl import amass, gvhmr, prompthmr, tram, wham
from simrecon.evidence.video import reader as video
from simrecon.geometry import camera as cameras
from simrecon.types import Camera, Evidence

NO_LENS = (
    "landmarks in an image, but no lens; valid: --fov DEGREES and --size WIDTHxHEIGHT, "
    "or --keypoints of a file with one"
)
OVERLAP_MIN = 0.5
_MISFITS = (TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError)
"""What a reader ends in if a value deep in a file is of a kind that nobody thought of."""


@dataclass(frozen=True)
class Reader:
    """A format.

    Attributes:
        name: for `--format`.
        title: for messages.
        matches: whether a file is of this format.
        read: makes evidence of it.
    """

    name: str
    title: str
    matches: Callable[[Content], bool]
    read: Callable[[Content, Options], Evidence]


def _is_evidence(content: Content) -> bool:
    return content.kind == "npz" and ("schema" in content.tree or "times_s" in content.tree)


def _read_evidence(content: Content, _options: Options) -> Evidence:
    return npz.read(content.path)


READERS: tuple[Reader, ...] = (
    Reader("evidence", "simrecon evidence", _is_evidence, _read_evidence),
    Reader("wham", "WHAM", wham.matches, wham.read),
    Reader("gvhmr", "GVHMR", gvhmr.matches_gvhmr, gvhmr.read_gvhmr),
    Reader("gem", "GEM/GENMO", gvhmr.matches_gem, gvhmr.read_gem),
    Reader("tram", "TRAM", tram.matches, tram.read),
    Reader("phalp", "4DHumans/PHALP", people3d.matches_phalp, people3d.read_phalp),
    Reader("prompthmr", "PromptHMR", prompthmr.matches, prompthmr.read),
    Reader("sam3d", "SAM 3D Body", people3d.matches_sam, people3d.read_sam),
    Reader("amass", "AMASS", amass.matches_amass, amass.read_amass),
    Reader("smpl", "SMPL/SMPL-X parameters", amass.matches_smpl, amass.read_smpl),
    Reader("openpose", "OpenPose", flat.matches_openpose, flat.read_openpose),
    Reader("mmpose", "MMPose/RTMPose", flat.matches_mmpose, flat.read_mmpose),
    Reader("alphapose", "AlphaPose", flat.matches_alphapose, flat.read_alphapose),
    Reader("coco", "COCO", flat.matches_coco, flat.read_coco),
    Reader("array", "landmark array", flat.matches_array, flat.read_array),
    Reader("bvh", "BVH", bvh.matches, bvh.read),
    Reader("trc", "TRC", trc.matches, trc.read),
    Reader("mot", "MOT", trc.matches_mot, trc.read_mot),
    Reader("c3d", "C3D", c3d.matches, c3d.read),
    Reader("video", "video", video.matches, video.read),
)


def names() -> tuple[str, ...]:
    """Names of the formats, for `--format`."""
    return tuple(reader.name for reader in READERS)


def read(
    path: str | os.PathLike[str],
    options: Options | None = None,
    *,
    keypoints: str | os.PathLike[str] | None = None,
    keypoints_person: str | None = None,
) -> Evidence:
    """Read evidence of any known format.

    Args:
        path: a file or folder.
        options: what the user says of it; nothing if None.
        keypoints: a second file, whose 2D landmarks go with the first one's 3D estimate.
        keypoints_person: of that file.

    Returns:
        Checked evidence; `reading` says how the file was understood.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    given = options or Options()
    first = _read(path, given)
    if keypoints is None:
        return _checked(first, path)
    asked = replace(given, format=None, person=keypoints_person, up=None, unit=None, frame=None)
    if asked.camera is None and first.camera is not None:
        asked = replace(asked, camera=Camera(first.camera.lens), lens=f"that of {os.path.basename(path)}")
    return _checked(join(first, _read(keypoints, asked), path, keypoints), path)


def _read(path: str | os.PathLike[str], options: Options) -> Evidence:
    content = open_content(path)
    reader = _reader(content, options.format)
    try:
        found = reader.read(content, options)
    except _MISFITS as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        valid = f"a file as {reader.title} has it; --debug shows where"
        raise content.fail("layout", f"values that don't fit it ({reason})", valid) from error
    if reader.name == "evidence":
        return found
    camera = found.camera
    if camera is not None and camera.path is not None and len(camera.path) == 1:  # that of the options
        camera = cameras.lasting(camera, len(found.times_s))
    return replace(found, camera=camera, reading=f"{reader.title}: {found.reading}")


def _reader(content: Content, asked: str | None) -> Reader:
    if asked is not None:
        chosen = next((reader for reader in READERS if reader.name == asked), None)
        if chosen is None:
            raise content.fail("--format", repr(asked), ", ".join(names()))
        if not chosen.matches(content):
            raise content.fail("--format", f"content that is not {chosen.title}'s", "another format, or none")
        return chosen
    chosen = next((reader for reader in READERS if reader.matches(content)), None)
    if chosen is None:
        titles = ", ".join(reader.title for reader in READERS if reader.name != "mot")
        raise content.fail("format", f"{_seen(content)} of no known format", titles)
    return chosen


def _seen(content: Content) -> str:
    keys = list(content.tree)[:8] if isinstance(content.tree, dict) else []
    kinds = {"npz": "an .npz", "torch": "a torch file", "npy": "an .npy", "json": "JSON", "c3d": "C3D"}
    what = kinds.get(content.kind, f"a {content.kind}" if content.kind != "unknown" else "a file")
    return what + (f" with {', '.join(map(str, keys))}" if keys else "")


def _checked(evidence: Evidence, path: str | os.PathLike[str]) -> Evidence:
    """The checks that all evidence must pass, whatever it was read from."""
    if evidence.keypoint_names and evidence.camera is None:
        raise InputError(f"{os.fspath(path)}: found {NO_LENS}")
    checked = npz.check(evidence, os.fspath(path))
    return replace(checked, sha256=evidence.sha256, reading=evidence.reading)


def join(
    first: Evidence,
    second: Evidence,
    path: str | os.PathLike[str],
    keypoints: str | os.PathLike[str],
) -> Evidence:
    """The first evidence with the 2D landmarks of the second, at the first one's times.

    Args:
        first: with a 3D estimate.
        second: with 2D landmarks; a frame goes with the first one's nearest within half an interval.
        path: of the first, for messages.
        keypoints: path of the second.

    Raises:
        InputError: one has nothing to give, or they have hardly a frame in common.
    """
    if not second.keypoint_names:
        raise InputError(f"{os.fspath(keypoints)}: found no 2D landmarks; valid: a file with them")
    if not first.joint_names:
        raise InputError(f"{os.fspath(path)}: found no 3D estimate; valid: one, to go with --keypoints")
    if first.camera is None and second.camera is None:
        raise InputError(
            f"{os.fspath(path)}: found {NO_LENS.replace(', or --keypoints of a file with one', '')}"
        )
    interval = float(np.median(np.diff(first.times_s))) if len(first.times_s) > 1 else np.inf
    right = np.clip(np.searchsorted(second.times_s, first.times_s), 1, max(len(second.times_s) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(second.times_s) - 1)
    nearer = np.abs(second.times_s[left] - first.times_s) <= np.abs(second.times_s[right] - first.times_s)
    nearest = np.where(nearer, left, right)
    near = np.abs(second.times_s[nearest] - first.times_s) <= 0.5 * interval  # (T,)
    if near.mean() < OVERLAP_MIN:
        found = f"landmarks for {int(near.sum())} of the {len(near)} frames of {os.fspath(path)}"
        raise InputError(
            f"{os.fspath(keypoints)}: found {found}; valid: both of the same video, at one --fps"
        )
    camera = first.camera
    if camera is None and second.camera is not None:
        camera = cameras.at(second.camera, nearest)
    return replace(
        first,
        keypoint_names=second.keypoint_names,
        keypoints_px=np.where(near[:, None, None], second.keypoints_px[nearest], np.nan),
        scores=np.where(near[:, None], second.scores[nearest], 0.0),
        camera=camera,
        reading=f"{first.reading}\n{second.reading}, for {int(near.sum())} of {len(near)} frames",
    )
