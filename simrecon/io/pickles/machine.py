"""A pickle as a stack machine that makes plain data only (protocols 0 to 5).

It calls nothing but what stands for a name, fills nothing but what stands for an object, and looks up no
attribute. What each instruction does is written in Python's `pickletools`.
"""

from __future__ import annotations

import collections
import io
import pickle  # nosec B403  # its names of instructions and errors; nothing is unpickled
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.io.pickles import torch_files
from simrecon.io.pickles.arrays import Shell, Wrapper, count_of, from_bytes
from simrecon.io.pickles.budget import Budget
from simrecon.io.pickles.instructions import INSTRUCTIONS
from simrecon.io.pickles.names import NAMES, NESTED, Name
from simrecon.io.pickles.stack import Stack
from simrecon.io.pickles.tensors import Storages

_MADE_BYTES = 512
"""Charged for what a name makes, besides the bytes in it."""


class NotAllowedError(Exception):
    """A pickle asks for a name that is not on the list."""


class Machine(Stack):
    """Runs one pickle.

    Args:
        stream: at the start of the pickle; after `run` behind its end.
        budget: shared by all pickles of a file.
        storages: of torch's tensors, which a pickle names by persistent ids; None: it may name none.
    """

    def __init__(self, stream: io.BytesIO, budget: Budget, storages: Storages | None = None) -> None:
        super().__init__(stream, budget)
        self._storages = storages

    def run(self) -> Any:
        """The data of the pickle.

        Raises:
            NotAllowedError: it asks for a name that is not on the list.
            ValueError: and others of `pickles.DAMAGED`: it is no whole pickle of plain data.
        """
        while (code := self.take(1)) != pickle.STOP:
            self.budget.step()
            if code in INSTRUCTIONS:
                INSTRUCTIONS[code](self)
            elif code in _CALLS:
                _CALLS[code](self)
            else:
                raise ValueError(f"an instruction {code!r}")
        return self.pop()

    def name(self, module: str, name: str) -> None:
        """Put what stands for a name on top."""
        known = NAMES.get(f"{module}.{name}")
        if known is None:
            raise NotAllowedError(f"{module}.{name}"[:200])
        self.push(known)

    def call(self) -> None:
        """Call a name with the arguments above it."""
        arguments, function = self.pop(), self.pop()
        if not isinstance(arguments, tuple):
            raise ValueError("arguments that are no tuple")
        if function is NESTED:
            result = self._nested(*arguments)
        elif isinstance(function, Name) and function.make is not None:
            result = function.make(*arguments)
        else:
            raise ValueError(f"a {_noun(function)} is not callable")
        self.budget.charge(_MADE_BYTES + (len(result) if isinstance(result, bytes) else 0))
        self.push(result)

    def call_with_words(self) -> None:
        """Call a name; words with the arguments are refused."""
        if self.pop() != {}:
            raise ValueError("arguments by name")
        self.call()

    def fill(self) -> None:
        """Fill the object below a state; nothing else has one, least of all a function."""
        state, target = self.pop(), self.pop()
        if isinstance(target, collections.OrderedDict):
            self.push(target)  # torch's notes on a module
            return
        if not isinstance(target, Shell):
            raise ValueError(f"a state for a {_noun(target)}")
        target.fill(state)
        if isinstance(target, Wrapper):
            target.value = self._joblib_array(target)
        self.push(target if target.value is None else target.value)

    def persistent(self) -> None:
        """Put a tensor's storage on top."""
        if self._storages is None:
            raise ValueError("a persistent id outside of torch's files")
        self.push(self._storages.get(self.pop()))

    def _nested(self, content: Any) -> Any:
        """A tensor's storage within a plain pickle: a file of torch's old layout, in bytes."""
        if not isinstance(content, bytes):
            raise ValueError("a storage that is no bytes")
        self.budget.charge(2 * len(content))
        return read_legacy(content, self.budget)

    def _joblib_array(self, wrapper: Wrapper) -> NDArray[Any]:
        """The array behind joblib's wrapper: padding and its bytes in the stream, or a pickle of objects."""
        kind, count = wrapper.dtype, count_of(wrapper.shape)
        if kind.hasobject:
            values = Machine(self.stream, self.budget).run()
            if not isinstance(values, np.ndarray):
                raise ValueError("objects that are no array")
            return values
        if wrapper.padded:
            self.take(self.number("B"))
        return from_bytes(self.take(count * kind.itemsize), kind, wrapper.shape, wrapper.order)


def read_legacy(content: bytes, budget: Budget) -> Any:
    """The data in a file of torch's old layout."""
    return torch_files.legacy(content, lambda stream, storages: Machine(stream, budget, storages).run())


def _noun(value: Any) -> str:
    return value.name if isinstance(value, Name) else type(value).__name__


def _by_lines(machine: Machine) -> None:
    module = machine.line().decode("utf-8")
    machine.name(module, machine.line().decode("utf-8"))


def _by_stack(machine: Machine) -> None:
    name, module = machine.pop(), machine.pop()
    if not isinstance(name, str) or not isinstance(module, str):
        raise ValueError("a name that is no text")
    machine.name(module, name)


def _extension(layout: str) -> Callable[[Machine], None]:
    def refuse(machine: Machine) -> None:
        raise NotAllowedError(f"extension {machine.number(layout)}")

    return refuse


_CALLS: dict[bytes, Callable[[Machine], None]] = {
    pickle.GLOBAL: _by_lines,
    pickle.STACK_GLOBAL: _by_stack,
    pickle.REDUCE: Machine.call,
    pickle.NEWOBJ: Machine.call,
    pickle.NEWOBJ_EX: Machine.call_with_words,
    pickle.BUILD: Machine.fill,
    pickle.BINPERSID: Machine.persistent,
    pickle.EXT1: _extension("B"),
    pickle.EXT2: _extension("H"),
    pickle.EXT4: _extension("i"),
}
