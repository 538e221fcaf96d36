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
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simrecon.prior import coupling
from simrecon.prior.coupling import SIZE, Layer, Trace, Weights
from simrecon.types import Array

_ROWS = 320
"""Poses at a time: their hidden units stay in the cache, and no result depends on threads."""


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
        trace: list[Trace] = []
        z = self._run(rotvecs.reshape(-1, SIZE), trace)  # (48, N)
        gradient = self._slope(trace, 2 * z, 0.0)
        value = np.asarray(np.sum(z**2, axis=0), np.float64)
        return value.reshape(rotvecs.shape[:-2]), gradient.reshape(rotvecs.shape)

    def slope(self, rotvecs: Array) -> Array:
        """Derivative (..., 48, 16, 3) of the codes of rotation vectors (..., 16, 3) with respect to them."""
        rows = np.repeat(rotvecs.reshape(-1, SIZE), SIZE, axis=0)  # each pose once for each number of a code
        trace: list[Trace] = []
        self._run(rows, trace)
        each = np.tile(np.eye(SIZE), len(rows) // SIZE)  # (48, 48 N)
        return self._slope(trace, each, 0.0).reshape(*rotvecs.shape[:-2], SIZE, *rotvecs.shape[-2:])

    def log_likelihood(self, rotvecs: Array) -> tuple[Array, Array]:
        """Log density (...) over rotation vectors (..., 16, 3), per rad⁴⁸, and its gradient, (..., 16, 3)."""
        trace: list[Trace] = []
        z = self._run(rotvecs.reshape(-1, SIZE), trace)  # (48, N)
        scales = (coupling.log_scale(kept.raw, self.bound) for kept in trace)  # (24, N) each
        volume = self._volume + sum(scale.sum(axis=0) for scale in scales)  # (N,)
        value = np.asarray(volume - 0.5 * np.sum(z**2, axis=0) - 0.5 * SIZE * np.log(2 * np.pi), np.float64)
        gradient = self._slope(trace, -z, 1.0)
        return value.reshape(rotvecs.shape[:-2]), gradient.reshape(rotvecs.shape)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Rotation vectors (count, 16, 3) of random poses."""
        return self.pose(rng.standard_normal((count, SIZE)))

    def pose(self, z: Array) -> Array:
        """Rotation vectors (..., 16, 3) of latent codes (..., 48): the inverse of `code`."""
        x: Weights = z.reshape(-1, SIZE).T  # (48, N)
        for layer, inverse in zip(reversed(self.layers), reversed(self._inverses), strict=True):
            x = inverse @ coupling.inverse(layer, self.bound, x)
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

    def _run(self, flat: Weights, trace: list[Trace] | None = None) -> Weights:
        """Codes (48, N) of poses (N, 48); appends the trace of each layer."""
        x = flat.T - self.mean_rad.astype(flat.dtype)[:, None]
        layers = self._single if flat.dtype == np.float32 else self.layers
        return coupling.forward(layers, self.bound, x, trace)

    def _slope(self, trace: list[Trace], d_code: Weights, d_volume: float) -> Array:
        """Gradient (N, 48) by the pose from those by the code (48, N) and the log determinant."""
        return coupling.backward(self.layers, self.bound, trace, d_code, d_volume)


def _rotvecs(joints: NDArray[np.floating]) -> Weights:
    """Rotation vectors (N, 48) of quaternions (N, 16, 4) of either sign, single precision."""
    q = joints.astype(np.float32)
    sine = np.sqrt(np.einsum("...i,...i->...", q[..., 1:], q[..., 1:]))  # of half the angle
    half = np.arctan2(sine, np.abs(q[..., 0]))
    scale = np.copysign(2 * half, q[..., 0]) / np.maximum(sine, np.float32(1e-12))
    factor = np.where(sine > 1e-6, scale, np.float32(2))
    return (factor[..., None] * q[..., 1:]).reshape(-1, SIZE)
