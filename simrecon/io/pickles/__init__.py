"""Pickles read without running anything that they ask for.

A pickle is a program that may call any function. This machine knows the instructions that plain data need,
and a short list of names: those that numpy, scipy, joblib, torch, chumpy and `collections` write for plain
data. Each name stands for a function of ours that checks its arguments; every other name is refused. None of
the libraries is asked to build anything from a pickle, and torch, joblib and chumpy need not be there.

machine      runs a pickle: names, calls, states; instructions: all others; stack: what they work on
names        the names, and what stands for each
arrays       numpy's arrays, and those who hold them
tensors      torch's; torch_files: the files of torch.save
budget       how much one file may take
"""

from __future__ import annotations

import io
import pickle  # nosec B403  # its names of instructions and errors; nothing is unpickled
import struct
from collections.abc import Callable
from typing import Any

from simrecon.errors import InputError
from simrecon.io.limits import allowed
from simrecon.io.pickles.budget import Budget, check_tree
from simrecon.io.pickles.machine import Machine, NotAllowedError, read_legacy
from simrecon.io.pickles.tensors import Storages

__all__ = ["DAMAGED", "VALID", "loads", "loads_legacy"]

VALID = (
    "numbers, text, lists, dictionaries, numpy arrays, torch tensors, "
    "scipy's sparse matrices, chumpy's variables"
)
"""What a pickle may hold, for messages."""
DAMAGED = (
    pickle.UnpicklingError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError,
    OverflowError, MemoryError, RecursionError, UnicodeDecodeError, NotImplementedError, struct.error,
)  # fmt: skip
"""What reading damaged content may raise."""


def loads(source: str, content: bytes, storages: Storages | None = None) -> Any:
    """The plain data in a pickle.

    Args:
        source: name of the file, for messages.
        content: the pickle, decompressed; joblib's arrays within it too.
        storages: gives the bytes of tensors by key, for torch's files.

    Returns:
        Numbers, text, bytes, lists, tuples, sets, dictionaries, arrays that can't be written to, and
        `arrays.Sparse` and `arrays.Variable`. No list holds itself, and whoever walks along all of them
        comes to an end soon.

    Raises:
        InputError: damaged, too large, or it asks for a name that is not on the list, which the message
            gives.
    """
    size = len(content)
    return _guarded(
        source, "pickle", size, lambda budget: Machine(io.BytesIO(content), budget, storages).run()
    )


def loads_legacy(source: str, content: bytes) -> Any:
    """The plain data in a file of torch's layout before 1.6; see `loads`."""
    return _guarded(source, "torch file", len(content), lambda budget: read_legacy(content, budget))


def _guarded(source: str, noun: str, size: int, read: Callable[[Budget], Any]) -> Any:
    try:
        tree = read(Budget(allowed(size)))
        check_tree(tree, size)
    except NotAllowedError as error:
        raise InputError(
            f"{source}: found {str(error)!r} in the pickle, which is not run; valid: {VALID}"
        ) from error
    except DAMAGED as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(f"{source}: found a damaged {noun} ({reason}); valid: a whole file") from error
    return tree
