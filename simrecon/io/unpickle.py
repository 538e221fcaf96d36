"""Body model files of other projects as plain arrays: `.npz`, and pickles, of which nothing is run.

The unpickler knows numpy's arrays, scipy's sparse matrices and chumpy's variables, as body models are
published with them; the last two are replaced by stand-ins that hold their data. Every other name is refused.
"""

from __future__ import annotations

import io
import pickle
import zipfile
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from scipy.sparse import csc_array, csr_array

from simrecon.errors import InputError

_PICKLES = (".pkl", ".pickle")
_DAMAGED = (
    pickle.UnpicklingError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError,
    OverflowError, MemoryError, RecursionError, UnicodeDecodeError, zipfile.BadZipFile,
)  # fmt: skip


class _Held:
    """Stands for a sparse matrix or a chumpy variable: its state, nothing that could run."""

    def __init__(self, *_given: Any) -> None:
        self.state: dict[str, Any] = {}

    def __setstate__(self, state: Any) -> None:
        if isinstance(state, dict):
            self.state = state


class _HeldRows(_Held):
    """A sparse matrix stored by rows."""


def load(path: Path | str) -> dict[str, Any]:
    """Arrays, numbers and texts of a body model file by key.

    Args:
        path: `.npz`, `.pkl` or `.pickle`.

    Raises:
        InputError: it can't be read, is of another kind, is damaged, or its pickle asks for anything but
        data.
    """
    path = Path(path)
    if path.suffix.lower() not in (".npz", *_PICKLES):
        raise InputError(f"{path}: found a file that ends in {path.suffix!r}; valid: .npz, .pkl")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can't read the body model: {error.strerror}") from error
    try:
        found = _npz(content) if path.suffix.lower() == ".npz" else _Unpickler(path, content).load()
        if not isinstance(found, dict):
            raise ValueError(f"{type(found).__name__} instead of a dictionary")
        return {str(key): _plain(value) for key, value in found.items()}
    except _DAMAGED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: found a damaged file ({reason}); valid: a whole body model") from error


def _npz(content: bytes) -> dict[str, Any]:
    """Arrays of numbers and text; arrays of objects are left out, they would have to be unpickled."""
    found = {}
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        for name in archive.namelist():
            try:
                found[name.removesuffix(".npy")] = np.lib.format.read_array(
                    archive.open(name), allow_pickle=False
                )
            except ValueError as error:
                if "Object arrays" not in str(error):
                    raise
    return found


def _plain(value: Any) -> Any:
    if not isinstance(value, _Held):
        return value
    state = value.state
    if "x" in state:  # chumpy.Ch
        return np.asarray(state["x"], dtype=np.float64)
    try:
        shape = tuple(int(n) for n in state.get("_shape", state.get("shape", ())))
        kind = csr_array if isinstance(value, _HeldRows) else csc_array
        matrix = kind((state["data"], state["indices"], state["indptr"]), shape=shape)
        matrix.check_format(full_check=True)
    except (KeyError, TypeError):
        return None
    return matrix.toarray()


def _reconstructor(kind: Any, _base: Any = object, _state: Any = None) -> Any:
    """copyreg._reconstructor, for stand-ins only."""
    if not (isinstance(kind, type) and issubclass(kind, _Held)):
        raise ValueError("an object of another class")
    return kind()


def _array(_kind: Any, _shape: Any = (0,), _code: Any = b"b") -> Any:
    """numpy.core.multiarray._reconstruct: an empty array, to be filled."""
    return np.ndarray((0,), np.int8)


def _scalar(dtype: Any, data: Any = b"") -> Any:
    if isinstance(data, str):
        data = data.encode("latin-1")
    if not isinstance(dtype, np.dtype) or dtype.hasobject or len(data) != dtype.itemsize:
        raise ValueError("a number of another type")
    return np.frombuffer(data, dtype)[0]


def _dtype(spec: Any, *_flags: Any) -> Any:
    found = np.dtype(spec if isinstance(spec, str) else str(spec, "ascii"))
    if found.hasobject:
        raise ValueError("an array of objects")
    return found


def _encode(text: str, _encoding: str = "latin1") -> bytes:
    return text.encode("latin-1")


_NAMES: dict[str, Any] = {
    "_codecs.encode": _encode,
    "numpy.ndarray": np.ndarray,
    "numpy.dtype": _dtype,
    "copy_reg._reconstructor": _reconstructor,
    "copyreg._reconstructor": _reconstructor,
    "__builtin__.object": object,
    "builtins.object": object,
    "chumpy.ch.Ch": _Held,
}
_NAMES |= {f"numpy.{core}.multiarray._reconstruct": _array for core in ("core", "_core")}
_NAMES |= {f"numpy.{core}.multiarray.scalar": _scalar for core in ("core", "_core")}
for _module in ("csc", "_csc", "csr", "_csr"):
    for _end in ("matrix", "array"):
        _letters = _module.strip("_")
        _NAMES[f"scipy.sparse.{_module}.{_letters}_{_end}"] = _HeldRows if _letters == "csr" else _Held


class _Unpickler(pickle.Unpickler):
    def __init__(self, path: Path, content: bytes) -> None:
        super().__init__(io.BytesIO(content), encoding="latin1")
        self._path = path

    def find_class(self, module: str, name: str) -> Any:
        found = _NAMES.get(f"{module}.{name}")
        if found is None:
            self._refuse(f"{module}.{name}"[:200])
        return found

    def _refuse(self, what: str) -> NoReturn:
        raise InputError(
            f"{self._path}: found {what!r} in the pickle, which is not run; valid: numbers, "
            "text, numpy arrays, scipy's sparse matrices, chumpy's variables"
        )
