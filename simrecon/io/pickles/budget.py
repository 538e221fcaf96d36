"""How much one pickle may take, while it is read and when it is walked along afterwards."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from simrecon.io.limits import MAX_BYTES, size_text
from simrecon.io.pickles.arrays import Dtype, Held, Shell

MAX_INSTRUCTIONS = 20_000_000
MAX_ITEMS = 20_000_000
MAX_DEPTH = 100
_FEW_ITEMS, _ITEMS_PER_BYTE = 1_000_000, 10
_CONTAINERS = (list, tuple, dict, set, frozenset, np.ndarray, Shell)


class Budget:
    """Instructions and memory that are left for one file, with all pickles inside it."""

    def __init__(self, memory: int = MAX_BYTES) -> None:
        """Begin with so many bytes."""
        self._instructions = MAX_INSTRUCTIONS
        self._memory = self._most = memory

    def step(self) -> None:
        """Count an instruction.

        Raises:
            ValueError: there were too many.
        """
        self._instructions -= 1
        if self._instructions < 0:
            raise ValueError(f"more than {MAX_INSTRUCTIONS} instructions")

    def charge(self, size: int) -> None:
        """Count bytes that are made, beyond those that the file holds.

        Raises:
            ValueError: there were too many.
        """
        self._memory -= size
        if self._memory < 0:
            raise ValueError(f"it makes more than {size_text(self._most)}")


def check_tree(tree: Any, size: int = MAX_BYTES) -> None:
    """Check that what was read can be walked along: it ends, and soon, however often a part is named.

    Args:
        tree: that was read.
        size: bytes of its file, by which the number of items is limited.

    Raises:
        ValueError: a part holds itself, is nested too deeply, was never filled, or all is too large.
    """
    most = min(_FEW_ITEMS + _ITEMS_PER_BYTE * size, MAX_ITEMS)
    sizes: dict[int, tuple[int, int, int]] = {}
    path: set[int] = set()
    stack = [(tree, False)]
    while stack:
        node, is_left = stack.pop()
        if is_left:
            path.discard(id(node))
            sizes[id(node)] = _size(node, sizes, most)
        elif id(node) in path:
            raise ValueError("a part that holds itself")
        elif isinstance(node, _CONTAINERS) and id(node) not in sizes:
            path.add(id(node))
            stack.append((node, True))
            stack.extend((child, False) for child in _children(node) if isinstance(child, _CONTAINERS))


def _size(node: Any, sizes: dict[int, tuple[int, int, int]], most: int) -> tuple[int, int, int]:
    """Items, bytes of arrays and depth of a part whose children are measured."""
    items, count, depth = 1, 0, 0
    if isinstance(node, np.ndarray) and not node.dtype.hasobject:
        return 1, node.size * node.itemsize, 0
    for child in _children(node):
        more, size, below = sizes.get(id(child), (1, 0, 0)) if isinstance(child, _CONTAINERS) else (1, 0, 0)
        items, count, depth = items + more, count + size, max(depth, below)
    if items > most:
        raise ValueError(f"more than {most} items, those named again counted again")
    if count > 2 * MAX_BYTES:
        raise ValueError(f"more than {size_text(2 * MAX_BYTES)} of arrays, those named again counted again")
    if depth >= MAX_DEPTH:
        raise ValueError(f"nested more than {MAX_DEPTH} deep")
    return items, count, depth + 1


def _children(node: Any) -> Iterable[Any]:
    if isinstance(node, dict):
        return node.values()
    if isinstance(node, np.ndarray):
        return node.ravel(order="K").tolist() if node.dtype.hasobject else ()
    if isinstance(node, Dtype):
        return ()
    if isinstance(node, Held):
        return node.state.values()
    if isinstance(node, Shell):
        raise ValueError(f"{node.noun} that was never filled")
    result: Iterable[Any] = node
    return result
