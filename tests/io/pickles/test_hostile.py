"""Pickles that ask for more than plain data get nothing, and get it soon."""

from __future__ import annotations

import inspect
import pickle
import struct
import time
from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.io import pickles
from simrecon.io.limits import MAX_BYTES
from simrecon.io.pickles import arrays, budget, machine, names
from simrecon.io.pickles.names import NAMES, Name

RECONSTRUCT = b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85C\x01b\x87R"


def dtype(spec: bytes, order: bytes = b"<") -> bytes:
    """Program of a type."""
    return (
        b"cnumpy\ndtype\nX" + struct.pack("<I", len(spec)) + spec + b"\x89\x88\x87R"
        b"(K\x03X\x01\x00\x00\x00" + order + b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb"
    )  # fmt: skip


def array(shape: bytes, kind: bytes, data: bytes) -> bytes:
    """Program of an array; shape and data are programs too."""
    return RECONSTRUCT + b"(K\x01" + shape + kind + b"\x89" + data + b"tb"


def refused(content: bytes) -> str:
    """The message about a program; it must come within a second."""
    began = time.process_time()
    with pytest.raises(InputError) as caught:
        pickles.loads("a.pkl", content)
    assert time.process_time() - began < 1.0
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400
    return str(caught.value)


# --- Names


@pytest.mark.parametrize("name", NAMES)
def test_every_name_is_one_of_our_stand_ins(name: str) -> None:
    entry = NAMES[name]
    assert type(entry) is Name
    assert entry.name == name
    assert (
        pickles.loads(
            "a", b"c" + name.rpartition(".")[0].encode() + b"\n" + name.rpartition(".")[2].encode() + b"\n."
        )
        is entry
    )
    for stand_in in (entry.make, entry.value):
        assert stand_in is None or stand_in.__module__.startswith("simrecon.io.pickles.")
        assert not isinstance(stand_in, type) or issubclass(stand_in, arrays.Shell)
    if inspect.isfunction(entry.make):
        assert Path(inspect.getfile(entry.make)).parent == Path(pickles.__file__).parent


def test_only_what_stands_for_a_name_is_called() -> None:
    """The one call of the machine whose function the pickle chooses is that of a `Name`."""
    source = inspect.getsource(machine.Machine)
    assert source.count("function.make(") == 1
    assert "getattr" not in source + inspect.getsource(names)
    assert "setattr" not in source


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("numpy", "ndarray.data"),
        ("numpy", "fromfile"),
        ("numpy", "memmap"),
        ("numpy.core.multiarray", "fromstring"),
        ("numpy.lib.npyio", "load"),
        ("builtins", "getattr"),
        ("builtins", "object.__class__"),
        ("os", "system"),
        ("simrecon.io.pickles.machine", "Machine"),
        ("scipy.sparse.csr", "csr_matrix.toarray"),
        ("torch.storage", "_load_from_bytes.__globals__"),
    ],
)
def test_other_names_are_refused(module: str, name: str) -> None:
    words = [b"\x8c" + bytes([len(word)]) + word.encode() for word in (module, name)]
    message = refused(b"\x80\x04" + b"".join(words) + b"\x93.")
    assert f"found '{module}.{name}' in the pickle, which is not run; valid: numbers, text" in message


# --- Gadgets

STATE = b"}X\x01\x00\x00\x00aK\x01s"
PROGRAMS = {
    "attributes of a function": (b"c_codecs\nencode\n" + STATE + b"b.", "a state for a _codecs.encode"),
    "attributes of a class": (b"cnumpy\nndarray\n" + STATE + b"b.", "a state for a numpy.ndarray"),
    "attributes by slots": (b"cnumpy\ndtype\nN" + STATE + b"\x86b.", "a state for a numpy.dtype"),
    "a state of a list": (b"]" + STATE + b"b.", "a state for a list"),
    "a state of an array": (
        array(b"K\x00\x85", dtype(b"f8"), b"C\x00") + STATE + b"b.",
        "a state for a ndarray",
    ),
    "a state without a type": (RECONSTRUCT + b"(K\x01K\x00\x85NNC\x00tb.", "an array without a type"),
    "a type that is a word": (RECONSTRUCT + b"(K\x01K\x01\x85X\x01\x00\x00\x00O\x89]tb.", "without a type"),
    "pointers out of bytes": (
        array(b"K\x01\x85", dtype(b"O"), b"C\x08AAAAAAAA") + b".",
        "other than 1 objects",
    ),
    "pointers out of a buffer": (
        b"cnumpy.core.numeric\n_frombuffer\n(C\x08AAAAAAAA" + dtype(b"O") + b"K\x01\x85X\x01\x00\x00\x00CtR.",
        "1,) and object in 8 bytes",
    ),
    "a pointer as a number": (
        b"cnumpy.core.multiarray\nscalar\n" + dtype(b"O") + b"C\x08AAAAAAAA\x86R.",
        "and object in 8 bytes",
    ),
    "fewer objects than there are": (array(b"K\x02\x85", dtype(b"O"), b"]") + b".", "other than 2 objects"),
    "pointers among fields": (
        array(b"K\x01\x85", dtype(b"f8,O"), b"C\x10" + b"A" * 16) + b".",
        "type 'f8,O'",
    ),
    "a type with fields": (b"cnumpy\ndtype\nX\x02\x00\x00\x00V8\x89\x88\x87R.", "elements of type 'V8'"),
    "a type that becomes one with fields": (
        b"cnumpy\ndtype\nX\x02\x00\x00\x00f8\x89\x88\x87R(K\x03X\x01\x00\x00\x00<NX\x01\x00\x00\x00a\x85}K\x08K\x08K\x00tb.",
        "elements with fields",
    ),
    "more bytes than there are": (array(b"K\x7f\x85", dtype(b"f8"), b"C\x08AAAAAAAA") + b".", "in 8 bytes"),
    "a negative size": (array(b"J\xff\xff\xff\xff\x85", dtype(b"f8"), b"C\x08AAAAAAAA") + b".", "(-1,)"),
    "sizes that overflow": (
        array(b"\x8a\x09" + (1 << 65).to_bytes(9, "little") + b"K\x00\x86", dtype(b"f8"), b"C\x00") + b".",
        "damaged",
    ),
    "a size that is true": (array(b"\x88\x85", dtype(b"f8"), b"C\x08AAAAAAAA") + b".", "whose shape is"),
    "elements of no size": (
        array(b"J\x00\x00\x00\x7f\x85", dtype(b"S0"), b"C\x00") + b".",
        "elements of no size",
    ),
    "an array that is never filled": (RECONSTRUCT + b".", "an array that was never filled"),
    "an array that is shown before": (
        b"]" + RECONSTRUCT + b"q\x00ah\x00(K\x01K\x01\x85" + dtype(b"f8") + b"\x89C\x08AAAAAAAAtb0.",
        "an array that was never filled",
    ),
    "an array that holds itself": (
        RECONSTRUCT + b"q\x00(K\x01K\x01\x85" + dtype(b"O") + b"\x89]h\x00atb.",
        "never filled",
    ),
    "a character that there is not": (
        array(b"K\x01\x85", dtype(b"U1"), b"C\x04\xff\xff\xff\x7f") + b".",
        "character of number 2147483647",
    ),
    "a class of another module": (
        b"ccopyreg\n_reconstructor\ncnumpy\ndtype\nc__builtin__\nobject\nN\x87R.",
        "another class",
    ),
    "an object made of nothing": (b"cbuiltins\nobject\n)\x81.", "is not callable"),
    "a word that is called": (b"X\x01\x00\x00\x00a)R.", "a str is not callable"),
    "arguments that are no tuple": (b"c_codecs\nencode\n]R.", "arguments that are no tuple"),
    "arguments by name": (b"c_codecs\nencode\n)" + STATE + b"\x92.", "arguments by name"),
    "an instance": (b"(inumpy\ndtype\n.", "an instruction"),
    "an object of a mark": (b"(cnumpy\ndtype\no.", "an instruction"),
    "a buffer from outside": (b"\x80\x05\x97.", "an instruction"),
    "a persistent id": (b"K\x01Q.", "persistent id outside of torch"),
    "a persistent id of text": (b"Pstorage\n.", "an instruction"),
    "an extension": (b"\x82\x01.", "found 'extension 1'"),
    "another protocol": (b"\x80\x06N.", "protocol 6"),
    "a stack with nothing on it": (b"\x80\x02.", "damaged"),
    "a mark that is not there": (b"t.", "damaged"),
    "nothing kept there": (b"h\x07.", "damaged"),
    "values for a tuple": (b")K\x01a.", "values for a tuple"),
    "values for an array": (array(b"K\x00\x85", dtype(b"f8"), b"C\x00") + b"K\x01a.", "values for a ndarray"),
    "a key without a value": (b"}(K\x01u.", "items for a dict"),
    "a number of 5000 digits": (b"I" + b"1" * 5000 + b"\n.", "damaged"),
    "a number of 2 GB": (b"\x8b\x00\x00\x00\x7f.", "a number of 2130706432 bytes"),
    "text of Python 2 with a name in it": (b"S'\\N{DIGIT ONE}'\n.", "damaged"),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_are_refused(name: str) -> None:
    content, words = PROGRAMS[name]
    assert words in refused(content)


def test_the_programs_are_well_written() -> None:
    """Beside the refused ones, the same pieces make an array."""
    content = array(b"K\x02\x85", dtype(b"f8", b">"), b"C\x10" + np.array([1.0, 2.0], ">f8").tobytes()) + b"."
    np.testing.assert_array_equal(pickles.loads("a", content), [1.0, 2.0])
    objects = array(b"K\x01\x85", dtype(b"O"), b"]K\x05a") + b"."
    assert pickles.loads("a", objects).tolist() == [5]


def test_names_have_no_state_that_stays() -> None:
    before = {name: (entry.make, entry.value, vars(entry).copy()) for name, entry in NAMES.items()}
    for module, name in (key.rsplit(".", 1) for key in NAMES):
        refused(f"c{module}\n{name}\n".encode() + STATE + b"b.")
    assert {name: (entry.make, entry.value, vars(entry)) for name, entry in NAMES.items()} == before


def test_what_was_read_can_not_be_written_to() -> None:
    values = pickles.loads("a", pickle.dumps(np.arange(3.0)))
    with pytest.raises(ValueError, match="read-only"):
        values[0] = 1.0


# --- Bounds


MEGABYTE = array(b"J\x00\x00\x10\x00\x85", dtype(b"u1"), b"B\x00\x00\x10\x00" + bytes(1 << 20))


def tower(height: int, leaf: bytes = b"]K\x01a", wide: int = 9) -> bytes:
    """A list of nine lists of nine lists …: small in the file, wide**height when walked along."""
    content = leaf + b"q\x00"
    for i in range(height):
        content += b"0]q" + bytes([i + 1]) + (b"h" + bytes([i]) + b"a") * wide
    return content


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"]q\x00h\x00a.", "a part that holds itself"),
        (b"}q\x00X\x01\x00\x00\x00ah\x00s.", "a part that holds itself"),
        (b"]q\x00h\x00\x85a.", "a part that holds itself"),
        (b"ccollections\nOrderedDict\n)Rq\x00K\x01h\x00s.", "a part that holds itself"),
        (b"cchumpy.ch\nCh\n)\x81q\x00}X\x01\x00\x00\x00xh\x00sb.", "a part that holds itself"),
        (tower(12) + b".", "items, those named again"),
        (b"}X\x01\x00\x00\x00a" + tower(11) + b"s.", "items, those named again"),
        (b"]" * 200 + b"a" * 199 + b".", "nested more than 100 deep"),
        (b"]" * 100_000 + b"a" * 99_999 + b".", "nested more than 100 deep"),
        (tower(4, MEGABYTE) + b".", "of arrays"),
        (b"}" + tower(30) + b"\x85K\x01s.", "a list as a key"),
        (b"})q\x00" + b"0h\x00h\x00\x86q\x00" * 40 + b"K\x01s.", "a tuple as a key"),
        (b"\x8f(" + tower(30) + b"\x90.", "a list as a key"),
        (b"}\x8a\x09" + (1 << 70).to_bytes(9, "little") + b"K\x01s.", "a int as a key"),
    ],
)
def test_what_has_no_end_is_refused_soon(content: bytes, words: str) -> None:
    assert words in refused(content)


@pytest.mark.parametrize(
    "place",
    [
        b"cnumpy\ndtype\n%s\x85R.",
        b"c_codecs\nencode\nX\x00\x00\x00\x00%s\x86R.",
        RECONSTRUCT + b"(K\x01%s\x85" + dtype(b"f8") + b"\x89C\x00tb.",
        RECONSTRUCT + b"(K\x01%s" + dtype(b"f8") + b"\x89C\x00tb.",
        b"ctorch._utils\n_rebuild_tensor_v2\n(NK\x00%sK\x01\x85tR.",
        b"%s)R.",
        b"cnumpy\nndarray\n%sR.",
        b"c_codecs\nencode\n)%s\x92.",
        b"%sN\x93.",
        b"%s%sb.",
    ],
)
def test_messages_do_not_walk_along_it(place: bytes) -> None:
    refused(place.replace(b"%s", tower(30)))


def test_instructions_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "MAX_INSTRUCTIONS", 1000)
    assert pickles.loads("a", b"]" + b"(e" * 499 + b".") == []
    assert "more than 1000 instructions" in refused(b"]" + b"(e" * 500 + b".")


def test_what_names_make_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pickles, "allowed", lambda _: 10_000)
    once = b"cbuiltins\ndict\n)R0"
    assert pickles.loads("a", once * 19 + b"N.") is None
    assert "makes more than 10 kB" in refused(once * 20 + b"N.")


def test_pickles_in_a_pickle_share_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "MAX_INSTRUCTIONS", 2000)
    inner = b"(e" * 300
    inner = b"\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.N.N.]" + inner + b".]."
    nested = b"ctorch.storage\n_load_from_bytes\nB" + struct.pack("<I", len(inner)) + inner + b"\x85R"
    assert pickles.loads("a", nested + b".") == []
    assert "more than 2000 instructions" in refused(nested + b"0" + nested + b".")


def test_keys_that_share_a_place_are_refused() -> None:
    """Whole numbers of one hash would take the square of their count."""
    prime = 2**61 - 1
    numbers = b"".join(
        b"\x8a\x0c" + (i * prime).to_bytes(12, "little", signed=True) + b"N" for i in range(1, 9)
    )
    assert "as a key" in refused(b"}(" + numbers + b"u.")


def test_a_claim_of_much_memory_is_no_memory() -> None:
    for count in (MAX_BYTES, 1 << 40, 1 << 62, (1 << 64) - 1):
        for code in (b"\x8e", b"\x8d", b"\x96"):
            assert "ends too early" in refused(code + count.to_bytes(8, "little") + b"ab.")
