"""Trains the contact networks, ours and that of Rempe 2020, and makes the tables of docs/results/contacts.md.

usage: python -m tools.train.contacts MOCAP CMU --work DIR [--seed 0] [--epochs 30] [--labels force]
                                      [--network FILE]                      (needs the extra [train])

MOCAP is the folder of the recordings, CMU the one with the unpacked archive of the CMU database. Our own
network learns all parts from forces, of motions that are simulated (`contact_simulated`, some 40 minutes of
a core), or, with `--labels heuristic`, heels and toes from the heuristic of the paper.
Simulated and fitted motions are kept in the working folder. The network is written to
models/contact/network.npz, or FILE, the figures to DIR/contacts_all.json.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from simrecon.contact import features, network
from simrecon.contact.parts import names as part_names
from simrecon.io import atomic
from simrecon.types import Array, Flags
from tools import CHECKOUT
from tools.train import contact_model as model
from tools.train import contact_motions, contact_paper, contact_simulated, contact_views
from tools.train.contact_motions import ContactMotion
from tools.train.contact_views import View

RATES_HZ = (24.0, 25.0, 30.0, 50.0, 60.0)
HIDDEN, DROPOUT_BEFORE = {"heuristic": (64, 64), "force": (96, 64)}, 2
"""Of our own network, by its labels."""
VIDEOS = {"train": 8000, "validation": 400, "test": 300}
FEET = len(contact_motions.FEET)
PARTS = {"heuristic": part_names()[:FEET], "force": part_names()}
"""Of the network, by its labels: in the recordings other parts touch too rarely to be learned."""
NETWORK = CHECKOUT / "models" / "contact" / "network.npz"
PAPER_VIDEOS = {"train": 600, "validation": 150, "test": 300}
EPOCHS = 30
EACH = 16
"""Frames of a video that our own network learns from."""
TABLE_E2 = ((3, 3), (5, 3), (5, 5), (7, 3), (7, 5), (7, 7), (9, 3), (9, 5), (9, 7), (9, 9))


def main() -> None:
    """Train both networks, and measure them."""
    parser = argparse.ArgumentParser(description="Train the contact networks.")
    parser.add_argument("mocap", type=Path)
    parser.add_argument("cmu", type=Path)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--epochs", type=int, default=EPOCHS, help=f"of each training at most [{EPOCHS}]")
    parser.add_argument("--only", choices=("own", "paper"), default=None)
    parser.add_argument("--labels", choices=tuple(PARTS), default="force", help="[%(default)s]")
    parser.add_argument("--network", type=Path, default=NETWORK, help="to write [that which ships]")
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)
    figures: dict[str, Any] = {}
    if options.only != "paper":
        known = _motions(options, options.labels)
        figures["own"] = own(known, options.labels, options.network, options.seed, options.epochs)
    if options.only != "own":
        figures["paper"] = paper(_motions(options, "heuristic"), options.seed, options.epochs)
    atomic.write_json(options.work / f"contacts_{options.only or 'all'}.json", figures)
    print(json.dumps(figures, indent=1))


def _motions(options: argparse.Namespace, labels: str) -> list[ContactMotion]:
    """All motions with such labels, made where they are not there yet."""
    if labels == "heuristic":
        return contact_motions.load(options.mocap, options.cmu, options.work / "motions")
    contact_simulated.make(options.mocap, options.cmu, options.work)
    return contact_simulated.load(options.work)


def seen(
    motions: Sequence[ContactMotion], part: str, count: int, rates: Sequence[float], seed: int, solid: float
) -> list[View]:
    """Random videos of the motions of a part, each motion by the root of its length."""
    own = [motion for motion in motions if contact_motions.part_of(motion.name) == part]
    rng = np.random.default_rng([seed, len(part)])
    share = np.sqrt([len(motion.points_m) for motion in own])
    chosen = rng.choice(len(own), count, p=share / share.sum())
    return [contact_views.view(own[i], rates[int(rng.integers(len(rates)))], rng, solid) for i in chosen]


def scored(found: Flags, truth: Flags) -> dict[str, float]:
    """Accuracy, precision, recall and F1 over all labels."""
    both, either = float((found & truth).sum()), float(found.sum() + truth.sum())
    return {
        "accuracy": float((found == truth).mean()),
        "precision": both / max(float(found.sum()), 1.0),
        "recall": both / max(float(truth.sum()), 1.0),
        "f1": 2 * both / max(either, 1.0),
    }


# -- our own ----------------------------------------------------------------------------------------------


def own(motions: Sequence[ContactMotion], kind: str, path: Path, seed: int, epochs: int) -> dict[str, Any]:
    """Train, calibrate and write our own network; its scores on the test part, by part of the body.

    Args:
        motions: of all parts of the split.
        kind: of the labels that they have, of `PARTS`.
        path: of the network.
        seed: of everything drawn.
        epochs: at most.
    """
    torch.manual_seed(seed)
    names = PARTS[kind]
    rng = np.random.default_rng(seed)
    sets = {
        part: _own_data(seen(motions, part, count, RATES_HZ, seed, 0.5), len(names), rng)
        for part, count in VIDEOS.items()
    }
    places = np.tile([1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0], features.COUNT // features.CHANNELS)
    net = model.network((features.COUNT, *HIDDEN[kind], len(names)), DROPOUT_BEFORE)
    data, check = (model.Data.of(sets[part][0], sets[part][1], places) for part in ("train", "validation"))
    began = time.perf_counter()
    losses = model.train(net, data, check, seed=seed, epochs=epochs, rate=5e-4)
    gain, offset = model.calibrated(model.logits(net, sets["validation"][0]), sets["validation"][1])
    layers = model.folded(net)
    weight, bias = layers[-1]
    layers[-1] = (gain[:, None] * weight, gain * bias + offset)
    _write(layers, names, path)
    trained = network.read(path)
    began_s, inputs = time.perf_counter() - began, sets["test"][0]
    clock = time.perf_counter()
    probability = trained(inputs)
    truth = sets["test"][1]
    return {
        "seconds": began_s,
        "epochs": len(losses),
        "frames": {part: len(values[0]) for part, values in sets.items()},
        "us_per_frame": 1e6 * (time.perf_counter() - clock) / len(inputs),
        "feet": scored(probability[:, :FEET] > 0.5, truth[:, :FEET]),
        "calibration_error": calibration_error(probability, truth),
        "parts": {
            name: {**scored(probability[:, [i]] > 0.5, truth[:, [i]]), "share": float(truth[:, i].mean())}
            for i, name in enumerate(names)
        },
    }


def _own_data(views: Sequence[View], parts: int, rng: np.random.Generator) -> tuple[Array, Flags]:
    inputs, labels = [], []
    for view in views:
        rows = np.sort(rng.choice(len(view.image), min(EACH, len(view.image)), replace=False))
        known = np.asarray(np.isfinite(view.joints_m).all(axis=-1), np.float64)
        hidden = bool(known.any()) and rng.random() < 0.15
        image = np.full_like(view.image, np.nan) if hidden else view.image
        inputs.append(features.features(image, view.scores, view.joints_m, known, view.interval_s, rows))
        labels.append(view.touches[rows, :parts])
    return np.concatenate(inputs), np.concatenate(labels)


def calibration_error(probability: Array, truth: Flags, bins: int = 10) -> float:
    """Mean distance of a probability from how often it is right, over bins of equal width."""
    which = np.minimum((probability * bins).astype(int), bins - 1).ravel()
    p, t = probability.ravel(), truth.ravel()
    parts = [(which == i) for i in range(bins) if (which == i).any()]
    return float(sum(own.mean() * abs(p[own].mean() - t[own].mean()) for own in parts))


def _write(layers: Sequence[tuple[Array, Array]], names: Sequence[str], path: Path) -> None:
    """Write the network in half precision."""
    content: dict[str, Any] = {
        "schema": network.SCHEMA,
        "layers": np.array(len(layers)),
        "parts": np.array(names),
    }
    for i, (weight, bias) in enumerate(layers):
        content |= {f"weight{i}": weight.astype(np.float16), f"bias{i}": bias.astype(np.float32)}
    atomic.write_npz(path, content)


# -- the paper's ------------------------------------------------------------------------------------------


def paper(motions: Sequence[ContactMotion], seed: int, epochs: int) -> dict[str, Any]:
    """Tables 1, E1 and E2 of the paper on our test part."""
    views = {part: seen(motions, part, count, (30.0,), seed, 1.0) for part, count in PAPER_VIDEOS.items()}
    truth = np.concatenate([view.touches[:, :4] for view in views["test"]])
    rng = np.random.default_rng(seed)
    table: dict[str, Any] = {
        "random": scored(rng.random(truth.shape) < 0.5, truth),
        "always": scored(np.ones_like(truth), truth),
    }
    for name, solid in (("2D velocity", False), ("3D velocity", True)):
        known = np.concatenate([contact_paper.speeds(view, solid=solid) for view in views["train"]])
        limit = contact_paper.best_threshold(
            known, np.concatenate([v.touches[:, :4] for v in views["train"]])
        )
        speed = np.concatenate([contact_paper.speeds(view, solid=solid) for view in views["test"]])
        table[name] = {**scored(speed < limit, truth), "threshold": limit}
    for name, landmarks in contact_paper.SETS.items():
        table[name] = _paper_net(
            views, landmarks, contact_paper.WINDOW, contact_paper.PREDICTED, seed, epochs
        )
    windows = {
        f"{window}/{predicted}": _paper_net(
            {
                part: kept[: max(1, len(kept) // (2 if part == "train" else 1))]
                for part, kept in views.items()
            },
            contact_paper.LOWER,
            window,
            predicted,
            seed,
            epochs,
        )
        for window, predicted in TABLE_E2
    }
    return {"frames": len(truth), "tables 1 and E1": table, "table E2": windows}


def _paper_net(
    views: dict[str, list[View]],
    landmarks: Sequence[str],
    window: int,
    predicted: int,
    seed: int,
    epochs: int,
) -> dict[str, float]:
    torch.manual_seed(seed)

    def data(part: str) -> model.Data:
        inputs = [contact_paper.windows(v.image, v.scores, landmarks, window) for v in views[part]]
        labels = [contact_paper.window_labels(v.touches[:, :4], predicted) for v in views[part]]
        return model.Data.of(
            np.concatenate(inputs), np.concatenate(labels), contact_paper.places(landmarks, window)
        )

    sizes = (3 * window * len(landmarks), *contact_paper.HIDDEN, 4 * predicted)
    net = model.network(sizes, contact_paper.DROPOUT_BEFORE)
    losses = model.train(net, data("train"), data("validation"), seed=seed, epochs=epochs)
    found = [
        contact_paper.votes(
            model.logits(net, contact_paper.windows(v.image, v.scores, landmarks, window)), predicted
        )
        for v in views["test"]
    ]
    truth = np.concatenate([view.touches[:, :4] for view in views["test"]])
    return {**scored(np.concatenate(found), truth), "epochs": len(losses)}


if __name__ == "__main__":
    main()
