"""Training of the synthesis: first the conditional VAE, then DLow's sampling (Yuan & Kitani 2020).

The VAE lowers Σ_t ‖y_t − ŷ_t‖² + β KL(q(z | x, y) ‖ N(0, I)). With its decoder fixed, the sampling lowers for
the K futures of one draw, with the squared distance D² of two futures,

    λ_r min_k D²(ŷ_k, y) + λ_d mean_{i<j} exp(−D²(ŷ_i, ŷ_j) / σ_d) + λ_k mean_k KL(N(b_k, A_k²) ‖ N(0, I))

(eq. 10 to 13 there). The weights are those of its experiments on Human3.6M; σ_d by the number of frames.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from tools.train.synthesis_data import Windows
from tools.train.synthesis_model import CODE, MODES, Model

SPREAD_MIN = 0.02
"""Of a feature; those that hardly vary are not blown up."""


@dataclass(frozen=True)
class Settings:
    """Of a training; what it depends on beside the data and the seed."""

    steps: int = 900
    batch: int = 32
    rate: float = 1e-3
    beta: float = 0.1
    sampling_steps: int = 250
    sampling_batch: int = 16
    sampling_rate: float = 1e-3
    reconstruction: float = 2.0
    diversity: float = 25.0
    diversity_scale: float = 60.0
    likelihood: float = 1.0
    clip: float = 1.0


Say = Callable[[str], None]


def train(data: Windows, seed: int, settings: Settings, say: Say = lambda _: None) -> Model:
    """Train both stages on windows; same seed, same weights on one machine."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    seen = np.concatenate((data.context, data.future), axis=1).reshape(-1, data.context.shape[-1])
    model = Model(seen.mean(axis=0), np.maximum(seen.std(axis=0), SPREAD_MIN))
    tensors = tuple(
        torch.tensor(part, dtype=torch.float32) for part in (data.context, data.future, data.there)
    )
    _vae(model, tensors, rng, settings, say)
    _sampling(model, tensors, rng, settings, say)
    return model


Data = tuple[Tensor, Tensor, Tensor]


def _drawn(data: Data, count: int, rng: np.random.Generator) -> Data:
    rows = torch.from_numpy(rng.integers(0, len(data[0]), count))
    context, future, there = (part[rows] for part in data)
    return context, future, there


def _vae(model: Model, data: Data, rng: np.random.Generator, settings: Settings, say: Say) -> None:
    parts = (
        model.context,
        model.begin,
        model.decoder,
        model.hidden,
        model.out,
        model.future,
        model.posterior,
    )
    weights = [weight for part in parts for weight in part.parameters()]
    descent = _Descent(weights, settings.rate, settings.steps, settings.clip)
    for step in range(settings.steps):
        context, future, there = _drawn(data, settings.batch, rng)
        read = model.read(context)
        mean, log_variance = model.encode(read, future, there)
        codes = mean + torch.exp(0.5 * log_variance) * torch.randn_like(mean)
        made = model.decode(read, context[:, -1], codes)
        error = (((made - future) ** 2).sum(dim=2) * there).sum(dim=1).mean()
        divergence = 0.5 * (mean**2 + log_variance.exp() - 1 - log_variance).sum(dim=1).mean()
        descent(error + settings.beta * divergence)
        if step % 200 == 0:
            say(f"vae {step}: error {error.item():.3f}, divergence {divergence.item():.2f}")


def _sampling(model: Model, data: Data, rng: np.random.Generator, settings: Settings, say: Say) -> None:
    model.requires_grad_(False)
    weights = []
    for part in (model.choose, model.chosen, model.factors, model.centres):
        part.requires_grad_(True)
        weights += list(part.parameters())
    descent = _Descent(weights, settings.sampling_rate, settings.sampling_steps, settings.clip)
    one, other = torch.triu_indices(MODES, MODES, 1)
    for step in range(settings.sampling_steps):
        context, future, there = _drawn(data, settings.sampling_batch, rng)
        factors, centres = model.modes(context)
        codes = factors * torch.randn(len(context), 1, CODE) + centres
        read, last = (_repeated(part) for part in (model.read(context), context[:, -1]))
        made = model.decode(read, last, codes.reshape(-1, CODE))
        made = made.reshape(len(context), MODES, -1) * _flat(there, made.shape[-1])
        error = (
            ((made - (future * there[..., None]).reshape(len(future), 1, -1)) ** 2)
            .sum(dim=2)
            .min(1)[0]
            .mean()
        )
        apart = ((made[:, one] - made[:, other]) ** 2).sum(dim=2)
        alike = torch.exp(-apart / settings.diversity_scale).mean()
        variance = factors**2 + 1e-8
        divergence = 0.5 * (variance + centres**2 - 1 - torch.log(variance)).sum(dim=2).mean()
        loss = settings.reconstruction * error + settings.diversity * alike + settings.likelihood * divergence
        descent(loss)
        if step % 100 == 0:
            figures = (
                f"error {error.item():.3f}, alike {alike.item():.3f}, divergence {divergence.item():.2f}"
            )
            say(f"sampling {step}: {figures}")
    model.requires_grad_(True)


def _repeated(values: Tensor) -> Tensor:
    return values.repeat_interleave(MODES, dim=0)


def _flat(there: Tensor, features: int) -> Tensor:
    """(B, 1, F·D) of (B, F)."""
    return there[:, None, :, None].expand(-1, 1, -1, features).reshape(len(there), 1, -1)


class _Descent:
    """Adam with a rate that falls along a cosine, and gradients that are cut."""

    def __init__(self, weights: list[Tensor], rate: float, steps: int, clip: float) -> None:
        self._weights, self._clip = weights, clip
        self._adam = torch.optim.Adam(weights, rate)
        self._rate = torch.optim.lr_scheduler.CosineAnnealingLR(self._adam, steps)

    def __call__(self, loss: Tensor) -> None:
        self._adam.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self._weights, self._clip)
        self._adam.step()
        self._rate.step()
