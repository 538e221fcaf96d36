"""Constants of CMA-ES: how fast it learns, by number of variables and population.

Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv 1604.00772, whose equation numbers stand
at the lines that implement them; for the diagonal variant R. Ros and N. Hansen, "A Simple Modification in
CMA-ES Achieving Linear Time and Space Complexity", PPSN 2008. Axes: P samples of a generation, n variables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simrecon.optim import covariance as shapes
from simrecon.optim.covariance import Covariance
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class Strategy:
    """Constants of the strategy, tutorial table 1.

    Attributes:
        weights: (P,) by rank, best first; the negative ones make the covariance update active.
        mu: number of samples that move the mean.
        mu_eff: variance-effective selection mass of those.
        c_sigma, d_sigma: learning rate and damping of the step size.
        c_c, c_1, c_mu: learning rates of the path, the rank-one and the rank-mu update.
        chi_n: expected length of an n-variate standard normal vector.
    """

    weights: Array
    mu: int
    mu_eff: float
    c_sigma: float
    d_sigma: float
    c_c: float
    c_1: float
    c_mu: float
    chi_n: float


def strategy(n: int, population: int, covariance: Covariance) -> Strategy:
    """Default constants, tutorial eq. 49 to 58.

    Diagonal rates are those of Ros and Hansen 2008. Those of low rank fall with its n (k + 2) numbers, as in
    Y. Akimoto and N. Hansen, "Online Model Selection for Restricted Covariance Matrix Adaptation",
    PPSN 2016, with the 1/4 of eq. 58, without which two samples teach nothing.

    Args:
        n: number of variables.
        population: samples of a generation.
        covariance: `diagonal` learns c_1 and c_mu (n + 2) / 3 times as fast as `full`.
    """
    raw = math.log((population + 1) / 2) - np.log(np.arange(1, population + 1))  # (P,) eq. 49
    mu = population // 2
    mu_eff = float(raw[:mu].sum() ** 2 / (raw[:mu] ** 2).sum())  # table 1
    mu_eff_negative = float(raw[mu:].sum() ** 2 / (raw[mu:] ** 2).sum())  # table 1
    faster = (n + 2) / 3 if covariance == "diagonal" else 1.0
    c_1 = faster * 2 / ((n + 1.3) ** 2 + mu_eff)  # eq. 57
    c_mu = min(1 - c_1, faster * 2 * (0.25 + mu_eff + 1 / mu_eff - 2) / ((n + 2) ** 2 + mu_eff))  # eq. 58
    c_c = (4 + mu_eff / n) / (n + 4 + 2 * mu_eff / n)  # eq. 56
    if covariance == "low_rank":
        size = (n + 2) * (shapes.rank(n) + 2)
        c_1 = 2 / (size + mu_eff)
        size += 2 * (shapes.rank(n) + 2)
        c_mu = min(1 - c_1, 2 * (0.25 + mu_eff + 1 / mu_eff - 2) / (size + mu_eff))
        c_c = math.sqrt(c_1)
    alpha = min(1 + c_1 / c_mu, 1 + 2 * mu_eff_negative / (mu_eff + 2))  # eq. 50, 51
    if covariance == "full":
        alpha = min(alpha, (1 - c_1 - c_mu) / (n * c_mu))  # eq. 52
    positive, negative = raw[raw > 0].sum(), -raw[raw < 0].sum()
    c_sigma = (mu_eff + 2) / (n + mu_eff + 5)  # eq. 55
    return Strategy(
        weights=np.where(raw >= 0, raw / positive, raw * (alpha / negative)),  # (P,) eq. 53
        mu=mu,
        mu_eff=mu_eff,
        c_sigma=c_sigma,
        d_sigma=1 + 2 * max(0.0, math.sqrt((mu_eff - 1) / (n + 1)) - 1) + c_sigma,  # eq. 55
        c_c=c_c,
        c_1=c_1,
        c_mu=c_mu,
        chi_n=math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n)),  # below eq. 44
    )
