"""The flow that ships with simrecon, from its file `models/prior/flow.npz`."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from simrecon import resources
from simrecon.errors import SimreconError
from simrecon.prior.coupling import Layer
from simrecon.prior.flow import Flow

SCHEMA = "simrecon.flow/2"


@cache
def flow() -> Flow:
    """The flow of `models/prior/flow.npz`, read once.

    Raises:
        SimreconError: the file is missing or damaged.
    """
    path = resources.folder("models") / "prior" / "flow.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            return from_arrays({key: data[key] for key in data.files})
    except (OSError, KeyError, ValueError) as error:
        raise SimreconError(
            f"{path}: cannot read the pose prior ({error}): install simrecon again"
        ) from error


def from_arrays(data: dict[str, NDArray[np.generic]]) -> Flow:
    """A flow from the arrays of its file: those of `Layer` stacked over layers, `mean_rad` and `bound`.

    Raises:
        ValueError: they have another schema.
    """
    if str(data["schema"]) != SCHEMA:
        raise ValueError(f"schema {data['schema']}, not {SCHEMA}")
    names = tuple(Layer.__dataclass_fields__)
    stacks = {name: np.asarray(data[name], np.float64) for name in names}
    layers = tuple(Layer(**{name: stacks[name][k] for name in names}) for k in range(len(stacks["linear"])))
    return Flow(np.asarray(data["mean_rad"], np.float64).ravel(), layers, float(np.float64(data["bound"])))
