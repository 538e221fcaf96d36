"""What stands in a message, whatever file it is from."""

from __future__ import annotations

import os
import pickle

from simrecon.errors import InputError, SimreconError, printable


def test_a_message_is_one_line_without_control_characters() -> None:
    said = str(InputError("a\x1b]0;title\x07b\nc\u2028d\u202ee" + os.fsdecode(b"caf\xe9")))
    assert said == r"a\x1b]0;title\x07b\nc\u2028d\u202eecaf\udce9"
    assert said.isprintable()


def test_a_message_is_not_endless() -> None:
    assert len(str(SimreconError("x" * 100_000))) < 4000


def test_what_can_be_printed_stays() -> None:
    assert printable("ü 日本 ½ a  b") == "ü 日本 ½ a  b"
    assert str(pickle.loads(pickle.dumps(InputError("a\tb")))) == r"a\tb"
