"""Coupling layers of the flow (the formulas are in `flow`): poses to codes, and gradients back.

Arrays have poses in columns: (48, N) for N poses, in their own precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array

SIZE, HALF, SYMMETRIC = 48, 24, 11
"""Coordinates; those of a half; those of a half that stay in the mirror, which come first."""

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
class Trace:
    """What the gradient of one layer needs, (..., N): y, h₊ + h₋, h₊ − h₋, raw log scales, exp(α)."""

    y: Weights
    total: Weights
    difference: Weights
    raw: Weights
    scale: Weights


def forward(layers: Sequence[Layer], bound: float, x: Weights, trace: list[Trace] | None = None) -> Weights:
    """Codes of poses.

    Args:
        layers: K of them, in the precision of `x`.
        bound: of log scales.
        x: (48, N) poses about the mean; overwritten.
        trace: gets one entry per layer, if not None.

    Returns:
        (48, N) codes.
    """
    for layer in layers:
        y = layer.linear @ x  # (48, N)
        even, odd, total, difference = _network(layer, y[:HALF])
        scale = log_scale(even[:HALF], bound)  # (24, N)
        np.exp(scale, out=scale)
        x[:HALF] = y[:HALF]
        np.multiply(y[HALF:], scale, out=x[HALF:])
        x[HALF : HALF + SYMMETRIC] += even[HALF:]
        x[HALF + SYMMETRIC :] += odd
        if trace is not None:
            trace.append(Trace(y, total, difference, even[:HALF], scale))
    return x


def backward(
    layers: Sequence[Layer], bound: float, trace: Sequence[Trace], d_code: Weights, d_volume: float
) -> Array:
    """Gradient (N, 48) by the pose from those by the code (48, N) and the log determinant."""
    d = d_code
    for layer, kept in zip(reversed(layers), reversed(trace), strict=True):
        d_moved = d[HALF:]
        d_log_scale = d_moved * kept.y[HALF:] * kept.scale + d_volume  # (24, N)
        d_raw = d_log_scale / (1 + np.abs(kept.raw) / bound) ** 2
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


def inverse(layer: Layer, bound: float, x: Weights) -> Weights:
    """Y (48, N) of a layer from its output x (48, N)."""
    even, odd, _, _ = _network(layer, x[:HALF])
    shift = np.concatenate((even[HALF:], odd))  # (24, N)
    moved = (x[HALF:] - shift) / np.exp(log_scale(even[:HALF], bound))
    return np.concatenate((x[:HALF], moved))


def log_scale(raw: Weights, bound: float) -> Weights:
    """Log scales α = r / (1 + |r| / bound) of raw ones r, of any shape."""
    scale = np.abs(raw)
    scale *= 1 / bound
    scale += 1
    return np.divide(raw, scale, out=scale)


def _network(layer: Layer, first: Weights) -> tuple[Weights, Weights, Weights, Weights]:
    """By y₁ (24, N): raw α and shift of s₂ (35, N), shift of a₂ (13, N), h₊ + h₋ and h₊ − h₋ (H, N)."""
    stay = layer.stay @ first[:SYMMETRIC]  # (H, N)
    stay += layer.bias[:, None]
    turn = layer.turn @ first[SYMMETRIC:]  # (H, N)
    plus = stay + turn
    stay -= turn
    np.tanh(plus, out=plus)
    np.tanh(stay, out=stay)
    difference = np.subtract(plus, stay, out=turn)
    plus += stay
    even = layer.even @ plus
    even += layer.even_bias[:, None]
    return even, layer.odd @ difference, plus, difference
