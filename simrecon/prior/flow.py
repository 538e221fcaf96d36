"""A normalizing flow over body poses (`models/prior/flow.npz`), the prior of Gärtner 2022 eq. 4, in numpy.

Trained by `tools/train_prior.py`. With v the joints' 48 rotation vector components and K layers,

    x₀ = v − mean,    y = L_k x_{k−1},    x_k = (y₁, exp(α) y₂ + β),    z = x_K

where y₁ and y₂ are halves of y, and (α, β) come from y₁ by a network with one hidden layer (Dinh et al.
2017, affine coupling). A half consists of coordinates s that stay when left and right are exchanged, and a
that change their sign. With h± = σ(W_s s₁ ± W_a a₁ + b), the log scales α and the shift of s₂ are linear in
h₊ + h₋, which stays in the mirror; the shift of a₂ is linear in h₊ − h₋, which changes its sign. So a pose
and its mirror image have the same ‖z‖.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from simrecon import resources
from simrecon.errors import SimreconError
from simrecon.types import Array

SCHEMA = "simrecon.flow/1"
SIZE, HALF, SYMMETRIC = 48, 24, 11
"""Coordinates; those of a half; those of a half that stay in the mirror, which come first."""
_ROWS = 256
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
    """What the gradient of one layer needs: y, pre-activations of h±, raw log scales, exp(α)."""

    y: Weights
    plus: Weights
    minus: Weights
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

    def latent(self, joints: Array) -> Array:
        """Latent codes (..., 48) of joint quaternions (..., 16, 4), eq. 4; single precision."""
        q = joints.astype(np.float32)
        sine = np.sqrt(np.einsum("...i,...i->...", q[..., 1:], q[..., 1:]))  # of half the angle
        half = np.arctan2(sine, np.abs(q[..., 0]))
        scale = np.copysign(2 * half, q[..., 0]) / np.maximum(sine, np.float32(1e-12))
        rotvecs = np.where(sine > 1e-6, scale, np.float32(2))[..., None] * q[..., 1:]
        return self.code(rotvecs)

    def code(self, rotvecs: NDArray[np.floating]) -> Array:
        """Latent codes (..., 48) of rotation vectors (..., 16, 3), in their precision."""
        flat = rotvecs.reshape(-1, SIZE)
        z = np.empty((len(flat), SIZE), flat.dtype)
        for i in range(0, len(flat), _ROWS):
            z[i : i + _ROWS] = self._run(flat[i : i + _ROWS])[0]
        return z.reshape(*rotvecs.shape[:-2], SIZE).astype(np.float64)

    def squared(self, rotvecs: Array) -> tuple[Array, Array]:
        """‖z‖² (...) of rotation vectors (..., 16, 3) and its gradient, (..., 16, 3)."""
        flat = rotvecs.reshape(-1, SIZE)
        trace: list[_Trace] = []
        z, _ = self._run(flat, trace)
        gradient = np.asarray(self._back(trace, 2 * z, np.zeros(len(z))), np.float64)
        return np.asarray(np.sum(z**2, axis=-1), np.float64).reshape(rotvecs.shape[:-2]), gradient.reshape(
            rotvecs.shape
        )

    def log_likelihood(self, rotvecs: Array) -> tuple[Array, Array]:
        """Log density (...) over rotation vectors (..., 16, 3), per rad⁴⁸, and its gradient, (..., 16, 3)."""
        trace: list[_Trace] = []
        z, volume = self._run(rotvecs.reshape(-1, SIZE), trace)
        value = np.asarray(volume - 0.5 * np.sum(z**2, axis=-1) - 0.5 * SIZE * np.log(2 * np.pi), np.float64)
        gradient = np.asarray(self._back(trace, -z, np.ones(len(z))), np.float64)
        return value.reshape(rotvecs.shape[:-2]), gradient.reshape(rotvecs.shape)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Rotation vectors (count, 16, 3) of random poses."""
        return self.pose(rng.standard_normal((count, SIZE)))

    def pose(self, z: Array) -> Array:
        """Rotation vectors (..., 16, 3) of latent codes (..., 48): the inverse of `code`."""
        x = z.reshape(-1, SIZE)
        for layer, inverse in zip(reversed(self.layers), reversed(self._inverses), strict=True):
            given = x[:, :HALF]
            raw, shift, _, _ = self._network(layer, given)
            y = np.concatenate((given, (x[:, HALF:] - shift) / np.exp(self._log_scale(raw))), axis=1)
            x = y @ inverse.T
        return (x + self.mean_rad).reshape(*z.shape[:-1], 16, 3)

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

    def _run(self, flat: Weights, trace: list[_Trace] | None = None) -> tuple[Weights, Weights]:
        """Codes (N, 48) and log determinants (N,) of poses (N, 48); appends each layer's trace."""
        single = flat.dtype == np.float32
        x = flat - self.mean_rad.astype(flat.dtype)
        volume = np.full(len(flat), self._volume, flat.dtype)
        for layer in self._single if single else self.layers:
            y = x @ layer.linear.T  # (N, 48)
            raw, shift, plus, minus = self._network(layer, y[:, :HALF])
            log_scale = self._log_scale(raw)  # (N, 24)
            scale = np.exp(log_scale)
            volume += log_scale.sum(axis=1)
            x = np.empty_like(y)
            x[:, :HALF] = y[:, :HALF]
            np.multiply(y[:, HALF:], scale, out=x[:, HALF:])
            x[:, HALF:] += shift
            if trace is not None:
                trace.append(_Trace(y, plus, minus, raw, scale))
        return x, volume

    def _network(self, layer: Layer, given: Weights) -> tuple[Weights, Weights, Weights, Weights]:
        """Raw log scales (N, 24), shifts (N, 24) and pre-activations (N, H) twice from one half (N, 24)."""
        stay = given[:, :SYMMETRIC] @ layer.stay.T  # (N, H)
        stay += layer.bias
        turn = given[:, SYMMETRIC:] @ layer.turn.T  # (N, H)
        plus, minus = stay + turn, stay - turn
        above, below = np.abs(plus, out=stay), np.abs(minus, out=turn)
        above += 1
        below += 1
        np.divide(plus, above, out=above)
        np.divide(minus, below, out=below)
        even = (above + below) @ layer.even.T + layer.even_bias  # (N, 35)
        above -= below
        odd = above @ layer.odd.T  # (N, 13)
        return even[:, :HALF], np.concatenate((even[:, HALF:], odd), axis=1), plus, minus

    def _log_scale(self, raw: Weights) -> Weights:
        return raw / (1 + np.abs(raw) / self.bound)

    def _back(self, trace: list[_Trace], d_code: Weights, d_volume: Array) -> Weights:
        """Gradient (N, 48) by the pose from those by the code (N, 48) and the log determinant (N,)."""
        d = d_code
        for layer, kept in zip(reversed(self.layers), reversed(trace), strict=True):
            d_moved = d[:, HALF:]
            d_log_scale = d_moved * kept.y[:, HALF:] * kept.scale + d_volume[:, None]  # (N, 24)
            d_raw = d_log_scale / (1 + np.abs(kept.raw) / self.bound) ** 2
            d_even = np.concatenate((d_raw, d_moved[:, :SYMMETRIC]), axis=1) @ layer.even  # (N, H)
            d_odd = d_moved[:, SYMMETRIC:] @ layer.odd
            d_plus = (d_even + d_odd) / (1 + np.abs(kept.plus)) ** 2
            d_minus = (d_even - d_odd) / (1 + np.abs(kept.minus)) ** 2
            d_y = np.empty_like(d)
            d_y[:, :SYMMETRIC] = d[:, :SYMMETRIC] + (d_plus + d_minus) @ layer.stay
            d_y[:, SYMMETRIC:HALF] = d[:, SYMMETRIC:HALF] + (d_plus - d_minus) @ layer.turn
            d_y[:, HALF:] = d_moved * kept.scale
            d = d_y @ layer.linear
        return d


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
