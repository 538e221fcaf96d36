"""Files of body models: read as data, never run."""

from __future__ import annotations

import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csc_matrix, csr_matrix

from simrecon.body import foreign
from simrecon.errors import InputError

ARRAYS: dict[str, Any] = {
    "a": np.arange(6.0).reshape(2, 3),
    "n": np.float64(2.5),
    "text": "lrotmin",
    "i": np.arange(3, dtype=np.uint32),
}


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL))
def test_pickles_of_plain_data(tmp_path: Path, protocol: int) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps(ARRAYS, protocol=protocol))
    found = foreign.load(path)
    np.testing.assert_array_equal(found["a"], ARRAYS["a"])
    assert (float(found["n"]), found["text"]) == (2.5, "lrotmin")
    assert found["i"].dtype == np.uint32


@pytest.mark.parametrize("kind", [csc_matrix, csr_matrix])
def test_sparse_matrices_become_arrays(tmp_path: Path, kind: Any) -> None:
    dense = np.array([[0.0, 1.5, 0.0], [2.0, 0.0, 0.0]])
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps({"J": kind(dense)}, protocol=2))
    np.testing.assert_array_equal(foreign.load(path)["J"], dense)


def test_arrays_of_the_other_byte_order_are_read_right(tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(
        pickle.dumps({"a": ARRAYS["a"].astype(">f8"), "i": ARRAYS["i"].astype(">u4")}, protocol=2)
    )
    values = foreign.load(path)
    np.testing.assert_array_equal(values["a"], ARRAYS["a"])
    np.testing.assert_array_equal(values["i"], ARRAYS["i"])


def test_a_sparse_matrix_is_not_made_larger_than_there_is_memory(tmp_path: Path) -> None:
    large = csc_matrix(([1.0], ([0], [0])), shape=(1 << 20, 1 << 20))
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps({"J": large}, protocol=2))
    with pytest.raises(InputError, match=r"sparse matrices of more than 1\.07 GB"):
        foreign.load(path)
    medium = csc_matrix(([1.0], ([0], [0])), shape=(5 << 10, 10 << 10))
    path.write_bytes(pickle.dumps({f"J{i}": medium.copy() for i in range(3)}, protocol=2))
    with pytest.raises(InputError, match="sparse matrices of more than"):
        foreign.load(path)


@pytest.mark.parametrize(
    "state",
    [
        {"shape": (2, 2), "data": np.ones(1), "indices": np.array([5]), "indptr": np.array([0, 1, 1])},
        {"shape": (2, 2), "data": np.ones(1), "indices": np.array([0]), "indptr": np.array([0, 9, 9])},
    ],
)
def test_a_sparse_matrix_stays_within_its_shape(tmp_path: Path, state: dict[str, Any]) -> None:
    matrix = csc_matrix((2, 2))
    matrix.__dict__.clear()
    matrix.__dict__.update(state)
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps({"J": matrix}, protocol=2))
    with pytest.raises(InputError, match="found a damaged file"):
        foreign.load(path)


class Call:
    """A pickle of it calls a function when it is read carelessly."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.made = function, arguments

    def __reduce__(self) -> Any:
        return self.made


@pytest.mark.parametrize(
    "call",
    [Call(os.system, "true"), Call(eval, "1"), Call(getattr, 1, "real"), Call(np.load, "x"), Call(print, 1)],
)
def test_whatever_would_run_is_refused(tmp_path: Path, call: Call) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps({"x": call}))
    with pytest.raises(InputError, match="in the pickle, which is not run; valid: numbers") as caught:
        foreign.load(path)
    assert "\n" not in str(caught.value)


def test_arrays_of_objects_in_an_npz_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, a=ARRAYS["a"], odd=np.array([Call(os.system, "true")], dtype=object))
    assert list(foreign.load(path)) == ["a"]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.txt", b"", "found a file that ends in '.txt'; valid: .npz, .pkl"),
        ("a.pkl", b"", "found a damaged pickle"),
        ("a.pkl", pickle.dumps(ARRAYS)[:-40], "found a damaged pickle"),
        ("a.pkl", pickle.dumps([1]), "list instead of a dictionary"),
        ("a.npz", b"PK", "found a file that is no .npz archive"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        foreign.load(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.npz: cannot read the body model: No such file"):
        foreign.load(tmp_path / "none.npz")
