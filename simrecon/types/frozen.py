"""Tables that nobody changes: a frozen dataclass that holds one is frozen in depth, and has a hash."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

V = TypeVar("V")


class FrozenMap(Mapping[str, V]):
    """A copy of a mapping, equal to any other with the same items; of its own values, lists become tuples."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, V]) -> None:
        """Copy a mapping, and those inside it."""
        self._items: dict[str, V] = {name: frozen(value) for name, value in items.items()}

    def __getitem__(self, name: str) -> V:
        """The value of a name."""
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        """The names, in the order that they were given in."""
        return iter(self._items)

    def __len__(self) -> int:
        """How many there are."""
        return len(self._items)

    def __hash__(self) -> int:
        """Of the items, in any order.

        Raises:
            TypeError: one of them has no hash.
        """
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        """As a dictionary."""
        return repr(self._items)


def frozen(value: Any) -> Any:
    """A value that can't be changed: of a mapping or list a copy; anything else is what it was."""
    if isinstance(value, Mapping):
        return value if isinstance(value, FrozenMap) else FrozenMap(value)
    return tuple(map(frozen, value)) if isinstance(value, list | tuple) else value
