"""What kind of container a file is, by its first bytes."""

from __future__ import annotations

import zipfile
from pathlib import Path

_VIDEO = (b"\x1a\x45\xdf\xa3", b"RIFF", b"\x00\x00\x01\xba", b"\x00\x00\x01\xb3", b"FLV")
_MOVIE_BOXES = (b"ftyp", b"moov", b"mdat", b"wide")
_NPY = b"\x93NUMPY"
UTF16 = (b"\xff\xfe", b"\xfe\xff")
"""The first bytes of text in two bytes a letter, as some programs of Windows write it."""


def kind(path: Path, head: bytes) -> str:
    """Kind of a file with this beginning (`content.Content`)."""
    if head.startswith(b"PK\x03\x04"):
        return "torch" if _is_torch(path) else "npz"
    if head.startswith(_NPY):
        return "npy"
    if head[4:8] in _MOVIE_BOXES or head.startswith(_VIDEO) or (head[:1] == b"G" and head[188:189] == b"G"):
        return "video"
    if len(head) > 1 and head[1] == 0x50 and head[0] < 0x20 and head[0] > 0:
        return "c3d"
    if head[:1] == b"\x80" or _is_compressed(head):
        return "pickle"
    if head.startswith(UTF16):
        return "text"
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if start.startswith((b"{", b"[")):
        return "json"
    return "text" if start and b"\x00" not in head else "unknown"


def _is_compressed(head: bytes) -> bool:
    zlib = head[:1] == b"x" and len(head) > 1 and int.from_bytes(head[:2], "big") % 31 == 0
    others = (b"\x1f\x8b", b"BZh", b"\xfd7zXZ\x00", b"]\x00\x00", b"\x04\x22\x4d\x18", b"\x28\xb5\x2f\xfd")
    return (zlib and head[1:2] in b"\x01\x5e\x9c\xda") or head.startswith(others)


def _is_torch(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name == "data.pkl" or name.endswith("/data.pkl") for name in archive.namelist())
    except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError, RuntimeError):
        return False
