"""Body model files of other projects as plain arrays: `.npz`, and pickles, of which nothing is run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.io import pickles
from simrecon.io.limits import size_text
from simrecon.io.npz import parse_npz
from simrecon.io.pickles.arrays import Held, Sparse, SparseRows, Variable
from simrecon.io.reading import read_bytes

_PICKLES = (".pkl", ".pickle")
_DENSE_MAX_BYTES = 1 << 30


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
        content = read_bytes(path)
    except OSError as error:
        raise InputError(f"{path}: cannot read the body model: {error.strerror}") from error
    try:
        if path.suffix.lower() == ".npz":
            return _npz(str(path), content)
        tree = pickles.loads(str(path), content)
        if not isinstance(tree, dict):
            raise ValueError(f"{type(tree).__name__} instead of a dictionary")
        return _dense(tree)
    except pickles.DAMAGED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: found a damaged file ({reason}); valid: a whole body model") from error


def _npz(source: str, content: bytes) -> dict[str, Any]:
    """Arrays of numbers and text; arrays of objects are left out, they would have to be unpickled."""
    arrays = parse_npz(source, content, objects=lambda *_: np.empty(0, object)).content
    return {key: array for key, array in arrays.items() if not array.dtype.hasobject}


def _dense(tree: dict[Any, Any]) -> dict[str, Any]:
    """The values by key, with arrays in the place of those who hold some; what holds none is None."""
    dense: dict[int, Any] = {}
    left = _DENSE_MAX_BYTES
    for value in tree.values():
        if isinstance(value, Held) and id(value) not in dense:
            array = _array(value, left)
            dense[id(value)] = array
            left -= 0 if array is None else array.nbytes
    return {str(key): dense.get(id(value), value) for key, value in tree.items()}


def _array(value: Held, left: int) -> NDArray[Any] | None:
    state = value.state
    if isinstance(value, Variable):
        return np.asarray(state["x"], dtype=np.float64) if "x" in state else None
    if not isinstance(value, Sparse):
        return None
    try:
        shape = tuple(int(n) for n in state.get("_shape", state.get("shape", ())))
        kind = scipy.sparse.csr_array if isinstance(value, SparseRows) else scipy.sparse.csc_array
        matrix = kind((state["data"], state["indices"], state["indptr"]), shape=shape)
    except (KeyError, TypeError):
        return None
    matrix.check_format(full_check=True)
    if math.prod(shape) * matrix.dtype.itemsize > left:
        raise ValueError(f"sparse matrices of more than {size_text(_DENSE_MAX_BYTES)}")
    values: NDArray[Any] = matrix.toarray()
    return values
