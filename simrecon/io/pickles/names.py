"""The names that a pickle may use, and what stands for each."""

from __future__ import annotations

import collections
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from simrecon.io.pickles import arrays, tensors


@dataclass(frozen=True, eq=False)
class Name:
    """What stands for a name: it has no attribute that a pickle could reach, and no state.

    Attributes:
        name: with its module.
        make: called with the arguments of the pickle, which it checks; None: the name can't be called.
        value: for our own functions that are given the name.
    """

    name: str
    make: Callable[..., Any] | None = None
    value: Any = None


def _reconstruct(_subtype: Any, _shape: Any, _typecode: Any) -> arrays.ArrayShell:
    return arrays.ArrayShell()


def _reconstructor(kind: Any, _base: Any = None, _state: Any = None) -> arrays.Held:
    """`copyreg._reconstructor`, for those who hold arrays only."""
    holder = kind.value if isinstance(kind, Name) else None
    if not isinstance(holder, type) or not issubclass(holder, arrays.Held):
        raise ValueError("an object of another class")
    return holder()


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    """How protocol 2 writes bytes."""
    if encoding not in ("latin1", "latin-1") or not isinstance(text, str):
        raise ValueError(f"text in {arrays.brief(encoding)}")
    return text.encode("latin-1")


def _dictionary(*_factory: Any) -> dict[Any, Any]:
    """A defaultdict as a plain dictionary: a missing key is an error here."""
    return {}


def _empty(kind: type[Any]) -> Callable[..., Any]:
    def make(*arguments: Any) -> Any:
        if arguments:
            raise ValueError(f"a {kind.__name__} made of other data")
        return kind()

    return make


def _names() -> dict[str, Name]:
    makers: dict[str, Callable[..., Any] | None] = {
        "collections.OrderedDict": _empty(collections.OrderedDict),
        "collections.defaultdict": _dictionary,
        "_codecs.encode": _encode,
        "numpy.ndarray": None,
        "numpy.dtype": arrays.Dtype,
        "joblib.numpy_pickle.NumpyArrayWrapper": arrays.Wrapper,
        "torch.storage._load_from_bytes": None,
        **tensors.MAKERS,
    }
    for module in ("builtins", "__builtin__"):
        makers |= {f"{module}.{kind.__name__}": _empty(kind) for kind in (dict, list, bytes, int, float)}
        makers[f"{module}.object"] = None
    for module in ("copyreg", "copy_reg"):
        makers[f"{module}._reconstructor"] = _reconstructor
    for core in ("core", "_core"):
        makers[f"numpy.{core}.multiarray._reconstruct"] = _reconstruct
        makers[f"numpy.{core}.multiarray.scalar"] = arrays.scalar
        makers[f"numpy.{core}.numeric._frombuffer"] = arrays.from_buffer
    names = {name: Name(name, make) for name, make in makers.items()}
    names |= {name: Name(name, None, value) for name, value in tensors.TYPES.items()}
    return names | {name: Name(name, kind, kind) for name, kind in _holders().items()}


def _holders() -> dict[str, type[arrays.Held]]:
    holders: dict[str, type[arrays.Held]] = {"chumpy.ch.Ch": arrays.Variable}
    for letters, kind in (("csc", arrays.Sparse), ("csr", arrays.SparseRows)):
        for module in (letters, f"_{letters}"):
            for end in ("matrix", "array"):
                holders[f"scipy.sparse.{module}.{letters}_{end}"] = kind
    return holders


NAMES = _names()
"""All that a pickle may name."""
NESTED = NAMES["torch.storage._load_from_bytes"]
"""A tensor's storage within a plain pickle; the machine reads it."""
