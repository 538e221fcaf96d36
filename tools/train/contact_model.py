"""Networks that say what touches, their training, and their weights for numpy (PyTorch, extra `train`)."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from simrecon.types import Array, Flags

RATE, DECAY, NOISE, BATCH, PATIENCE = 1e-4, 1e-4, 0.005, 256, 4


@dataclass(frozen=True)
class Data:
    """Inputs (n, inputs), labels (n, outputs) of 0 and 1, and which inputs are places, which get noise."""

    inputs: torch.Tensor
    labels: torch.Tensor
    places: torch.Tensor

    @classmethod
    def of(cls, inputs: Array, labels: Array | Flags, places: Array) -> Data:
        """From arrays."""
        return cls(
            torch.as_tensor(np.asarray(inputs, np.float32)),
            torch.as_tensor(np.asarray(labels, np.float32)),
            torch.as_tensor(np.asarray(places, np.float32)),
        )


def network(sizes: Sequence[int], dropout_before: int, dropout: float = 0.3) -> nn.Sequential:
    """An MLP as Rempe 2020, A.2: batch normalisation behind all layers but the last, one dropout layer.

    Args:
        sizes: of the inputs and of each layer.
        dropout_before: number of the layer, from 1 on, that the dropout stands before.
        dropout: share that is dropped.
    """
    layers: list[nn.Module] = []
    last = len(sizes) - 1
    for i in range(1, len(sizes)):
        if i == dropout_before:
            layers.append(nn.Dropout(dropout))
        layers.append(nn.Linear(sizes[i - 1], sizes[i]))
        if i < last:
            layers += [nn.BatchNorm1d(sizes[i]), nn.ReLU()]
    return nn.Sequential(*layers)


def train(
    net: nn.Sequential, data: Data, check: Data, *, seed: int, epochs: int, rate: float = RATE
) -> list[float]:
    """Adam on binary cross-entropy, stopped early by the loss of the validation part; the best is kept.

    Args:
        net: to be trained.
        data: to train on.
        check: the validation part.
        seed: of the order and the noise.
        epochs: at most.
        rate: of learning.

    Returns:
        The validation loss after each epoch.
    """
    generator = torch.Generator().manual_seed(seed)
    optimiser = torch.optim.Adam(net.parameters(), lr=rate, weight_decay=DECAY)
    cost = nn.BCEWithLogitsLoss()
    losses: list[float] = []
    best = copy.deepcopy(net.state_dict())
    for _ in range(epochs):
        net.train()
        order = torch.randperm(len(data.inputs), generator=generator)
        for rows in order.split(BATCH):
            if len(rows) < 2:
                continue
            clean = data.inputs[rows]
            noise = NOISE * torch.randn(clean.shape, generator=generator)
            optimiser.zero_grad()
            cost(net(clean + noise * data.places), data.labels[rows]).backward()
            optimiser.step()
        net.eval()
        with torch.no_grad():
            losses.append(float(cost(net(check.inputs), check.labels)))
        if losses[-1] == min(losses):
            best = copy.deepcopy(net.state_dict())
        if len(losses) - 1 - int(np.argmin(losses)) >= PATIENCE:
            break
    net.load_state_dict(best)
    net.eval()
    return losses


def logits(net: nn.Sequential, inputs: Array) -> Array:
    """Outputs before the sigmoid, (n, outputs)."""
    with torch.no_grad():
        out = net(torch.as_tensor(np.asarray(inputs, np.float32)))
    return np.asarray(out.numpy(), np.float64)


def folded(net: nn.Sequential) -> list[tuple[Array, Array]]:
    """Weights (out, in) and biases (out,) of the layers, with batch normalisation inside them."""
    layers: list[tuple[Array, Array]] = []
    for module in net:
        if isinstance(module, nn.Linear):
            layers.append((module.weight.detach().double().numpy(), module.bias.detach().double().numpy()))
        elif isinstance(module, nn.BatchNorm1d):
            weight, bias = layers[-1]
            gain = (module.weight / torch.sqrt(module.running_var + module.eps)).detach().double().numpy()
            shift = module.bias.detach().double().numpy() - gain * module.running_mean.double().numpy()
            layers[-1] = (gain[:, None] * weight, gain * bias + shift)
    return layers


def calibrated(scores: Array, labels: Flags, steps: int = 200) -> tuple[Array, Array]:
    """Gain and offset of each output that make its sigmoid a probability (Platt scaling), (outputs,) each."""
    x, y = torch.as_tensor(scores), torch.as_tensor(np.asarray(labels, np.float64))
    gain = torch.ones(x.shape[1], dtype=torch.double, requires_grad=True)
    offset = torch.zeros(x.shape[1], dtype=torch.double, requires_grad=True)
    optimiser = torch.optim.LBFGS([gain, offset], max_iter=steps)

    def closure() -> torch.Tensor:
        optimiser.zero_grad()
        loss = nn.functional.binary_cross_entropy_with_logits(gain * x + offset, y)
        loss = loss + 1e-3 * ((gain - 1) ** 2 + offset**2).mean()
        loss.backward()
        return loss

    optimiser.step(closure)
    return gain.detach().numpy(), offset.detach().numpy()
