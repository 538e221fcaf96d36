"""The network that predicts futures: a conditional VAE, and learned samples of its codes.

The decoder p(y | x, z) is that of Yuan & Kitani 2020 (DLow), the cVAE of Xie 2021, section 3.4. A GRU reads
the context x; from its last state h_x that of the decoder's GRU begins, d_0 = tanh(W h_x + b). Frame by frame

    d_t = GRU([h_x, z, y_{t-1}], d_{t-1}),    y_t = y_{t-1} + O(d_t)

with y_0 the last frame of x and O two layers. (The paper's decoder gives y_t itself.) DLow's sampling
Q(x, ε) maps one draw ε ~ N(0, I) to K codes, one for each mode of the future (eq. 5 there, A_k diagonal):

    z_k = A_k(x) ε + b_k(x)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon.synthesis.features import FUTURE
from simrecon.types import Array

Single = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Dense:
    """A layer: weight (out, in), bias (out,)."""

    weight: Single
    bias: Single

    def __call__(self, inputs: Single) -> Single:
        """Outputs (B, out) of inputs (B, in)."""
        return np.asarray(inputs @ self.weight.T + self.bias)


@dataclass(frozen=True, eq=False)
class Gru:
    """A gated recurrent unit; reset, update and new gate one below the other, as PyTorch has them.

    Attributes:
        input_weight: (3H, in); hidden_weight: (3H, H); input_bias, hidden_bias: (3H,).
    """

    input_weight: Single
    hidden_weight: Single
    input_bias: Single
    hidden_bias: Single

    def step(self, inputs: Single, state: Single) -> Single:
        """The next state (B, H) of inputs (B, in) and a state (B, H)."""
        given = np.split(inputs @ self.input_weight.T + self.input_bias, 3, axis=1)
        kept = np.split(state @ self.hidden_weight.T + self.hidden_bias, 3, axis=1)
        reset, update = _sigmoid(given[0] + kept[0]), _sigmoid(given[1] + kept[1])
        new = np.tanh(given[2] + reset * kept[2])
        return np.asarray((1 - update) * new + update * state)

    def last(self, sequence: Single) -> Single:
        """The state (B, H) after a sequence (B, T, in)."""
        state = np.zeros((len(sequence), self.hidden_weight.shape[1]), np.float32)
        for inputs in np.moveaxis(sequence, 1, 0):
            state = self.step(inputs, state)
        return state


@dataclass(frozen=True, eq=False)
class Network:
    """Weights for D features, states of H, codes of Z, and K modes.

    Attributes:
        mean, spread: (D,) of the features of the training motions, by which inputs are scaled.
        context: reads x; begin: first state of the decoder; decoder: GRU; hidden, out: O.
        choose, chosen: GRU and layer that read x for the sampling; factors, centres: A (K Z) and b (K Z).
    """

    mean: Single
    spread: Single
    context: Gru
    begin: Dense
    decoder: Gru
    hidden: Dense
    out: Dense
    choose: Gru
    chosen: Dense
    factors: Dense
    centres: Dense

    @property
    def code(self) -> int:
        """Z."""
        return int(self.decoder.input_weight.shape[1] - self.context.hidden_weight.shape[1] - len(self.mean))

    @property
    def modes(self) -> int:
        """K."""
        return len(self.centres.bias) // self.code

    def decode(self, context: Array, codes: Array, frames: int = FUTURE) -> Array:
        """Futures (B, F, D) of a context.

        Args:
            context: (T, D) features.
            codes: (B, Z).
            frames: F.
        """
        before = np.asarray(context, np.float32)
        read = self.context.last(self._scaled(before)[None])  # (1, H)
        state = np.repeat(np.tanh(self.begin(read)), len(codes), axis=0)
        fixed = np.concatenate((np.repeat(read, len(codes), axis=0), np.asarray(codes, np.float32)), axis=1)
        frame, made = np.repeat(before[-1:], len(codes), axis=0), []
        for _ in range(frames):
            state = self.decoder.step(np.concatenate((fixed, self._scaled(frame)), axis=1), state)
            frame = frame + self.out(np.maximum(self.hidden(state), 0.0))
            made.append(frame)
        return np.stack(made, axis=1).astype(np.float64)

    def codes(self, context: Array, noise: Array) -> Array:
        """One code for each mode, (K, Z), of a context (T, D) and a draw ε (Z,)."""
        read = self.choose.last(self._scaled(np.asarray(context, np.float32))[None])
        inner = np.maximum(self.chosen(read), 0.0)
        shape = (self.modes, self.code)
        factors, centres = (layer(inner).reshape(shape) for layer in (self.factors, self.centres))
        return np.asarray(factors * np.asarray(noise, np.float32) + centres, np.float64)

    def sample(self, context: Array, count: int, rng: np.random.Generator) -> Array:
        """Futures (S, F, D): of each mode in turn, and for more than there are modes with another draw.

        Args:
            context: (T, D) features.
            count: S.
            rng: draws ε.
        """
        draws = -(-count // self.modes)
        codes = [self.codes(context, rng.standard_normal(self.code)) for _ in range(draws)]
        return self.decode(context, np.concatenate(codes)[:count])

    def _scaled(self, values: Single) -> Single:
        return np.asarray((values - self.mean) / self.spread)


def _sigmoid(values: Single) -> Single:
    return np.asarray(1 / (1 + np.exp(-np.clip(values, -40, 40))))
