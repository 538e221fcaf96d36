"""Plain data come out of a pickle as they went in."""

from __future__ import annotations

import collections
import pickle
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from simrecon.errors import InputError
from simrecon.io import pickles

PROTOCOLS = st.integers(0, pickle.HIGHEST_PROTOCOL)
SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | st.binary()
)  # fmt: skip
KEYS = st.text() | st.integers(-(2**60), 2**60) | st.tuples(st.integers(0, 9), st.text())
DATA = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner) | st.dictionaries(KEYS, inner) | st.lists(inner).map(tuple),
    max_leaves=20,
)
DTYPES = (
    arrays.boolean_dtypes()
    | arrays.integer_dtypes(endianness="?")
    | arrays.unsigned_integer_dtypes(endianness="?")
    | arrays.floating_dtypes(endianness="?", sizes=(16, 32, 64))
    | arrays.complex_number_dtypes(endianness="?", sizes=(64, 128))
    | arrays.unicode_string_dtypes(endianness="?")
    | arrays.byte_string_dtypes()
)
ARRAYS = DTYPES.flatmap(lambda dtype: arrays.arrays(dtype, arrays.array_shapes(min_dims=0, min_side=0)))


@given(DATA, PROTOCOLS)
def test_plain_data(data: Any, protocol: int) -> None:
    assert pickles.loads("a", pickle.dumps(data, protocol)) == data


@given(st.sets(KEYS), st.frozensets(KEYS), st.integers(4, 5))
def test_sets(first: set[Any], second: frozenset[Any], protocol: int) -> None:
    assert pickles.loads("a", pickle.dumps([first, second], protocol)) == [first, second]


@given(ARRAYS, PROTOCOLS, st.booleans())
def test_arrays(array: np.ndarray, protocol: int, transposed: bool) -> None:
    array = array.T if transposed else array
    (values, again) = pickles.loads("a", pickle.dumps([array, array], protocol))
    assert values is again
    assert values.shape == array.shape
    assert values.dtype.newbyteorder("=") == array.dtype.newbyteorder("=")
    np.testing.assert_array_equal(values, array)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_axes_in_any_order(protocol: int) -> None:
    array = np.arange(24.0).reshape(2, 3, 4).transpose(1, 0, 2)
    values = pickles.loads("a", pickle.dumps(array, protocol))
    np.testing.assert_array_equal(values, array)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_numbers_of_numpy(protocol: int) -> None:
    data = [np.float32(2.5), np.int64(-3), np.bool_(True), np.str_("ü"), np.str_(""), np.bytes_(b"")]
    values = pickles.loads("a", pickle.dumps(data, protocol))
    assert values == data
    assert [type(value) for value in values] == [type(value) for value in data]


def test_keys_of_numpy() -> None:
    data = {np.int64(3): 1, np.str_("a"): 2, (np.int64(1), "x"): 3}
    assert pickles.loads("a", pickle.dumps(data)) == data


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_arrays_of_objects(protocol: int) -> None:
    array = np.empty((2, 2), object)
    array[:] = [[1, "a"], [None, [1, 2]]]
    for order in (array, array.T):
        values = pickles.loads("a", pickle.dumps(order, protocol))
        assert values.dtype == object
        assert values.tolist() == order.tolist()


def test_dictionaries_of_collections() -> None:
    data = [collections.OrderedDict(z=1, a=2), collections.defaultdict(list, {"x": [1]})]
    values = pickles.loads("a", pickle.dumps(data))
    assert values == data
    assert list(values[0]) == ["z", "a"]
    assert type(values[1]) is dict


def test_text_of_python_2() -> None:
    """Written by Python 2.7 as pickle.dumps({'a': 'caf\\xe9\\n', 'b': ['\\'', 7L]}, 0)."""
    content = b"(dp0\nS'a'\np1\nS'caf\\xe9\\n'\np2\nsS'b'\np3\n(lp4\nS\"'\"\np5\naL7L\nas."
    assert pickles.loads("a", content) == {"a": "café\n", "b": ["'", 7]}


def test_arrays_of_python_2() -> None:
    content = (
        b"cnumpy.core.multiarray\n_reconstruct\np0\n(cnumpy\nndarray\np1\n(I0\ntp2\nS'b'\np3\ntp4\nRp5\n"
        b"(I1\n(I2\ntp6\ncnumpy\ndtype\np7\n(S'f8'\np8\nI0\nI1\ntp9\nRp10\n(I3\nS'<'\np11\nNNNI-1\nI-1\nI0\n"
        b"tp12\nbI00\nS'\\x00\\x00\\x00\\x00\\x00\\x00\\xf0?\\x00\\x00\\x00\\x00\\x00\\x00\\x00@'\np13\ntp14\nb."
    )
    np.testing.assert_array_equal(pickles.loads("a", content), [1.0, 2.0])


def test_a_part_that_is_named_twice_is_one() -> None:
    inner = [1]
    first, second = pickles.loads("a", pickle.dumps([inner, inner]))
    assert first is second


def assert_data_or_one_line(content: bytes) -> None:
    message = "a.pkl: found "
    try:
        pickles.loads("a.pkl", content)
    except InputError as error:
        message = str(error)
    assert re.fullmatch("a.pkl: found .*", message)


@given(st.binary(max_size=60) | DATA.map(lambda data: pickle.dumps(data)[:-1]))
def test_damage_is_one_line(content: bytes) -> None:
    assert_data_or_one_line(content)


WHOLE = pickle.dumps(
    {"a": np.arange(6.0).reshape(2, 3), "b": [1, "x", b"y"], "c": np.array([{}, None]), "d": np.float64(1)}, 2
)


@given(st.lists(st.tuples(st.integers(0, len(WHOLE) - 1), st.integers(0, 255)), min_size=1, max_size=4))
def test_changed_bytes_are_other_data_or_one_line(changes: list[tuple[int, int]]) -> None:
    content = bytearray(WHOLE)
    for place, value in changes:
        content[place] = value
    assert_data_or_one_line(bytes(content))
