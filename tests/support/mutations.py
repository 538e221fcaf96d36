"""Damage to files: bytes flipped, files cut, sizes that are claimed, values that nobody meant."""

from __future__ import annotations

import io
import json
import pickle
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.evidence import trees
from tests.support import foreign_files as foreign

Rng = np.random.Generator
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][+-]?\d+)?")
WORDS = (
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"0", b"-1", b"1", b"", b"x", b"9" * 30,
    b"2147483648", b"-2147483649", b"4294967296", b"1e9", b"1000000", b"0.0000001", b"\xff\xfe", b"null",
)  # fmt: skip
TEXTS = (".csv", ".mot", ".trc", ".bvh", ".json", ".jsonl", ".toml", ".yml", ".xml")
SIZES = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1)
LEAVES: tuple[Any, ...] = (
    None, True, "", "x", "1e999", 0, -1, 1, 10**30, -(10**30), 2**31, 2**63, 1e308, -1e308, 1e-320,
    float("nan"), float("inf"), [], {}, [[]], [None], {"": None}, "9" * 400, [[1, 2], [3]], 1 << 70,
)  # fmt: skip
STRANGE: tuple[Callable[[], Any], ...] = (
    lambda: np.zeros(0), lambda: np.zeros((0, 3)), lambda: np.zeros((3, 0)), lambda: np.array(1.0),
    lambda: np.array("x"), lambda: np.array([b"x"]), lambda: np.zeros((2, 2, 2, 2, 2, 2)),
    lambda: np.full((12, 3), np.nan), lambda: np.full((12, 3), 1e308), lambda: np.array([True]),
    lambda: np.array([1j]), lambda: np.zeros((12, 72), np.int8), lambda: np.array(["x"] * 12),
)  # fmt: skip


def mutate(path: Path, target: Path, rng: Rng) -> Path:
    """A damaged copy of a file, or of a folder with one damaged file."""
    if path.is_dir():
        shutil.copytree(path, target)
        files = sorted(file for file in target.rglob("*") if file.is_file())
        victim = files[rng.integers(len(files))]
        victim.write_bytes(damaged(victim, rng))
        return target
    target.parent.mkdir(parents=True, exist_ok=True)
    for other in path.parent.parent.glob("*/camera.npy"):
        shutil.copyfile(other, target.parent / "camera.npy")
    target.write_bytes(damaged(path, rng))
    return target


def damaged(path: Path, rng: Rng) -> bytes:
    """The bytes of a file after one kind of damage."""
    raw = path.read_bytes()
    kinds: list[Callable[[bytes, Rng], bytes]] = [flipped, cut, claimed, repeated]
    if raw[:1] in b"{[H#PCs" or path.suffix in TEXTS:
        kinds += [worded, worded, lines]
    if path.suffix == ".json" and raw[:1] in b"{[":
        kinds += [json_values] * 3
    if path.suffix in (".npz", ".npy", ".pkl", ".pt"):
        kinds += [arrays(path.suffix)] * 4
    return kinds[rng.integers(len(kinds))](raw, rng)


def flipped(raw: bytes, rng: Rng) -> bytes:
    """Some bytes replaced, most often near the beginning."""
    content = bytearray(raw)
    reach = len(content) if rng.random() < 0.5 else min(len(content), 600)
    for at in rng.integers(reach, size=rng.integers(1, 20)):
        content[at] = rng.integers(256)
    return bytes(content)


def cut(raw: bytes, rng: Rng) -> bytes:
    """The beginning, or all without a middle part."""
    a, b = sorted(rng.integers(len(raw), size=2))
    return raw[:a] if rng.random() < 0.5 else raw[:a] + raw[b:]


def claimed(raw: bytes, rng: Rng) -> bytes:
    """A whole number, in text or in bytes, that claims another size."""
    size = SIZES[rng.integers(len(SIZES))]
    found = [match.span() for match in re.finditer(rb"\d+", raw[:4000])]
    if found and rng.random() < 0.5:
        start, end = found[rng.integers(len(found))]
        return raw[:start] + str(size).encode() + raw[end:]
    width = int(rng.choice([1, 2, 4, 8]))
    at = int(rng.integers(min(len(raw), 4000)))
    order = "little" if rng.random() < 0.5 else "big"
    return raw[:at] + (size % (1 << (8 * width))).to_bytes(width, order) + raw[at + width :]  # type: ignore[arg-type]


def repeated(raw: bytes, rng: Rng) -> bytes:
    """A part that comes again, up to thousands of times."""
    start = int(rng.integers(len(raw)))
    part = raw[start : start + int(rng.integers(1, 200))]
    at = int(rng.integers(len(raw)))
    return raw[:at] + part * int(rng.choice([1, 2, 100, 3000])) + raw[at:]


def worded(raw: bytes, rng: Rng) -> bytes:
    """Some numbers replaced by words that nobody meant."""
    found = [match.span() for match in NUMBER.finditer(raw)]
    if not found:
        return flipped(raw, rng)
    reach = min(len(found), 60) if rng.random() < 0.5 else len(found)
    chosen = sorted({int(k) for k in rng.integers(reach, size=rng.integers(1, 6))})
    for k in reversed(chosen):
        start, end = found[k]
        raw = raw[:start] + WORDS[rng.integers(len(WORDS))] + raw[end:]
    return raw


def lines(raw: bytes, rng: Rng) -> bytes:
    """Lines left out, exchanged or written twice."""
    rows = raw.split(b"\n")
    a, b = (int(k) for k in rng.integers(len(rows), size=2))
    kind = rng.integers(3)
    if kind == 0:
        del rows[min(a, b) : max(a, b)]
    elif kind == 1:
        rows[a], rows[b] = rows[b], rows[a]
    else:
        rows.insert(a, rows[b])
    return b"\n".join(rows)


def json_values(raw: bytes, rng: Rng) -> bytes:
    """Values of a JSON file replaced, left out or put somewhere else."""
    tree = json.loads(raw)
    for _ in range(int(rng.integers(1, 4))):
        tree = _altered(tree, rng, lambda: LEAVES[rng.integers(len(LEAVES))])
    return json.dumps(tree).encode()


def arrays(suffix: str) -> Callable[[bytes, Rng], bytes]:
    """Values of a file of arrays replaced: keys, shapes, kinds and single numbers."""

    def change(raw: bytes, rng: Rng) -> bytes:
        tree = _opened(suffix, raw)

        def leaf() -> Any:
            if rng.random() < 0.5:
                return STRANGE[rng.integers(len(STRANGE))]()
            return LEAVES[rng.integers(len(LEAVES))]

        for _ in range(int(rng.integers(1, 3))):
            tree = _altered(tree, rng, leaf)
        stream = io.BytesIO()
        if suffix == ".pt":
            try:
                foreign.save_torch(stream, tree)
            except (ValueError, TypeError, Warning):  # no tensor holds it
                return flipped(raw, rng)
        elif suffix == ".npz" and isinstance(tree, dict):
            np.savez(stream, **{str(key): _as_array(value) for key, value in tree.items()})
        elif suffix == ".npy":
            holder = tree
            if not isinstance(tree, np.ndarray):
                holder = np.empty((), object)
                holder[()] = tree
            np.save(stream, holder)
        else:
            return pickle.dumps(tree, int(rng.integers(0, 6)))
        return stream.getvalue()

    return change


def _as_array(value: Any) -> Any:
    try:
        return np.asarray(value)
    except (ValueError, OverflowError):
        return np.asarray(value, object)


def _opened(suffix: str, raw: bytes) -> Any:
    kind = {".npz": "npz", ".npy": "npy", ".pkl": "pickle", ".pt": "torch"}[suffix]
    return trees.BINARY[kind]("a sample", raw)


def _altered(node: Any, rng: Rng, leaf: Callable[[], Any], depth: int = 0) -> Any:
    """A copy of a tree in which one value is another."""
    if isinstance(node, np.ndarray) and node.size and node.dtype.kind in "fiu" and rng.random() < 0.7:
        return _array(node, rng)
    keys = list(node) if isinstance(node, dict) else list(range(len(node))) if isinstance(node, list) else []
    if not keys or rng.random() < 0.06 * depth:
        return leaf()
    key = keys[int(rng.integers(len(keys)))]
    copy = dict(node) if isinstance(node, dict) else list(node)
    if depth and rng.random() < 0.1:
        del copy[key]
    elif rng.random() < 0.05:
        copy[key] = node[keys[int(rng.integers(len(keys)))]]
    else:
        copy[key] = _altered(node[key], rng, leaf, depth + 1)
    return copy


def _array(values: Any, rng: Rng) -> Any:
    """An array with other numbers in it, or of another shape or kind."""
    kind = int(rng.integers(8))
    changed = np.array(values, float)
    if kind < 3:
        worst = [np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, -1.0, 1e30, 1e9]
        where = rng.integers(changed.size, size=rng.integers(1, 5))
        changed.reshape(-1)[where] = worst[rng.integers(len(worst))]
        return changed
    if kind == 3:
        return changed * float(rng.choice([0.0, 1e-3, 1e3, 1e30, -1.0, np.nan]))
    if kind == 4:
        return changed[: int(rng.integers(len(changed) + 1))] if changed.ndim else changed[None]
    if kind == 5:
        return changed[..., None] if rng.random() < 0.5 else changed[None]
    if kind == 6:
        return changed.reshape(-1) if rng.random() < 0.5 else changed.T
    return changed.astype(rng.choice(["i1", "u8", "f2", "U5", "S3", "?", "c8", ">f8"]))
