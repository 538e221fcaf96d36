"""The network of `simrecon.synthesis.network` as PyTorch modules, with what only training needs.

The posterior q(z | x, y) is a GRU that reads the future y; from its last state and that of the context, a
layer gives mean and deviation of the code (Yuan & Kitani 2020, section 5).
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from simrecon.synthesis.features import COUNT, FUTURE
from simrecon.synthesis.network import Dense, Gru, Network, Single
from simrecon.types import Array

STATE, CODE, MODES = 96, 16, 10
GATES = 2 * STATE
"""Reset and update gate of a GRU; the new one follows them."""
OUT_SCALE = 0.05
"""Of the last layer in the beginning: the person stands still, nearly."""


class Model(nn.Module):
    """Decoder, posterior and sampling; names are those of `Network`."""

    def __init__(self, mean: Array, spread: Array) -> None:
        """Untrained; mean and spread (COUNT,) of the features."""
        super().__init__()
        self.register_buffer("mean", torch.tensor(mean, dtype=torch.float32))
        self.register_buffer("spread", torch.tensor(spread, dtype=torch.float32))
        self.context = nn.GRU(COUNT, STATE, batch_first=True)
        self.begin = nn.Linear(STATE, STATE)
        self.decoder = nn.GRUCell(STATE + CODE + COUNT, STATE)
        self.hidden, self.out = nn.Linear(STATE, STATE), nn.Linear(STATE, COUNT)
        self.future = nn.GRU(COUNT, STATE, batch_first=True)
        self.posterior = nn.Sequential(nn.Linear(2 * STATE, STATE), nn.ReLU(), nn.Linear(STATE, 2 * CODE))
        self.choose = nn.GRU(COUNT, STATE, batch_first=True)
        self.chosen = nn.Linear(STATE, STATE)
        self.factors, self.centres = nn.Linear(STATE, MODES * CODE), nn.Linear(STATE, MODES * CODE)
        with torch.no_grad():
            self.out.weight.mul_(OUT_SCALE)
            self.out.bias.zero_()

    def scaled(self, values: Tensor) -> Tensor:
        """Features as the GRUs read them."""
        return (values - self.mean) / self.spread

    def read(self, context: Tensor) -> Tensor:
        """State h_x (B, STATE) of contexts (B, T, COUNT)."""
        return self.context(self.scaled(context))[1][0]

    def encode(self, read: Tensor, future: Tensor, there: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and logarithm of the variance (B, CODE) of the code of futures (B, F, COUNT)."""
        last = there.sum(dim=1).long() - 1
        state = self.future(self.scaled(future))[0][torch.arange(len(last)), last]
        mean, log_variance = self.posterior(torch.cat((read, state), dim=1)).chunk(2, dim=1)
        return mean, log_variance.clamp(-8.0, 4.0)

    def decode(self, read: Tensor, last: Tensor, codes: Tensor, frames: int = FUTURE) -> Tensor:
        """Futures (B, F, COUNT) after last frames (B, COUNT), with codes (B, CODE)."""
        cell, fixed = self.decoder, torch.cat((read, codes), dim=1)
        always, moving = cell.weight_ih.split((fixed.shape[1], COUNT), dim=1)
        begun = torch.addmm(cell.bias_ih, fixed, always.T)  # of the inputs that stay
        state, frame, made = torch.tanh(self.begin(read)), last, []
        for _ in range(frames):
            given = torch.addmm(begun, self.scaled(frame), moving.T)
            kept = torch.addmm(cell.bias_hh, state, cell.weight_hh.T)
            reset, update = torch.sigmoid(given[:, :GATES] + kept[:, :GATES]).chunk(2, dim=1)
            new = torch.tanh(torch.addcmul(given[:, GATES:], reset, kept[:, GATES:]))
            state = torch.lerp(new, state, update)
            frame = frame + self.out(torch.relu(self.hidden(state)))
            made.append(frame)
        return torch.stack(made, dim=1)

    def modes(self, context: Tensor) -> tuple[Tensor, Tensor]:
        """A and b (B, MODES, CODE) of contexts (B, T, COUNT)."""
        inner = torch.relu(self.chosen(self.choose(self.scaled(context))[1][0]))
        shape = (len(context), MODES, CODE)
        return self.factors(inner).reshape(shape), self.centres(inner).reshape(shape)

    def network(self) -> Network:
        """What runs without PyTorch, in the half precision of its file."""
        return Network(
            mean=self.mean.numpy(),
            spread=self.spread.numpy(),
            context=_gru(self.context),
            begin=_dense(self.begin),
            decoder=_gru(self.decoder),
            hidden=_dense(self.hidden),
            out=_dense(self.out),
            choose=_gru(self.choose),
            chosen=_dense(self.chosen),
            factors=_dense(self.factors),
            centres=_dense(self.centres),
        )


def _half(weights: Tensor) -> Single:
    return np.asarray(weights.detach().numpy().astype(np.float16), np.float32)


def _dense(layer: nn.Linear) -> Dense:
    return Dense(_half(layer.weight), _half(layer.bias))


def _gru(module: nn.GRU | nn.GRUCell) -> Gru:
    suffix = "_l0" if isinstance(module, nn.GRU) else ""
    names = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
    return Gru(*(_half(getattr(module, f"{name}{suffix}")) for name in names))
