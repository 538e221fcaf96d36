from __future__ import annotations

import builtins
import collections
import functools
import importlib
import io
import json
import os
import pickle
import resource
import subprocess
import sys
import time
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence
from simrecon.errors import InputError
from simrecon.evidence.content import open_content
from simrecon.evidence.values import as_array
from simrecon.io.limits import MAX_BYTES
from tests.support import foreign_files as foreign


class Call:
    """Pickles as a call of a function."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = function, arguments

    def __reduce__(self) -> Any:
        return self.call


def attacks(target: Path) -> dict[str, Any]:
    """Objects that write `target` when a plain unpickler reads them."""
    code = f"open({str(target)!r}, 'w').close()"
    return {
        "os.system": Call(os.system, f"touch {target}"),
        "eval": Call(builtins.eval, code),
        "exec": Call(builtins.exec, code),
        "subprocess": Call(subprocess.call, ["touch", str(target)]),
        "open": Call(builtins.open, str(target), "w"),
        "partial": Call(functools.partial, os.system, f"touch {target}"),
        "getattr": Call(getattr, "text", "upper"),
        "import": Call(importlib.import_module, "antigravity"),
        "nested in an argument": Call(dict, Call(builtins.eval, code)),
        "deep in a tree": {"people": [{"pose": np.zeros(3)}, [Call(os.system, f"touch {target}")]]},
        "defaultdict of a call": collections.defaultdict(
            functools.partial(os.system, f"touch {target}"), {1: 2}
        ),
        "pickle in a pickle": Call(pickle.loads, pickle.dumps(Call(builtins.eval, code))),
        "numpy.load": Call(np.load, str(target), None, True),
        "objects in an array": np.array([Call(builtins.eval, code)], dtype=object),
    }


NAMES = list(attacks(Path("x")))


def assert_refused(path: Path, target: Path, *parts: str) -> None:
    with pytest.raises(InputError) as error:
        evidence.read(path)
    message = str(error.value)
    assert "\n" not in message
    assert [part for part in (str(path), *parts) if part not in message] == []
    assert not target.exists()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("container", ["pickle", "proto2", "joblib", "zlib", "torch", "npy", "npz"])
def test_nothing_is_run(tmp_path: Path, name: str, container: str) -> None:
    target, path = tmp_path / "was_run", tmp_path / "bad"
    bad = attacks(target)[name]
    raw = pickle.dumps(bad, 2 if container in ("proto2", "torch") else 4)
    if container == "torch":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("archive/data.pkl", raw)
    elif container in ("npy", "npz"):
        holder = np.empty((), dtype=object)
        holder[()] = bad
        stream = io.BytesIO()
        np.save(stream, holder) if container == "npy" else np.savez(stream, poses=holder)
        path.write_bytes(stream.getvalue())
    elif container in ("joblib", "zlib"):
        foreign.save_joblib(path, {"a": bad}, compress=container == "zlib")
    else:
        path.write_bytes(raw)
    assert_refused(path, target, "valid: ")


def test_the_attacks_would_work_on_a_plain_unpickler(tmp_path: Path) -> None:
    target = tmp_path / "was_run"
    pickle.loads(pickle.dumps(attacks(target)["eval"]))
    assert target.exists()


def test_what_was_asked_for_is_named(tmp_path: Path) -> None:
    path = foreign.save_pickle(tmp_path / "bad.pkl", Call(os.system, "true"))
    assert_refused(path, tmp_path / "x", f"'{os.system.__module__}.system'", "is not run")


# Programs that no pickler writes.
PROGRAMS = {
    "a state for a function": (
        b"\x80\x02c_codecs\nencode\nN}X\x0c\x00\x00\x00__defaults__K\x01\x85s\x86b.",
        "a state for a _codecs.encode",
    ),
    "a call of numpy.ndarray": (b"\x80\x02cnumpy\nndarray\nJ\x00\x00\x00\x7f\x85\x85R.", "not callable"),
    "an extension": (b"\x80\x02\x82\x01.", "extension 1"),
    "a dotted name": (b"\x80\x04\x8c\x05numpy\x8c\x0cndarray.data\x93.", "numpy.ndarray.data"),
    "a name of numpy": (b"\x80\x02cnumpy\nsave\n.", "numpy.save"),
    "a persistent id": (b"\x80\x02K\x01Q.", "persistent"),
    "10 GB of bytes": (b"\x80\x04\x8e" + (10**10).to_bytes(8, "little") + b"ab.", "damaged"),
    "10 GB of a bytearray": (b"\x80\x05\x96" + (10**10).to_bytes(8, "little") + b"ab.", "10 GB"),
    "a frame of 10 GB": (b"\x80\x04\x95" + (10**10).to_bytes(8, "little") + b"N.", "no known format"),
    "an endless list": (b"\x80\x02(lp0\n" + b"0" * 4, "damaged"),
    "no end": (b"\x80\x02}", "damaged"),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_hand_made_programs_are_refused(tmp_path: Path, name: str) -> None:
    raw, found = PROGRAMS[name]
    path = tmp_path / "bad.pkl"
    path.write_bytes(raw)
    with pytest.raises(InputError) as error:
        evidence.read(path)
    assert found in str(error.value)


def tree() -> dict[str, Any]:
    rng = np.random.default_rng(0)
    return {
        "a": rng.normal(size=(3, 4)),
        "b": {"c": np.arange(5, dtype=np.int32), "d": [1, 2.5, "x", None, True]},
        "e": np.asfortranarray(rng.normal(size=(2, 5))),
        "f": np.float32(2.5),
        "g": np.array([1, "a"], dtype=object),
        "h": np.array([True, False]),
        "i": np.arange(4, dtype=">i2"),
        "n": b"",
        "j": np.zeros((0, 3)),
        "k": collections.OrderedDict(z=1),
        "l": collections.defaultdict(dict, {3: {"y": b"bytes"}}),
        "m": np.array(["left", "right"]),
    }


def assert_equal(found: Any, wanted: Any) -> None:
    if isinstance(wanted, dict):
        assert list(found) == list(wanted)
        for key in wanted:
            assert_equal(found[key], wanted[key])
    elif isinstance(wanted, np.ndarray):
        np.testing.assert_array_equal(np.asarray(found), wanted)
        assert np.asarray(found).dtype.newbyteorder("=") == wanted.dtype.newbyteorder("=")
    else:
        assert found == wanted


@pytest.mark.parametrize("protocol", range(2, 6))
def test_plain_data_survive_a_pickle(tmp_path: Path, protocol: int) -> None:
    path = foreign.save_pickle(tmp_path / "a.pkl", tree(), protocol)
    assert_equal(open_content(path).tree, tree())


@pytest.mark.parametrize("compress", [False, True])
def test_plain_data_survive_joblib(tmp_path: Path, compress: bool) -> None:
    path = foreign.save_joblib(tmp_path / "a.pkl", tree(), compress=compress)
    assert_equal(open_content(path).tree, tree())


@pytest.mark.parametrize("compress", [0, 3, ("gzip", 3), ("bz2", 3), ("xz", 3), ("lzma", 3)], ids=str)
def test_files_of_joblib_itself(tmp_path: Path, compress: Any) -> None:
    joblib = pytest.importorskip("joblib", reason="joblib is not installed")
    joblib.dump(tree(), tmp_path / "a.pkl", compress=compress)
    assert_equal(open_content(tmp_path / "a.pkl").tree, tree())


@pytest.mark.parametrize("layout", ["zip", "old", "pickle"])
def test_files_of_torch_itself(tmp_path: Path, layout: str) -> None:
    torch = pytest.importorskip("torch", reason="torch is not installed")
    wide = torch.arange(12, dtype=torch.float32).view(3, 4)
    given = {
        "a": wide.t(),
        "b": wide[1:, 2],
        "c": torch.ones(1, 3).expand(5, 3),
        "d": torch.tensor([1.5, -2.0], dtype=torch.bfloat16),
        "e": torch.tensor([1.5], dtype=torch.float16),
        "f": torch.nn.Parameter(torch.ones(2)),
        "g": wide,
    }
    if layout == "pickle":
        foreign.save_pickle(tmp_path / "a.pt", given)
    else:
        torch.save(given, tmp_path / "a.pt", _use_new_zipfile_serialization=layout == "zip")
    found = open_content(tmp_path / "a.pt").tree
    for key, tensor in given.items():
        np.testing.assert_array_equal(found[key], tensor.detach().float().numpy())


def test_tensors_stay_within_their_storage(tmp_path: Path) -> None:
    path = foreign.save_torch(tmp_path / "a.pt", {"a": np.arange(4.0)}, claim=5)
    with pytest.raises(InputError, match="a tensor of 40 bytes in 32 bytes"):
        evidence.read(path)


BOMBS = {
    "pt": lambda path: foreign.save_torch(path, {"pose": np.zeros((2, 3))}, claim=10**10 // 8),
    "joblib": lambda path: foreign.save_joblib(path, {"pose": np.zeros((2, 3))}, claim=(10**10 // 8,)),
    "joblib zlib": lambda path: foreign.save_joblib(
        path, {"pose": np.zeros((2, 3))}, claim=(10**10 // 8,), compress=True
    ),
    "pickle": lambda path: path.write_bytes(
        pickle.dumps(np.zeros(2), 2).replace(b"K\x02\x85", b"J\x00\x94\x35\x77\x85")
    ),
    "npy": lambda path: path.write_bytes(_npy_header((10**10 // 8,)) + bytes(16)),
    "npz": lambda path: _npz(path, _npy_header((10**10 // 8,)) + bytes(16)),
    "c3d": lambda path: path.write_bytes(
        b"\x02\x50"
        + np.array([65535, 0, 1, 65535], "<u2").tobytes()
        + bytes(2)
        + b"\0\0\x80\xbf"
        + bytes(600)
    ),
}


def _npy_header(shape: tuple[int, ...]) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue()


def _npz(path: Path, member: bytes) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("poses.npy", member)


@pytest.mark.parametrize("name", BOMBS)
def test_a_claim_of_10_gb_allocates_nothing(tmp_path: Path, name: str) -> None:
    path = tmp_path / "bomb"
    BOMBS[name](path)
    assert path.stat().st_size < 10_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as error:
            evidence.read(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)
    assert peak < 20e6
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100e3  # kB


def test_a_small_pickle_cannot_make_itself_large(tmp_path: Path) -> None:
    text = b"X" + (1 << 20).to_bytes(4, "little") + b"a" * (1 << 20)
    once = b"c_codecs\nencode\nh\x00X\x06\x00\x00\x00latin1\x86R"
    path = tmp_path / "bad.pkl"
    path.write_bytes(b"\x80\x02" + text + b"q\x000" + b"(" + (once + b"0") * (2 * MAX_BYTES >> 20) + b"l.")
    with pytest.raises(InputError, match="makes more than"):
        evidence.read(path)


@pytest.mark.parametrize(
    "program",
    [
        b"]q\x00h\x00a",
        b"]K\x01aq\x00" + b"".join(b"0]q%c" % (i + 1) + (b"h%c" % i + b"a") * 9 for i in range(11)),
    ],
    ids=["a list that holds itself", "a list of many lists"],
)
def test_lists_without_an_end_are_refused_soon(tmp_path: Path, program: bytes) -> None:
    path = tmp_path / "bad.pkl"
    path.write_bytes(b"\x80\x02}X\x0b\x00\x00\x00pred_rotmat" + program + b"s.")
    began = time.perf_counter()
    with pytest.raises(InputError, match=r"holds itself|more than 100[0-9]* items"):
        evidence.read(path)
    assert time.perf_counter() - began < 1.0


def test_a_long_text_does_not_make_all_others_as_long(tmp_path: Path) -> None:
    path = tmp_path / "bad.json"
    path.write_text(json.dumps({"names": ["a" * 1_000_000] + ["b"] * 1_000_000}), encoding="utf-8")
    assert as_array(open_content(path).tree["names"]) is None
    short = as_array(["left", "right"])
    assert short is not None
    assert short.tolist() == ["left", "right"]


@pytest.mark.parametrize("container", ["pickle", "zlib", "torch", "npz", "json", "npy"])
def test_truncated_files_are_one_line(tmp_path: Path, container: str) -> None:
    whole, path = tmp_path / "whole", tmp_path / "cut"
    vectors, place = foreign.poses()
    data: dict[str, Any] = {"poses": vectors.reshape(len(vectors), -1), "trans": place, "fps": 30.0}
    if container == "torch":
        foreign.save_torch(whole, data)
    elif container in ("npz", "npy"):
        with whole.open("wb") as file:
            np.savez(file, **data) if container == "npz" else np.save(file, place)
    elif container == "json":
        foreign.save_json(whole, {"instance_info": [{"frame_id": 1, "instances": []}]})
    else:
        foreign.save_joblib(whole, data, compress=container == "zlib")
    raw = whole.read_bytes()
    for share in (0.3, 0.6, 0.9, 0.99):
        path.write_bytes(raw[: int(share * len(raw))])
        with pytest.raises(InputError) as error:
            evidence.read(path)
        assert "\n" not in str(error.value)
        assert str(error.value).startswith(str(path))


def test_neither_torch_nor_joblib_is_imported(tmp_path: Path) -> None:
    vectors, place = foreign.poses()
    path = foreign.save_torch(tmp_path / "a.pt", {"poses": vectors.reshape(len(vectors), -1), "trans": place})
    code = (
        "import sys; from simrecon.evidence.content import open_content as o; "
        "from simrecon.evidence.values import as_array; "
        f"print(o({str(path)!r}).tree['trans'].shape, 'torch' in sys.modules, 'joblib' in sys.modules)"
    )
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root, check=True)
    assert done.stdout.strip() == "(12, 3) False False"
