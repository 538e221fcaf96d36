"""Train the normalizing flow of the pose prior (models/prior/flow.npz), the L_nf of Gärtner 2022 eq. 4.

The loss is the negative log likelihood of poses with noise, plus a term that ranks: poses with one joint
turned at random, or a knee or an elbow bent the wrong way, shall have longer latent codes than poses as
they were recorded (outlier exposure, Hendrycks et al. 2019). For the norm is what eq. 4 uses, and
likelihood alone doesn't see to it: codes of poses far from the data may be short. A pair of poses costs a
sigmoid of the difference of their norms, a smooth area under the ROC curve, and a share of softplus, which
keeps rare poses from becoming outliers. Short codes, which no recorded pose may have, are kept to poses
within the joints' ranges, so that to shorten a code never leads out of them. Legs, single limbs and heads
of other poses take the place of a pose's own in a share of samples.

usage: python -m tools.train.prior MOCAP      (needs the extra [train]; about 6 minutes of one core)

MOCAP holds cmu_asf_amc_bvh.tar.xz, deepmimic, mass_bvh and mjpc_keyframes.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import sys
import tarfile
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import softplus
from zuko.distributions import NormalizingFlow as Density

from simrecon import body as bodies
from simrecon import prior
from simrecon.io import atomic
from simrecon.prior.flow_file import SCHEMA, from_arrays
from simrecon.system.blas import one_thread
from simrecon.types import Array
from tools import CHECKOUT
from tools.train.prior_data import NEAR_RAD, TEST_SUBJECT, Poses, balanced, load, mirrored, symmetric_basis
from tools.train.prior_model import LOG_SCALE, Flow
from tools.train.prior_score import report, turned, wrong_way

TARGET = CHECKOUT / "models" / "prior" / "flow.npz"
SIZE_MAX = 300_000


@dataclass(frozen=True)
class Settings:
    """What the result depends on, beside the data."""

    seed: int = 0
    layers: int = 5
    hidden: int = 160
    steps: int = 14000
    warm_up: int = 50
    hold: int = 11500
    fall: int = 2450
    batch: int = 320
    rate: float = 2e-3
    noise_rad: float = 0.08
    noise_ranked_rad: float = 0.02
    exchange_legs: float = 0.3
    exchange_limb: float = 0.25
    wrong_way: float = 0.1
    ordered: float = 1200.0
    apart: float = 200.0
    softness: float = 0.3
    likelihood: float = 0.6
    spread: float = 10.0
    limits: float = 10.0
    limits_every: int = 8
    check_every: int = 200
    patience: int = 20


PHASES = (
    Settings(),
    replace(Settings(), seed=1, steps=1200, hold=0, fall=1200, rate=1.5e-3, noise_ranked_rad=0.025,
            apart=1500.0, spread=1500.0),
)  # fmt: skip
"""First the ranking; then codes of rare poses are shortened, which is quick and costs little of it."""


@one_thread()
def main() -> None:
    """Read, train, check, write."""
    parser = argparse.ArgumentParser(description="Train models/prior/flow.npz.")
    parser.add_argument("mocap", type=Path, help="folder of the recordings")
    parser.add_argument("-o", "--output", type=Path, default=TARGET, help="[%(default)s]")
    options = parser.parse_args()
    torch.set_num_threads(1)
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(options.mocap / "cmu_asf_amc_bvh.tar.xz") as archive:
            archive.extractall(folder, filter="data")
        data = load(options.mocap, Path(folder))
    for part, poses in data.items():
        kinds, counts = np.unique(poses.activities, return_counts=True)
        listed = ", ".join(f"{kind} {count}" for kind, count in zip(kinds, counts, strict=True))
        print(f"{part}: {len(poses.rotvecs)} poses of {len(set(poses.clips))} recordings ({listed})")
    print(f"read in {time.perf_counter() - begin:.0f} s", flush=True)
    net = None
    for settings in PHASES:
        trainer = Trainer(settings, data["train"], data["validation"], net)
        net = trainer.run()
    trainer.round()
    arrays = trainer.arrays()
    flow = from_arrays(arrays)
    held_out = likelihoods(flow, data)
    agreement = trainer.differences(flow, data["test"].rotvecs[:2000])
    print(f"numpy against zuko in double precision: {agreement}")
    scores = report(lambda v: np.linalg.norm(flow.code(v), axis=-1), data)
    print(json.dumps(scores, indent=1))
    arrays["provenance"] = np.array(json.dumps({
        "made_by": "tools/train/prior.py",
        "sources": "CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu, NSF EIA-0196217), "
                   "as ASF/AMC, BVH and MuJoCo MPC keyframes (Apache-2.0); "
                   "MASS (Apache-2.0). DeepMimic (MIT): test only.",
        "held_out": f"subject {TEST_SUBJECT}, every fifth recording of the others, all of DeepMimic; "
                    "for early stopping, the fourth recording of each subject",
        "settings": [asdict(settings) for settings in PHASES], "near_rad": NEAR_RAD,
        "steps_kept": trainer.kept_step,
        "poses": {part: len(poses.rotvecs) for part, poses in data.items()},
        "log_likelihood": held_out, "scores": scores, "largest_difference_from_zuko": agreement,
    }))  # fmt: skip
    write(options.output, arrays)
    print(
        f"{options.output}: {options.output.stat().st_size} bytes, {time.perf_counter() - begin:.0f} s in all"
    )


class Trainer:
    """Data in whitened, mirror-symmetric coordinates; the network; early stopping."""

    def __init__(self, settings: Settings, train: Poses, validation: Poses, net: Flow | None = None) -> None:
        """Whiten with the covariance of the training poses and their mirror images; a network goes on."""
        self.settings, self.train = settings, train
        self.rng = np.random.default_rng(settings.seed)
        torch.manual_seed(settings.seed)
        stay, change = symmetric_basis()
        self.sizes = (len(stay), len(change))
        both = np.concatenate((train.rotvecs, mirrored(train.rotvecs))).reshape(-1, 48)
        weights = np.concatenate((train.weights, train.weights)) / 2
        self.mean = weights @ both  # (48,)
        off = (both - self.mean) @ np.concatenate((stay, change)).T
        covariance = off.T @ (off * weights[:, None]) + settings.noise_rad**2 * np.eye(48)
        whiten = np.zeros((48, 48))
        for block in (slice(0, len(stay)), slice(len(stay), 48)):
            whiten[block, block] = np.linalg.inv(np.linalg.cholesky(covariance[block, block]))
        self.encode = whiten @ np.concatenate((stay, change))  # (48, 48)
        limits = bodies.template().limits_rad.reshape(48, 2)
        self.decode = torch.as_tensor(np.linalg.inv(self.encode), dtype=torch.float32)
        self.middle = torch.as_tensor(self.mean - limits.mean(axis=1), dtype=torch.float32)
        self.reach = torch.as_tensor((limits[:, 1] - limits[:, 0]) / 2, dtype=torch.float32)
        self.net = net or Flow(self.sizes, settings.layers, settings.hidden, settings.seed)
        self.legs, self.limbs = _parts()
        check = np.random.default_rng(settings.seed + 1)
        kept = validation.rotvecs[balanced(validation, 2000, check)]
        self.check = self._inputs(kept, check)
        self.kept_step = 0

    def run(self) -> Flow:
        """Train until the ranking of the validation poses stops to improve; keep the best."""
        s, begin = self.settings, time.perf_counter()
        optimiser = torch.optim.Adam(self.net.parameters(), lr=s.rate)
        schedule = torch.optim.lr_scheduler.LambdaLR(
            optimiser, lambda i: min(1.0, (i + 1) / s.warm_up, 1 - (i - s.hold) / s.fall)
        )
        best, state = np.inf, self.net.state_dict()
        for step in range(1, s.steps + 1):
            density = self.net.distribution()
            loss, _, _ = self._loss(density, self._inputs(self._batch(), self.rng))
            if step % s.limits_every == 0:
                loss = loss + s.limits_every * s.limits * self._beyond(density)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.net.parameters(), 5.0)
            optimiser.step()
            schedule.step()
            if step % s.check_every == 0:
                with torch.no_grad():
                    _, nll, wrong = self._loss(self.net.distribution(), self.check)
                if wrong.item() < best:
                    best, self.kept_step = wrong.item(), step
                    state = {name: tensor.clone() for name, tensor in self.net.state_dict().items()}
                print(f"step {step}: loss {loss.item():.2f}; validation: nll {nll.item():.2f}, "
                      f"{100 * wrong.item():.2f} % ranked wrongly, best at {self.kept_step}, "
                      f"{time.perf_counter() - begin:.0f} s", flush=True)  # fmt: skip
                if step - self.kept_step >= s.patience * s.check_every:
                    break
        self.net.load_state_dict(state)
        return self.net

    def round(self) -> None:
        """Weights to the precision of the file, so that what is measured is what is shipped."""
        with torch.no_grad():
            for weights in self.net.conditioners.parameters():
                weights.copy_(weights.half())

    def _batch(self) -> Array:
        """Poses (N, 16, 3): by weight, some with legs, a limb or a head of others, half of them mirrored."""
        s, poses = self.settings, self.train
        pick = self.rng.choice(len(poses.rotvecs), (2 + len(self.limbs), s.batch), p=poses.weights)
        batch: Array = poses.rotvecs[pick[0]]
        for others, part in zip(pick[1:], (self.legs, *self.limbs), strict=True):
            share = s.exchange_legs if part is self.legs else s.exchange_limb
            mixed = np.ix_(self.rng.random(s.batch) < share, np.array(part))
            batch[mixed] = poses.rotvecs[others][mixed]
        flipped = self.rng.random(s.batch) < 0.5
        batch[flipped] = mirrored(batch[flipped])
        return batch

    def _inputs(self, poses: Array, rng: np.random.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Noisy poses for the likelihood, a quarter of them; poses, and spoilt ones, to be ranked."""
        s = self.settings
        few = poses[: len(poses) // 4]
        noisy = few + rng.normal(0, s.noise_rad, few.shape)
        usual = poses + rng.normal(0, s.noise_ranked_rad, poses.shape)
        bent = round(s.wrong_way * len(poses))
        spoilt = np.concatenate((
            wrong_way(usual[:bent], rng, np.radians(rng.uniform(12, 30)))[0],
            turned(usual[bent:], rng, np.radians(rng.uniform(20, 40)))[0],
        ))  # fmt: skip
        return self._coordinates(noisy), self._coordinates(usual), self._coordinates(spoilt)

    def _coordinates(self, rotvecs: Array) -> Tensor:
        return torch.as_tensor((rotvecs.reshape(-1, 48) - self.mean) @ self.encode.T, dtype=torch.float32)

    def _loss(self, density: Density, inputs: tuple[Tensor, Tensor, Tensor]) -> tuple[Tensor, Tensor, Tensor]:
        """The loss without ranges, the negative log likelihood in it, the share of pairs ranked wrongly."""
        s = self.settings
        z, volume = density.transform.call_and_ladj(torch.cat(inputs))
        noisy, usual, spoilt = z.norm(dim=-1).split([len(part) for part in inputs])
        nll = (0.5 * noisy**2 - volume[: len(noisy)]).mean() + 24 * math.log(2 * math.pi)
        above = (usual[:, None] - spoilt[None]) / s.softness  # (N, N)
        ranked = s.ordered * torch.sigmoid(above).mean() + s.apart * softplus(above).mean()
        even = torch.log(usual).var()
        return s.likelihood * nll + ranked + s.spread * even, nll, (above > 0).float().mean()

    def _beyond(self, density: Density) -> Tensor:
        """How far poses of codes of up to the usual length leave the joints' ranges: mean square, rad²."""
        s = self.settings
        z = self.rng.standard_normal((s.batch // 2, 48)) * self.rng.random((s.batch // 2, 1))
        x = density.transform.inv(torch.as_tensor(z, dtype=torch.float32))
        poses = x @ self.decode.T + self.middle
        return torch.relu(torch.abs(poses) - self.reach).square().sum(dim=-1).mean()

    def arrays(self) -> dict[str, np.ndarray]:
        """As `prior.flow_file` reads them: in the order s₁, a₁, s₂, a₂, whitening in the first layer."""
        order = self.order()
        turned = self.net.double().rotations()
        self.net.float()
        linear = [rotation.detach().numpy()[np.ix_(order, order)] for rotation in turned]
        linear[0] = linear[0] @ self.encode[order]
        layers = self.net.conditioners
        stacks = {
            "linear": linear,
            "stay": [layer.stay.weight for layer in layers], "bias": [layer.stay.bias for layer in layers],
            "turn": [layer.turn.weight for layer in layers],
            # zuko's conditioner gives the scales of s₂ and a₂, then the shift of s₂
            "even": [layer.even.weight for layer in layers],
            "even_bias": [layer.even.bias for layer in layers],
            "odd": [layer.odd.weight for layer in layers],
        }  # fmt: skip
        as_numpy = {
            name: np.stack([part.detach().numpy() if isinstance(part, Tensor) else part for part in parts])
            for name, parts in stacks.items()
        }
        shared = {"schema": np.array(SCHEMA), "mean_rad": self.mean, "bound": np.array(LOG_SCALE)}
        # whitening is folded into `linear`, so rounding it would be felt
        return shared | {n: a if n == "linear" else a.astype(np.float16) for n, a in as_numpy.items()}

    def order(self) -> Array:
        """Coordinates of the torch flow in the order of numpy's."""
        mask = self.net.mask.numpy()
        return np.concatenate((np.flatnonzero(mask), np.flatnonzero(~mask)))

    def differences(self, flow: prior.Flow, rotvecs: Array) -> dict[str, float]:
        """Largest difference of numpy's latent codes, in each precision, from the library's in double."""
        x = torch.as_tensor((rotvecs.reshape(-1, 48) - self.mean) @ self.encode.T)
        with torch.no_grad():
            z = self.net.double().distribution().transform(x).numpy()[:, self.order()]
        self.net.float()
        return {
            name: float(f"{np.abs(flow.code(rotvecs.astype(name)) - z).max():.1e}")
            for name in ("float64", "float32")
        }


def _parts() -> tuple[list[int], list[list[int]]]:
    """Rows of both legs; of each leg, each arm, and neck and head."""
    names = bodies.template().names[1:]
    kinds = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
    limbs = [
        [names.index(f"{side}_{joint}") for joint in kind] for side in ("left", "right") for kind in kinds
    ]
    return limbs[0] + limbs[2], [*limbs, [names.index("neck"), names.index("head")]]


def likelihoods(flow: prior.Flow, data: dict[str, Poses]) -> dict[str, float]:
    """Mean log density by part, and of the Gaussian prior beside it."""
    usual = prior.gaussian(bodies.template())
    means = {}
    for part, poses in data.items():
        z2 = usual.squared(poses.rotvecs)[0]
        flat = -0.5 * z2 - np.log(usual.spread_rad).sum() - 24 * np.log(2 * np.pi)
        means[part] = round(float(flow.log_likelihood(poses.rotvecs)[0].mean()), 2)
        means[f"{part}, gaussian"] = round(float(flat.mean()), 2)
    return means


def write(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write the network unless it is too large."""
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    if len(stream.getvalue()) > SIZE_MAX:
        sys.exit(f"{path}: {len(stream.getvalue())} bytes are more than {SIZE_MAX}")
    atomic.write_bytes(path, stream.getvalue())


if __name__ == "__main__":
    main()
