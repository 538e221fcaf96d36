"""A normalizing flow over body poses (`models/prior/flow.npz`), the prior of Gärtner 2022 eq. 4, in numpy.

Trained by `tools/train/prior.py`. With v the joints' 48 rotation vector components and K layers,

    x₀ = v − mean,    y = L_k x_{k−1},    x_k = (y₁, exp(α) y₂ + β),    z = x_K

where y₁ and y₂ are halves of y, and (α, β) come from y₁ by a network with one hidden layer (Dinh et al.
2017, affine coupling). A half consists of coordinates s that stay when left and right are exchanged, and a
that change their sign. With h± = tanh(W_s s₁ ± W_a a₁ + b), the log scales α and the shift of s₂ are linear
in h₊ + h₋, which stays in the mirror; the shift of a₂ is linear in h₊ − h₋, which changes its sign. So a
pose and its mirror image have the same ‖z‖.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from simrecon import resources
from simrecon.errors import SimreconError
from simrecon.types import Array

SCHEMA = "simrecon.flow/2"
SIZE, HALF, SYMMETRIC = 48, 24, 11
"""Coordinates; those of a half; those of a half that stay in the mirror, which come first."""
_ROWS = 320
"""Poses at a time: their hidden units stay in the cache, and no result depends on threads."""

Weights = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer; H hidden units.

    Attributes:
        linear: (48, 48) L.
        stay, bias, turn: (H, 11), (H,), (H, 13) to the hidden units.
        even, even_bias: (35, H), (35,) to α (24) and the shift of s₂ (11).
        odd: (13, H) to the shift of a₂.
    """

    linear: Weights
    stay: Weights
    bias: Weights
    turn: Weights
    even: Weights
    even_bias: Weights
    odd: Weights


@dataclass(frozen=True, eq=False)
class _Trace:
    """What the gradient of one layer needs, (..., N): y, h₊ + h₋, h₊ − h₋, raw log scales, exp(α)."""

    y: Weights
    total: Weights
    difference: Weights
    raw: Weights
    scale: Weights


@dataclass(frozen=True, eq=False)
class Flow:
    """The flow; all methods are batched over leading axes.

    Attributes:
        mean_rad: (48,) origin of the coordinates.
        layers: K of them.
        bound: of log scales: α = r / (1 + |r| / bound).
    """

    mean_rad: Array
    layers: tuple[Layer, ...]
    bound: float

    def latent(self, joints: Array, threads: int = 1) -> Array:
        """Latent codes (..., 48) of joint quaternions (..., 16, 4), eq. 4; single precision."""
        z = self._by_blocks(_rotvecs, joints.reshape(-1, SIZE // 3, 4), threads)
        return z.reshape(*joints.shape[:-2], SIZE)

    def code(self, rotvecs: NDArray[np.floating], threads: int = 1) -> Array:
        """Latent codes (..., 48) of rotation vectors (..., 16, 3), in their precision."""
        z = self._by_blocks(lambda block: block, rotvecs.reshape(-1, SIZE), threads)
        return z.reshape(*rotvecs.shape[:-2], SIZE)

    def squared(self, rotvecs: Array) -> tuple[Array, Array]:
        """‖z‖² (...) of rotation vectors (..., 16, 3) and its gradient, (..., 16, 3)."""
        trace: list[_Trace] = []
        z = self._run(rotvecs.reshape(-1, SIZE), trace)  # (48, N)
        gradient = self._back(trace, 2 * z, 0.0)
        value = np.asarray(np.sum(z**2, axis=0), np.float64)
        return value.reshape(rotvecs.shape[:-2]), gradient.reshape(rotvecs.shape)

    def log_likelihood(self, rotvecs: Array) -> tuple[Array, Array]:
        """Log density (...) over rotation vectors (..., 16, 3), per rad⁴⁸, and its gradient, (..., 16, 3)."""
        trace: list[_Trace] = []
        z = self._run(rotvecs.reshape(-1, SIZE), trace)  # (48, N)
        volume = self._volume + sum(self._log_scale(kept.raw).sum(axis=0) for kept in trace)  # (N,)
        value = np.asarray(volume - 0.5 * np.sum(z**2, axis=0) - 0.5 * SIZE * np.log(2 * np.pi), np.float64)
        gradient = self._back(trace, -z, 1.0)
        return value.reshape(rotvecs.shape[:-2]), gradient.reshape(rotvecs.shape)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Rotation vectors (count, 16, 3) of random poses."""
        return self.pose(rng.standard_normal((count, SIZE)))

    def pose(self, z: Array) -> Array:
        """Rotation vectors (..., 16, 3) of latent codes (..., 48): the inverse of `code`."""
        x: Weights = z.reshape(-1, SIZE).T  # (48, N)
        for layer, inverse in zip(reversed(self.layers), reversed(self._inverses), strict=True):
            even, odd, _, _ = self._network(layer, x[:HALF])
            shift = np.concatenate((even[HALF:], odd))  # (24, N)
            moved = (x[HALF:] - shift) / np.exp(self._log_scale(even[:HALF]))
            x = inverse @ np.concatenate((x[:HALF], moved))
        return (x.T + self.mean_rad).reshape(*z.shape[:-1], 16, 3)

    @cached_property
    def _inverses(self) -> tuple[Weights, ...]:
        return tuple(np.linalg.inv(layer.linear) for layer in self.layers)

    @cached_property
    def _volume(self) -> float:
        """Σ log |det L_k|."""
        return float(sum(np.linalg.slogdet(layer.linear)[1] for layer in self.layers))

    @cached_property
    def _single(self) -> tuple[Layer, ...]:
        return tuple(
            Layer(**{name: value.astype(np.float32) for name, value in vars(layer).items()})
            for layer in self.layers
        )

    def _by_blocks(
        self, rotvecs: Callable[[NDArray[np.floating]], Weights], rows: NDArray[np.floating], threads: int
    ) -> Array:
        """Codes (N, 48) of N rows that `rotvecs` turns into (n, 48), block by block."""
        z = np.empty((len(rows), SIZE))

        def fill(first: int) -> None:
            z[first : first + _ROWS] = self._run(rotvecs(rows[first : first + _ROWS])).T

        if threads == 1:
            for first in range(0, len(rows), _ROWS):
                fill(first)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(fill, range(0, len(rows), _ROWS)))
        return z

    def _run(self, flat: Weights, trace: list[_Trace] | None = None) -> Weights:
        """Codes (48, N) of poses (N, 48); appends each layer's trace."""
        x = flat.T - self.mean_rad.astype(flat.dtype)[:, None]
        for layer in self._single if flat.dtype == np.float32 else self.layers:
            y = layer.linear @ x  # (48, N)
            even, odd, total, difference = self._network(layer, y[:HALF])
            scale = self._log_scale(even[:HALF])  # (24, N)
            np.exp(scale, out=scale)
            x[:HALF] = y[:HALF]
            np.multiply(y[HALF:], scale, out=x[HALF:])
            x[HALF : HALF + SYMMETRIC] += even[HALF:]
            x[HALF + SYMMETRIC :] += odd
            if trace is not None:
                trace.append(_Trace(y, total, difference, even[:HALF], scale))
        return x

    def _network(self, layer: Layer, given: Weights) -> tuple[Weights, Weights, Weights, Weights]:
        """By y₁ (24, N): raw α and shift of s₂ (35, N), shift of a₂ (13, N), h₊ + h₋ and h₊ − h₋ (H, N)."""
        stay = layer.stay @ given[:SYMMETRIC]  # (H, N)
        stay += layer.bias[:, None]
        turn = layer.turn @ given[SYMMETRIC:]  # (H, N)
        plus = stay + turn
        stay -= turn
        np.tanh(plus, out=plus)
        np.tanh(stay, out=stay)
        difference = np.subtract(plus, stay, out=turn)
        plus += stay
        even = layer.even @ plus
        even += layer.even_bias[:, None]
        return even, layer.odd @ difference, plus, difference

    def _log_scale(self, raw: Weights) -> Weights:
        scale = np.abs(raw)
        scale *= 1 / self.bound
        scale += 1
        return np.divide(raw, scale, out=scale)

    def _back(self, trace: list[_Trace], d_code: Weights, d_volume: float) -> Array:
        """Gradient (N, 48) by the pose from those by the code (48, N) and the log determinant."""
        d = d_code
        for layer, kept in zip(reversed(self.layers), reversed(trace), strict=True):
            d_moved = d[HALF:]
            d_log_scale = d_moved * kept.y[HALF:] * kept.scale + d_volume  # (24, N)
            d_raw = d_log_scale / (1 + np.abs(kept.raw) / self.bound) ** 2
            d_even = layer.even.T @ np.concatenate((d_raw, d_moved[:SYMMETRIC]))  # (H, N)
            d_odd = layer.odd.T @ d_moved[SYMMETRIC:]
            plus, minus = (kept.total + kept.difference) / 2, (kept.total - kept.difference) / 2
            d_plus = (d_even + d_odd) * (1 - plus**2)
            d_minus = (d_even - d_odd) * (1 - minus**2)
            d_y = np.empty_like(d)
            d_y[:SYMMETRIC] = d[:SYMMETRIC] + layer.stay.T @ (d_plus + d_minus)
            d_y[SYMMETRIC:HALF] = d[SYMMETRIC:HALF] + layer.turn.T @ (d_plus - d_minus)
            d_y[HALF:] = d_moved * kept.scale
            d = layer.linear.T @ d_y
        return np.asarray(d.T, np.float64)


def _rotvecs(joints: NDArray[np.floating]) -> Weights:
    """Rotation vectors (N, 48) of quaternions (N, 16, 4) of either sign, single precision."""
    q = joints.astype(np.float32)
    sine = np.sqrt(np.einsum("...i,...i->...", q[..., 1:], q[..., 1:]))  # of half the angle
    half = np.arctan2(sine, np.abs(q[..., 0]))
    scale = np.copysign(2 * half, q[..., 0]) / np.maximum(sine, np.float32(1e-12))
    factor = np.where(sine > 1e-6, scale, np.float32(2))
    return (factor[..., None] * q[..., 1:]).reshape(-1, SIZE)


@cache
def flow() -> Flow:
    """The flow of `models/prior/flow.npz`.

    Raises:
        SimreconError: the file is not there or is damaged.
    """
    path = resources.folder("models") / "prior" / "flow.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            return from_arrays({key: data[key] for key in data.files})
    except (OSError, KeyError, ValueError) as error:
        raise SimreconError(f"{path}: can't read the pose prior ({error}): install simrecon again") from error


def from_arrays(data: dict[str, NDArray[np.generic]]) -> Flow:
    """A flow from the arrays of its file: those of `Layer` stacked over layers, `mean_rad` and `bound`.

    Raises:
        ValueError: of another schema.
    """
    if str(data["schema"]) != SCHEMA:
        raise ValueError(f"schema {data['schema']}, not {SCHEMA}")
    names = tuple(Layer.__dataclass_fields__)
    stacks = {name: np.asarray(data[name], np.float64) for name in names}
    layers = tuple(Layer(**{name: stacks[name][k] for name in names}) for k in range(len(stacks["linear"])))
    return Flow(np.asarray(data["mean_rad"], np.float64).ravel(), layers, float(np.float64(data["bound"])))
