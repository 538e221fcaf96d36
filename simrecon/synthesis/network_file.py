"""The network as a file of half precision, `simrecon.synthesis/1`: `models/synthesis/futures.npz` ships."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon import resources
from simrecon.io.arrays import Arrays
from simrecon.io.npz import load
from simrecon.synthesis.features import COUNT, POINTS, RATE_HZ
from simrecon.synthesis.network import Dense, Gru, Network

SCHEMA = "simrecon.synthesis/1"
PARTS: Mapping[str, type[Dense] | type[Gru]] = {
    "context": Gru, "begin": Dense, "decoder": Gru, "hidden": Dense, "out": Dense,
    "choose": Gru, "chosen": Dense, "factors": Dense, "centres": Dense,
}  # fmt: skip
"""The parts of a network that hold weights; in the file, `decoder.input_weight` is one of them."""


@cache
def shipped() -> Network:
    """The network that ships with simrecon."""
    return read(resources.folder("models") / "synthesis" / "futures.npz")


def read(path: Path) -> Network:
    """Read a network.

    Raises:
        InputError: it can't be read, or is none of this version's features.
    """
    return parse(load(path))


def parse(arrays: Arrays) -> Network:
    """The network of the arrays of its file.

    Raises:
        InputError: as `read`.
    """
    arrays.text("schema", (SCHEMA,))
    if arrays.names("points", "K") != POINTS:
        arrays.fail("points", "other points of the body", ", ".join(POINTS))
    if float(arrays.finite("rate_hz", ())) != RATE_HZ:
        arrays.fail("rate_hz", f"{float(arrays.finite('rate_hz', ())):g}", f"{RATE_HZ:g}")
    parts: dict[str, Any] = {
        name: kind(**{item.name: _weights(arrays, f"{name}.{item.name}") for item in fields(kind)})
        for name, kind in PARTS.items()
    }
    mean, spread = (arrays.finite(key, (COUNT,)).astype(np.float32) for key in ("mean", "spread"))
    return Network(mean, spread, **parts)


def content(network: Network, provenance: str) -> dict[str, NDArray[Any]]:
    """The arrays of a file.

    Args:
        network: to be kept.
        provenance: what it was made of, as text.
    """
    kept: dict[str, Any] = {
        "schema": SCHEMA, "points": POINTS, "rate_hz": RATE_HZ, "provenance": provenance,
        "mean": network.mean, "spread": network.spread,
    }  # fmt: skip
    for name, kind in PARTS.items():
        part = getattr(network, name)
        kept |= {f"{name}.{item.name}": getattr(part, item.name).astype(np.float16) for item in fields(kind)}
    return {key: np.asarray(value) for key, value in kept.items()}


def _weights(arrays: Arrays, key: str) -> NDArray[np.float32]:
    axes = (f"out of {key}", f"in of {key}") if key.endswith("weight") else (f"out of {key}",)
    return arrays.finite(key, axes).astype(np.float32)
