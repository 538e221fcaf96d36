"""Instructions that make numbers, text, lists and dictionaries, by their codes."""

from __future__ import annotations

import pickle  # nosec B403  # its names of instructions and errors; nothing is unpickled
import re
import struct
from collections.abc import Callable
from typing import Any

from simrecon.io.pickles.stack import Stack

Instruction = Callable[[Stack], None]

_LONGEST_NUMBER = 1024
_PROTOCOL_MAX = 5
_ESCAPE = re.compile(rb"\\(?:x([0-9a-fA-F]{2})|(.?))", re.DOTALL)
_ESCAPED = {b"\\": b"\\", b"'": b"'", b'"': b'"', b"n": b"\n", b"r": b"\r", b"t": b"\t"}


def _push(read: Callable[[Stack], Any]) -> Instruction:
    """The instruction that puts a value on top."""
    return lambda stack: stack.push(read(stack))


def _protocol(stack: Stack) -> None:
    if (protocol := stack.number("B")) > _PROTOCOL_MAX:
        raise ValueError(f"protocol {protocol}")


def _frame(stack: Stack) -> None:
    """How many bytes follow in one piece; they are read one by one here."""
    stack.number("Q")


def _whole_text(stack: Stack) -> int | bool:
    """A number in decimals, with false and true as 00 and 01."""
    line = stack.line()
    if line in (b"00", b"01"):
        return line == b"01"
    return int(line.rstrip(b"L"))


def _whole_bytes(layout: str) -> Callable[[Stack], int]:
    def read(stack: Stack) -> int:
        count = stack.number(layout)
        if not 0 <= count <= _LONGEST_NUMBER:
            raise ValueError(f"a number of {count} bytes")
        return int.from_bytes(stack.take(count), "little", signed=True)

    return read


def _float(stack: Stack) -> float:
    value: float = struct.unpack(">d", stack.take(8))[0]
    return value


def _data(layout: str) -> Callable[[Stack], bytes]:
    """Bytes behind their count."""

    def read(stack: Stack) -> bytes:
        count = stack.number(layout)
        if count < 0:
            raise ValueError(f"{count} bytes")
        return stack.take(count)

    return read


def _text(layout: str, encoding: str) -> Callable[[Stack], str]:
    """Text behind its count; that of Python 2 is taken for Latin-1."""
    read, errors = _data(layout), "surrogatepass" if encoding == "utf-8" else "strict"
    return lambda stack: read(stack).decode(encoding, errors)


def _quoted(stack: Stack) -> str:
    """Text of Python 2 as its source would have it."""
    line = stack.line()
    if len(line) < 2 or line[:1] != line[-1:] or line[:1] not in (b"'", b'"'):
        raise ValueError("text without quotes")
    return _ESCAPE.sub(_unescaped, line[1:-1]).decode("latin-1")


def _unescaped(match: re.Match[bytes]) -> bytes:
    return bytes.fromhex(match[1].decode()) if match[1] else _ESCAPED[match[2]]


def _tuple(count: int) -> Instruction:
    def make(stack: Stack) -> None:
        stack.push(tuple([stack.pop() for _ in range(count)][::-1]))

    return make


def _set_item(stack: Stack) -> None:
    value, key = stack.pop(), stack.pop()
    stack.set_items([key, value])


def _dict(stack: Stack) -> None:
    values = stack.unmark()
    stack.push({})
    stack.set_items(values)


def _append(stack: Stack) -> None:
    value = stack.pop()
    stack.append([value])


INSTRUCTIONS: dict[bytes, Instruction] = {
    pickle.PROTO: _protocol,
    pickle.FRAME: _frame,
    pickle.NONE: _push(lambda _: None),
    pickle.NEWTRUE: _push(lambda _: True),
    pickle.NEWFALSE: _push(lambda _: False),
    pickle.INT: _push(_whole_text),
    pickle.LONG: _push(_whole_text),
    pickle.BININT: _push(lambda stack: stack.number("i")),
    pickle.BININT1: _push(lambda stack: stack.number("B")),
    pickle.BININT2: _push(lambda stack: stack.number("H")),
    pickle.LONG1: _push(_whole_bytes("B")),
    pickle.LONG4: _push(_whole_bytes("i")),
    pickle.FLOAT: _push(lambda stack: float(stack.line())),
    pickle.BINFLOAT: _push(_float),
    pickle.STRING: _push(_quoted),
    pickle.SHORT_BINSTRING: _push(_text("B", "latin-1")),
    pickle.BINSTRING: _push(_text("i", "latin-1")),
    pickle.UNICODE: _push(lambda stack: stack.line().decode("raw-unicode-escape")),
    pickle.SHORT_BINUNICODE: _push(_text("B", "utf-8")),
    pickle.BINUNICODE: _push(_text("I", "utf-8")),
    pickle.BINUNICODE8: _push(_text("Q", "utf-8")),
    pickle.SHORT_BINBYTES: _push(_data("B")),
    pickle.BINBYTES: _push(_data("I")),
    pickle.BINBYTES8: _push(_data("Q")),
    pickle.BYTEARRAY8: _push(_data("Q")),
    pickle.READONLY_BUFFER: lambda _: None,
    pickle.EMPTY_TUPLE: _push(lambda _: ()),
    pickle.EMPTY_LIST: _push(lambda _: []),
    pickle.EMPTY_DICT: _push(lambda _: {}),
    pickle.EMPTY_SET: _push(lambda _: set()),
    pickle.TUPLE1: _tuple(1),
    pickle.TUPLE2: _tuple(2),
    pickle.TUPLE3: _tuple(3),
    pickle.TUPLE: _push(lambda stack: tuple(stack.unmark())),
    pickle.LIST: _push(lambda stack: stack.unmark()),
    pickle.DICT: _dict,
    pickle.FROZENSET: _push(lambda stack: frozenset(map(stack.key, stack.unmark()))),
    pickle.APPEND: _append,
    pickle.APPENDS: lambda stack: stack.append(stack.unmark()),
    pickle.SETITEM: _set_item,
    pickle.SETITEMS: lambda stack: stack.set_items(stack.unmark()),
    pickle.ADDITEMS: lambda stack: stack.add(stack.unmark()),
    pickle.MARK: lambda stack: stack.mark(),
    pickle.POP: lambda stack: stack.pop_or_unmark(),
    pickle.POP_MARK: lambda stack: stack.drop(),
    pickle.DUP: _push(lambda stack: stack.top),
    pickle.PUT: lambda stack: stack.remember(int(stack.line())),
    pickle.BINPUT: lambda stack: stack.remember(stack.number("B")),
    pickle.LONG_BINPUT: lambda stack: stack.remember(stack.number("I")),
    pickle.MEMOIZE: lambda stack: stack.remember(),
    pickle.GET: lambda stack: stack.recall(int(stack.line())),
    pickle.BINGET: lambda stack: stack.recall(stack.number("B")),
    pickle.LONG_BINGET: lambda stack: stack.recall(stack.number("I")),
}
