"""How a video is coded, from the bytes of its container: for messages about one that can't be decoded."""

from __future__ import annotations

from pathlib import Path

from simrecon.errors import InputError

NAMES = {
    b"avc1": "H.264", b"avc3": "H.264", b"hvc1": "HEVC", b"hev1": "HEVC", b"dvh1": "Dolby Vision",
    b"dvhe": "Dolby Vision", b"av01": "AV1", b"vp08": "VP8", b"vp09": "VP9", b"vvc1": "VVC", b"vvi1": "VVC",
    b"apch": "ProRes", b"apcn": "ProRes", b"apcs": "ProRes", b"ap4h": "ProRes", b"mp4v": "MPEG-4",
    b"jpeg": "Motion JPEG", b"mjpa": "Motion JPEG",
}  # fmt: skip
"""Codecs of QuickTime and MP4, by the type of a track's sample entry (MP4 registration authority)."""
TRACKS = {
    b"V_MPEG4/ISO/AVC": "H.264", b"V_MPEGH/ISO/HEVC": "HEVC", b"V_AV1": "AV1", b"V_VP8": "VP8",
    b"V_VP9": "VP9",
}  # fmt: skip
"""Codecs of Matroska and WebM, by the CodecID of a track (RFC 9559, codec specifications)."""
ALWAYS = ("H.264", "MPEG-4", "VP8", "VP9", "Motion JPEG")
"""Those that every build of OpenCV with FFmpeg decodes."""
_PIECE = 1 << 22
_TO_TYPE = 16
"""Bytes from the kind of an `stsd` box to the type of its first entry: version, count, size, type."""


def name(path: Path) -> str:
    """Name of the codec of a video's first track that is known, empty if there is none."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(0)
            content = file.read(_PIECE)
            file.seek(max(size - _PIECE, 0))
            content += file.read(_PIECE)  # the index may stand at the end
    except OSError:
        return ""
    at = content.find(b"stsd")
    while at >= 0:
        if found := NAMES.get(content[at + _TO_TYPE : at + _TO_TYPE + 4]):
            return found
        at = content.find(b"stsd", at + 4)
    return next((codec for mark, codec in TRACKS.items() if mark in content[:_PIECE]), "")


def unreadable(path: Path, found: str) -> InputError:
    """That a video can't be read: for its codec, if that may be the reason.

    Args:
        path: of the video.
        found: what is wrong with it, if it isn't the codec.
    """
    codec = name(path)
    if codec and codec not in ALWAYS:
        valid = f"another coding, such as H.264: ffmpeg -i {path.name} -c:v libx264 -crf 18 NEW.mp4"
        return InputError(f"{path}: found {codec}, which OpenCV cannot decode here; valid: {valid}")
    kind = f" ({codec})" if codec else ""
    return InputError(f"{path}: found {found}{kind}; valid: a whole video that FFmpeg reads, such as .mp4")
