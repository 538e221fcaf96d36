"""The sections of a plan, each with the range of its values."""

from __future__ import annotations

import math
from dataclasses import dataclass

from simrecon.io.tables import choice, number
from simrecon.optim.covariance import Covariance

PRIORS = ("gaussian", "flow")
"""Names of the pose priors in `simrecon.prior`."""
CONTACTS = ("rules", "network")
"""Names of what tells contacts in `simrecon.contact`."""
SOLES = ("edges", "rolling")
"""Where a foot may bear in fit and plan: at the corners of its box, or at a round heel and a round ball."""
PLANNERS = ("none", "soft_contact", "centroidal")
"""Names of the planners in `simrecon.planners`."""
STRENGTHS = ("usual", "trained")
"""Names of the torque limits in models/body/strength.toml."""


@dataclass(frozen=True)
class Simulation:
    """`[simulation]`: the time step is the largest integer fraction of the frame interval up to this."""

    timestep_max_s: float = number(1e-4, 0.05)
    strength: str = choice(*STRENGTHS)


@dataclass(frozen=True)
class WindowPlan:
    """`[window]`: length, what it shares with the next one, and the distance of the spline's knots."""

    length_s: float = number(0.02, 60.0)
    overlap_s: float = number(0.0, 60.0)
    knot_spacing_s: float = number(0.005, 10.0)

    @property
    def commit_s(self) -> float:
        """The part that is kept."""
        return self.length_s - self.overlap_s


@dataclass(frozen=True, kw_only=True)
class Optimiser:
    """`[optimiser]`: descents, CMA-ES and when they stop; a `tol_*` of 0 switches it off."""

    covariance: Covariance
    population: int = number(4, 100_000)
    generations: int = number(0, 1_000_000)
    draft_steps: int = number(0, 1000)
    starts: int = number(1, 64, default=1)
    descent_steps: int = number(0, 1000)
    spread: float = number(1e-6, 1e6)
    sigma_rad: float = number(1e-6, math.pi)
    bound_rad: float = number(1e-6, 2 * math.pi)
    start_pose: float = number(0.0, 1.0)
    start_velocity: float = number(0.0, 10.0)
    tol_loss: float = number(0.0)
    tol_loss_absolute: float = number(0.0, default=0.0)
    tol_sigma: float = number(0.0)
    draws: int = number(0, 10_000, default=0)


@dataclass(frozen=True)
class Recovery:
    """`[recovery]`: how far from the kinematic fit is a fall, 0 = anything goes; how often to try again.

    A window with a loss above `doubt_loss`, and above `doubt` times that of the window before, is solved once
    more, from that window on; 0 = never.
    """

    corridor_m: float = number(0.0, 100.0)
    retries: int = number(0, 10)
    doubt: float = number(0.0, 1e6, default=0.0)
    doubt_loss: float = number(0.0, 1e9, default=0.0)


@dataclass(frozen=True, kw_only=True)
class LossWeights:
    """`[loss]`: weights of the loss of a rollout; 0 switches a term off, as those are that may be left out.

    Each has the name of its term in `simrecon.engines.sampling.terms`; what the papers lack is optional.
    """

    com_position: float = number(0.0)
    com_velocity: float = number(0.0)
    pose: float = number(0.0)
    reprojection: float = number(0.0)
    prior: float = number(0.0)
    total_variation: float = number(0.0)
    joint_limit: float = number(0.0)
    landmark: float = number(0.0, default=0.0)
    landmark_velocity: float = number(0.0, default=0.0)
    planted: float = number(0.0, default=0.0)
    wished: float = number(0.0, default=5000.0)
    borne: float = number(0.0, default=300.0)
    force: float = number(0.0, default=0.0)
    moment: float = number(0.0, default=0.0)
    prior_model: str = choice(*PRIORS)
    prior_rate_hz: float = number(0.1, 1000.0)
    rate_hz: float = number(1.0, 1000.0)


@dataclass(frozen=True)
class Kinematics:
    """`[kinematics]`: what the kinematic fit does, weights and scales of its loss, most evaluations of it.

    The first four are the letters S, O, G and T of Gärtner 2022, table 2.
    """

    shape: bool
    poses: bool
    ground: bool
    temporal: bool
    seed_frames: int = number(0, 1_000_000)
    keypoint: float = number(0.0)
    keypoint_scale_px: float = number(1e-3, 1e4)
    joint: float = number(0.0)
    joint_scale_m: float = number(1e-4, 10.0)
    place: float = number(0.0)
    place_scale_m: float = number(1e-4, 100.0)
    smooth_com: float = number(0.0)
    smooth_position: float = number(0.0)
    smooth_rotation: float = number(0.0)
    travel_position: float = number(0.0)
    travel_rotation: float = number(0.0)
    prior: float = number(0.0)
    prior_model: str = choice(*PRIORS)
    limit: float = number(0.0)
    penetration: float = number(0.0)
    contact: float = number(0.0)
    still: float = number(0.0)
    balance: float = number(0.0)
    evaluations: int = number(1, 1_000_000)
    contact_model: str = choice(*CONTACTS, default="rules")
    soles: str = choice(*SOLES, default="edges")


@dataclass(frozen=True, kw_only=True)
class SoftContact:
    """`[soft_contact]`: the planner of that name, `planners.soft_contact`; the section may be left out.

    `units` are those of force and moment, as shares of body weight and of that times stature, a round each.
    `distance_m`, `slip_mps` and `rest` are what makes a force dear: σ_d, σ_v and ε of its loss; `seat` is
    the share of ε that counts for pelvis and thighs, which bear without effort. `rate_per_s` is how fast
    the force may change, in body weights, and `place_m` how far the centre of mass may be led from that of
    the fit: σ_r and σ_p. `node_spacing_s` puts the poses on cubic splines with nodes so far apart, 0 = each
    frame has its own; `lengths` lets the person's size and lengths move. `kinematic` is how many
    evaluations come first, without physics; `curved_every` and `history` are of the search.
    """

    weight: float = number(0.0, 1e6, default=1.0)
    units: tuple[float, ...] = number(1e-4, 10.0, default=(0.1, 0.03))
    evaluations: int = number(1, 1_000_000, default=50)
    distance_m: float = number(1e-4, 1.0, default=0.01)
    slip_mps: float = number(1e-3, 10.0, default=0.1)
    rest: float = number(1e-9, 1.0, default=1e-3)
    seat: float = number(1e-6, 1.0, default=1.0)
    rate_per_s: float = number(1e-3, 1e6, default=5.0)
    place_m: float = number(1e-4, 1e3, default=0.03)
    node_spacing_s: float = number(0.0, 60.0, default=0.1)
    lengths: bool = False
    kinematic: int = number(0, 1_000_000, default=0)
    curved_every: int = number(1, 1_000_000, default=25)
    history: int = number(1, 1000, default=10)


@dataclass(frozen=True)
class Centroidal:
    """`[centroidal]`: what that planner begins with, and its weights; `paper` is Rempe 2020 (B.3, 3.1)."""

    start: str = choice("fit", "paper", default="fit")
    weights: str = choice("measured", "paper", default="measured")
