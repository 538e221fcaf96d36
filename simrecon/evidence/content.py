"""A file or folder of any format, opened as far as its container goes: what is within is for the readers."""

from __future__ import annotations

import functools
import hashlib
import io
import json
import os
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io import pickles
from simrecon.io.arrays import Arrays, listed
from simrecon.io.limits import MAX_BYTES, decompressed, size_text
from simrecon.io.npz import parse_npz
from simrecon.io.pickles import torch_files

_VIDEO = (b"\x1a\x45\xdf\xa3", b"RIFF", b"\x00\x00\x01\xba", b"\x00\x00\x01\xb3", b"FLV")
_MOVIE_BOXES = (b"ftyp", b"moov", b"mdat", b"wide")
_NPY = b"\x93NUMPY"
_JSON_FILES_MAX = 500_000


@dataclass(frozen=True)
class Content:
    """A file or folder.

    Attributes:
        path: of it; source: the same for messages.
        kind: `folder`, `npz`, `torch`, `npy`, `pickle`, `json`, `text`, `c3d`, `video` or `unknown`.
    """

    path: Path
    kind: str

    @property
    def source(self) -> str:
        """The path, for messages."""
        return os.fspath(self.path)

    @cached_property
    def raw(self) -> bytes:
        """The bytes of the file."""
        return _bytes(self.path)

    @cached_property
    def sha256(self) -> str:
        """Of the bytes of the file; of a folder, of those of its JSON files in the order of their names."""
        if self.kind == "video":  # of any size
            with self.path.open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        if self.kind != "folder":
            return hashlib.sha256(self.raw).hexdigest()
        total = hashlib.sha256()
        for path in self.json_files:
            total.update(_bytes(path))
        return total.hexdigest()

    @cached_property
    def text(self) -> str:
        """The file as text, UTF-8 or Latin-1."""
        try:
            return self.raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            return self.raw.decode("latin-1")

    @cached_property
    def json_files(self) -> tuple[Path, ...]:
        """JSON files of a folder, by name."""
        return tuple(sorted(self.path.glob("*.json"))[:_JSON_FILES_MAX])

    @cached_property
    def tree(self) -> Any:
        """Nested dictionaries, lists, numbers, text and arrays; None for files that hold none."""
        return _TREES[self.kind](self) if self.kind in _TREES else None

    def fail(self, key: str, found: str, valid: str) -> InputError:
        """The one-line error of a key, to be raised."""
        return InputError(f"{self.source}: {key}: found {found}; valid: {valid}")


def open_content(path: str | os.PathLike[str]) -> Content:
    """See what kind of container a path is, by its first bytes.

    Raises:
        InputError: it can't be read or is too large.
    """
    path = Path(path)
    try:
        if path.is_dir():
            return Content(path, "folder")
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); give an existing file") from error
    kind = _kind(path, head)
    if size > MAX_BYTES and kind != "video":
        raise InputError(f"{path}: found {size_text(size)}; valid: at most {size_text(MAX_BYTES)}")
    return Content(path, kind)


def is_video(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a video, by its first bytes.

    Raises:
        InputError: as `open_content`.
    """
    return open_content(path).kind == "video"


def _kind(path: Path, head: bytes) -> str:
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
    except (OSError, zipfile.BadZipFile, ValueError):
        return False


def _bytes(path: Path) -> bytes:
    try:
        if (size := path.stat().st_size) > MAX_BYTES:
            raise InputError(f"{path}: found {size_text(size)}; valid: at most {size_text(MAX_BYTES)}")
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); give an existing file") from error


def _npz(content: Content) -> dict[str, Any]:
    return dict(parse_npz(content.source, content.raw, objects=_object_array).content)


def _object_array(source: str, key: str, raw: bytes) -> NDArray[Any]:
    return npy(f"{source}: {listed([key])}", raw)


def npy(source: str, raw: bytes) -> NDArray[Any]:
    """The array of an `.npy`; Python objects in it are read by our own unpickler.

    Args:
        source: name of the file, for messages.
        raw: its bytes.

    Raises:
        InputError: damaged, or something in it that is not plain data.
    """
    stream = io.BytesIO(raw)
    try:
        version = np.lib.format.read_magic(stream)
        read = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, fortran, dtype = read(stream)
    except (ValueError, EOFError, struct.error, SyntaxError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{source}: found a damaged header ({reason}); valid: a whole .npy file") from error
    there = len(raw) - stream.tell()
    if dtype.hasobject:
        values = pickles.loads(source, raw[stream.tell() :])
        if not isinstance(values, np.ndarray):
            raise InputError(f"{source}: found objects that are no array; valid: a whole .npy file")
        return values
    count = functools.reduce(lambda a, b: a * b, shape, 1)
    if count * dtype.itemsize != there:
        found_text = f"{size_text(there)} for an array of {size_text(count * dtype.itemsize)}"
        raise InputError(f"{source}: found {found_text}; valid: a whole .npy file")
    plain: NDArray[Any] = np.frombuffer(raw, dtype, count, stream.tell())
    return plain.reshape(shape, order="F" if fortran else "C")


def _single(array: NDArray[Any]) -> Any:
    """What `np.save` of a dictionary holds: an array of no axes with one object."""
    return array.item() if array.dtype.hasobject and array.ndim == 0 else array


def _torch(content: Content) -> Any:
    try:
        with zipfile.ZipFile(io.BytesIO(content.raw)) as archive:
            raw, storages = torch_files.archive_pickle(content.source, archive)
            return pickles.loads(content.source, raw, storages)
    except (zipfile.BadZipFile, OSError, ValueError, RuntimeError, NotImplementedError) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"{content.source}: found a damaged archive ({reason}); valid: a whole file"
        ) from error


def _json(content: Content) -> Any:
    try:
        return json.loads(content.text)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{content.source}: found damaged JSON ({reason}); valid: a whole file") from error


def _pickle(content: Content) -> Any:
    raw = decompressed(content.source, content.raw)
    tree = pickles.loads(content.source, raw)
    return pickles.loads_legacy(content.source, raw) if torch_files.is_legacy(tree) else tree


_TREES = {
    "npz": _npz,
    "npy": lambda content: _single(npy(content.source, content.raw)),
    "torch": _torch,
    "pickle": _pickle,
    "json": _json,
}


def branch(content: Content, tree: Any, prefix: str) -> Arrays:
    """What can be an array among the values of a dictionary, for the checks that every reader makes.

    Args:
        content: the file, for messages.
        tree: a dictionary.
        prefix: how the keys are called in messages, such as `smpl_params_global.`.

    Raises:
        InputError: no dictionary.
    """
    if not isinstance(tree, Mapping):
        raise content.fail(
            prefix.rstrip(".") or "content", f"a {type(tree).__name__}", "a dictionary of arrays"
        )
    arrays = {
        f"{prefix}{key}": array for key, value in tree.items() if (array := as_array(value)) is not None
    }
    return Arrays(content.source, arrays, content.sha256)


def as_array(value: Any) -> NDArray[Any] | None:
    """A number, text, array or nested list of numbers as an array; None if it is none."""
    if isinstance(value, np.ndarray):
        return np.asarray(value)
    if isinstance(value, (int, float, str, bool, np.generic)):
        return np.asarray(value)
    if isinstance(value, (list, tuple)) and value:
        count, longest = _extent(value)
        if 4 * count * longest > MAX_BYTES:  # numpy takes as much for each text as for the longest
            return None
        try:
            return np.asarray(value)
        except (ValueError, TypeError, OverflowError):
            return None
    return None


def _extent(value: Any) -> tuple[int, int]:
    """How many values a nested list holds, and the length of its longest text."""
    if isinstance(value, (list, tuple)):
        parts = [_extent(entry) for entry in value]
        return sum(count for count, _ in parts), max((longest for _, longest in parts), default=0)
    return 1, len(value) if isinstance(value, (str, bytes)) else 0
