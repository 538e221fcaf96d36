"""The formats that can be read, by content.

A reader is a row of `READERS`: a name for `--format`, a test of the content, a function that makes evidence.
Readers are tried in order; the first whose test holds reads the file.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence import applicable, cutting, joining, npz, own, plausible, upright
from simrecon.evidence.content import Content, open_content
from simrecon.evidence.keypoints import (
    array,
    coco,
    deeplabcut,
    freemocap,
    mediapipe,
    mmpose,
    openpose,
    phalp,
    sam3d,
    vitpose,
)
from simrecon.evidence.mocap import bvh, c3d, trc
from simrecon.evidence.options import Options
from simrecon.evidence.smpl import amass, gvhmr, humanml3d, phc, prompthmr, threedpw, tram, wham
from simrecon.evidence.video import reader as video
from simrecon.geometry import camera as cameras
from simrecon.io.limits import MISFITS
from simrecon.types import Camera, Evidence


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


READERS: tuple[Reader, ...] = (
    Reader("evidence", "simrecon evidence", own.matches, own.read),
    Reader("wham", "WHAM", wham.matches, wham.read),
    Reader("gvhmr", "GVHMR", gvhmr.matches_gvhmr, gvhmr.read_gvhmr),
    Reader("gem", "GEM/GENMO", gvhmr.matches_gem, gvhmr.read_gem),
    Reader("tram", "TRAM", tram.matches, tram.read),
    Reader("phalp", "4DHumans/PHALP", phalp.matches, phalp.read),
    Reader("prompthmr", "PromptHMR", prompthmr.matches, prompthmr.read),
    Reader("sam3d", "SAM 3D Body", sam3d.matches, sam3d.read),
    Reader("3dpw", "3DPW", threedpw.matches, threedpw.read),
    Reader("phc", "PHC", phc.matches, phc.read),
    Reader("amass", "AMASS", amass.matches_amass, amass.read_amass),
    Reader("smpl", "SMPL/SMPL-X parameters", amass.matches_smpl, amass.read_smpl),
    Reader("humanml3d", "HumanML3D", humanml3d.matches, humanml3d.read),
    Reader("openpose", "OpenPose", openpose.matches, openpose.read),
    Reader("mmpose", "MMPose/RTMPose", mmpose.matches, mmpose.read),
    Reader("vitpose", "easy_ViTPose", vitpose.matches, vitpose.read),
    Reader("alphapose", "AlphaPose", coco.matches_alphapose, coco.read_alphapose),
    Reader("coco", "COCO", coco.matches_coco, coco.read_coco),
    Reader("mediapipe", "MediaPipe", mediapipe.matches, mediapipe.read),
    Reader("deeplabcut", "DeepLabCut", deeplabcut.matches, deeplabcut.read),
    Reader("freemocap", "FreeMoCap", freemocap.matches, freemocap.read),
    Reader("array", "landmark array", array.matches, array.read),
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
    options = options or Options()
    content = open_content(path)
    reader = _reader(content, options.format)
    if keypoints is None:
        applicable.refuse(content, options, reader.name)
        return _checked(_part(_read(content, reader, options), content, options), path, options)
    content2 = open_content(keypoints)
    reader2 = _reader(content2, None)
    applicable.refuse(content, options, reader.name, other=reader2.name)
    said = Options(person=keypoints_person)
    applicable.refuse(content2, said, reader2.name, person="--keypoints-person")
    first = _part(_read(content, reader, replace(options, landmarks=True)), content, options)
    others = replace(
        options, format=None, person=keypoints_person, layout=None, up=None, unit=None, frame=None, joints=()
    )
    others = replace(others, span=replace(options.span, every=1))  # its frames may be others
    if others.camera is None and first.camera is not None:
        others = replace(others, camera=Camera(first.camera.lens), lens=f"that of {os.path.basename(path)}")
    return _checked(joining.join(first, _read(content2, reader2, others), path, keypoints), path, options)


def format_of(path: str | os.PathLike[str], name: str | None = None) -> str:
    """The name of a file's format, by content; `name` forces one.

    Raises:
        InputError: it can't be read, or is of no known format.
    """
    return _reader(open_content(path), name).name


def _read(content: Content, reader: Reader, options: Options) -> Evidence:
    """The evidence of a file; that of an image which the user turns is of the upright one."""
    turn, aspect = options.turn_deg or 0, options.aspect
    as_stored = reader.name != "video" and "turn_deg" in applicable.TAKES[reader.name]
    if not as_stored or (turn, aspect) == (0, 1.0):
        return _as_it_is(content, reader, options)
    if options.camera is not None:
        options = replace(options, camera=upright.stored(options.camera, turn, aspect))
    seen = upright.upright(_as_it_is(content, reader, options), turn, aspect)
    notes = [f"turned by {turn}°"] if turn else []
    notes += [f"pixels {aspect:.4g} times as wide as high made square"] if aspect != 1.0 else []
    return _noted(seen, ", ".join(notes))


def _noted(seen: Evidence, note: str) -> Evidence:
    """Evidence with a word more in the first line of its reading."""
    first, *others = (seen.reading or joining.OWN).splitlines()
    return replace(seen, reading="\n".join((f"{first}; {note}", *others))) if note else seen


def _as_it_is(content: Content, reader: Reader, options: Options) -> Evidence:
    try:
        with np.errstate(all="ignore"):  # what comes of absurd numbers is refused by the checks
            evidence = reader.read(content, options)
    except MISFITS as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        valid = f"a file as {reader.title} has it; --debug shows where"
        raise content.fail("layout", f"values that do not fit it ({reason})", valid) from error
    if reader.name == "evidence":
        return evidence
    camera = evidence.camera
    if camera is not None and camera.path is not None and len(camera.path) == 1:  # that of the options
        camera = cameras.lasting(camera, len(evidence.times_s))
    return replace(evidence, camera=camera, reading=f"{reader.title}: {evidence.reading}")


def _part(evidence: Evidence, content: Content, options: Options) -> Evidence:
    """The part that is asked for; a video is cut while it is looked at."""
    if content.kind != "video":
        evidence = cutting.within(evidence, options.span, content.source)
    return _noted(evidence, cutting.told(evidence))


def _reader(content: Content, name: str | None) -> Reader:
    if name is not None:
        chosen = next((reader for reader in READERS if reader.name == name), None)
        if chosen is None:
            raise content.fail("--format", repr(name), ", ".join(names()))
        if not chosen.matches(content):
            raise content.fail("--format", f"content that is not {chosen.title}'s", "another format, or none")
        return chosen
    chosen = next((reader for reader in READERS if reader.matches(content)), None)
    if chosen is None and content.kind == "folder":
        raise _folder(content)
    if chosen is None:
        titles = ", ".join(reader.title for reader in READERS if reader.name != "mot")
        raise content.fail("format", f"{_seen(content)} of no known format", titles)
    return chosen


def _folder(content: Content) -> InputError:
    if (content.path / "report.json").is_file():
        valid = "what it was made from; `simrecon rerun` and `simrecon export` begin with a result"
        return content.fail("format", "the result of a run", valid)
    valid = "a file, or a folder of OpenPose's JSON files; `simrecon batch` takes a folder of clips"
    return content.fail("format", "a folder of no known format", valid)


def _seen(content: Content) -> str:
    keys = list(content.tree)[:8] if isinstance(content.tree, dict) else []
    kinds = {"npz": "an .npz", "torch": "a torch file", "npy": "an .npy", "json": "JSON", "c3d": "C3D"}
    what = kinds.get(content.kind, f"a {content.kind}" if content.kind != "unknown" else "a file")
    if content.kind == "unknown" and not content.raw:
        what = "an empty file, which is"
    return what + (f" with {', '.join(map(str, keys))}" if keys else "")


def _checked(evidence: Evidence, path: str | os.PathLike[str], options: Options) -> Evidence:
    """The checks that all evidence must pass, whatever it was read from."""
    if evidence.keypoint_names and evidence.camera is None:
        raise InputError(f"{os.fspath(path)}: found {joining.NO_LENS}")
    checked = npz.check(evidence, os.fspath(path))
    checked = replace(checked, sha256=evidence.sha256, reading=evidence.reading)
    return plausible.checked(checked, os.fspath(path), unit_given=options.unit is not None)
