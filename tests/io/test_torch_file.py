"""Files of tensors: read back by simrecon's own reader, and by torch where it is installed."""

from __future__ import annotations

import io
import pickle
import zipfile
from typing import Any

import numpy as np
import pytest

from simrecon.io import torch_file
from simrecon.io.pickles import loads
from simrecon.io.pickles.torch_files import archive_pickle

CONTENT: dict[str, Any] = {
    "fps": 30.0,
    "count": 70000,
    "large": -(2**40),
    "kept": True,
    "place": np.arange(12, dtype=np.float32).reshape(2, 2, 3),
    "turn": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "flags": np.array([[True, False], [False, True]]),
    "none": np.zeros((0, 3), np.float32),
}


def test_own_reader_gives_the_same_back() -> None:
    archive = zipfile.ZipFile(io.BytesIO(torch_file.dumps(CONTENT)))
    assert archive.testzip() is None
    raw, storages = archive_pickle("file", archive)
    found = loads("file", raw, storages)
    assert list(found) == list(CONTENT)
    for name, value in CONTENT.items():
        np.testing.assert_array_equal(np.asarray(found[name]), value, err_msg=name)
        if isinstance(value, np.ndarray):
            assert np.asarray(found[name]).dtype == value.dtype
    assert torch_file.dumps(CONTENT) == torch_file.dumps(CONTENT)


class Plain(pickle.Unpickler):
    """Python's own reader, for which only tensors and their storages stand."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        super().__init__(io.BytesIO(archive.read("archive/data.pkl")))
        self.archive = archive

    def find_class(self, module: str, name: str) -> Any:
        known = {
            ("torch._utils", "_rebuild_tensor_v2"): self.tensor,
            ("collections", "OrderedDict"): dict,
            ("torch", "FloatStorage"): np.dtype("<f4"),
            ("torch", "DoubleStorage"): np.dtype("<f8"),
            ("torch", "BoolStorage"): np.dtype("?"),
        }
        return known[module, name]

    def persistent_load(self, pid: Any) -> Any:
        word, kind, key, place, count = pid
        assert (word, place) == ("storage", "cpu")
        values = np.frombuffer(self.archive.read(f"archive/data/{key}"), kind)
        assert len(values) == count
        return values

    @staticmethod
    def tensor(storage: Any, offset: int, size: Any, stride: Any, grad: bool, hooks: Any) -> Any:
        assert (offset, grad, hooks) == (0, False, {})
        steps = [step * storage.itemsize for step in stride]
        return np.lib.stride_tricks.as_strided(storage, size, steps)


def test_pythons_own_unpickler_gives_the_same_back() -> None:
    found = Plain(zipfile.ZipFile(io.BytesIO(torch_file.dumps(CONTENT)))).load()
    for name, value in CONTENT.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


def test_torch_reads_it_as_weights_alone() -> None:
    torch: Any = pytest.importorskip("torch", reason="torch is not installed")
    found = torch.load(io.BytesIO(torch_file.dumps(CONTENT)), weights_only=True)
    assert (found["fps"], found["count"], found["large"], found["kept"]) == (30.0, 70000, -(2**40), True)
    for name in ("place", "turn", "flags", "none"):
        np.testing.assert_array_equal(found[name].numpy(), CONTENT[name], err_msg=name)
