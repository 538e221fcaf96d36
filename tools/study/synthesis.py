"""What the synthesis learns from truth, simulation and fit (Xie 2021, table 5): docs/results/synthesis.md.

usage: python -m tools.study.synthesis CORPUS --work DIR [--seeds N] [--simulate N] [--page FILE]
                                  (needs the extra [train]; a quarter of an hour of one core for three seeds)

CORPUS is a folder of `tools.train.reconstruct_corpus`; if it is not finished, what is there is used. For
each kind of training data and each seed a network is trained on the training part, and kept in DIR; a
further kind, `half`, is every second training motion of the truth. All are scored on the true motions of
the test part. Then `--simulate` futures of the network that ships are run, spread over the tests. What is
there is kept.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.synthesis import network_file
from simrecon.synthesis.features import CONTEXT, Stand, features, places, stand
from simrecon.synthesis.network import Network
from simrecon.types import Array
from tools import CHECKOUT
from tools.study import synthesis_page, synthesis_scores, synthesis_simulated
from tools.train import synthesis, synthesis_corpus, synthesis_data
from tools.train.synthesis_corpus import KINDS, Clip
from tools.train.synthesis_data import Test

HALF = "half"
PAGE = CHECKOUT / "docs" / "results" / "synthesis.md"
NEUTRAL = Stand(np.eye(3), np.zeros(3), 1.0)
APART = 3
"""Frames from one training window to the next, among which the nearest is looked for."""
SEEN_EACH = 5
"""Of the windows of the training motions so many-th is scored."""
SPEED_RUNS = 20


def main() -> None:
    """Train, score, simulate, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("corpus", type=Path, metavar="CORPUS")
    parser.add_argument("--work", type=Path, required=True, metavar="DIR")
    parser.add_argument(
        "--seeds", type=int, default=3, metavar="N", help="networks of each kind [%(default)s]"
    )
    parser.add_argument("--simulate", type=int, default=20, metavar="N", help="futures to run [%(default)s]")
    parser.add_argument("--threads", type=int, default=0, help="of the simulator")
    parser.add_argument("--page", type=Path, default=PAGE)
    options = parser.parse_args()
    try:
        known = facts(options)
    except InputError as error:
        sys.exit(str(error))
    atomic.write_json(options.work / "scores.json", known)
    atomic.write_text(options.page, synthesis_page.page(known))
    print(f"written {options.page}")


def facts(options: argparse.Namespace) -> dict[str, Any]:
    """All that the page says."""
    corpus, split = options.corpus, synthesis_corpus.split()
    options.work.mkdir(parents=True, exist_ok=True)
    heights = synthesis_data.heights(corpus)
    learned_from = synthesis_data.clips(corpus, split.train)
    tests = synthesis_data.tests(synthesis_corpus.truths(corpus, split.test), heights)
    seen = synthesis_data.tests(learned_from, heights)[::SEEN_EACH]
    known = {kind: _known(learned_from, kind, heights) for kind in (*KINDS, HALF)}
    scores: dict[str, Any] = {}
    for kind in (*KINDS, HALF):
        for seed in range(options.seeds):
            network = _network(options, learned_from, kind, seed)
            found = _scored(network, seed, tests, known[kind])
            found["seen"] = _listed(synthesis_scores.score(synthesis_scores.learned(network, seed), seen))
            scores[f"{kind} {seed}"] = found
            print(f"{kind} {seed}: {_brief(scores[f'{kind} {seed}'])}", flush=True)
    return {
        "clips": [synthesis_corpus.figures(clip) for clip in synthesis_data.clips(corpus, split.names)],
        "motions": [len(split.train), len(split.test)],
        "windows": len(synthesis_data.windows(learned_from, "truth", heights).context) // 2,
        "tests": [len(tests), len({test.name for test in tests})],
        "test_names": [test.name for test in tests],
        "seeds": options.seeds,
        "scores": scores,
        "still": _listed(synthesis_scores.score(synthesis_scores.still, tests)),
        "still_seen": _listed(synthesis_scores.score(synthesis_scores.still, seen)),
        "true_looks": synthesis_scores.looks(np.stack([test.joints_m[CONTEXT:] for test in tests])),
        "true_nearest": _true_nearest(tests, known),
        "speed_s": _speed_s(network_file.shipped(), tests[0]),
        "simulated": synthesis_simulated.followed(corpus, tests, options),
    }


def _network(options: argparse.Namespace, found: list[Clip], kind: str, seed: int) -> Network:
    """The network of a kind and a seed, trained if it isn't there."""
    path: Path = options.work / f"{kind}_{seed}.npz"
    if not path.is_file():
        part, of = (found[::2], "truth") if kind == HALF else (found, kind)
        made = synthesis.trained(options.corpus, part, of, seed, lambda line: print(line, flush=True))
        synthesis.write(path, *made)
    return network_file.read(path)


def _known(found: list[Clip], kind: str, heights: dict[str, float]) -> Array:
    """Futures (M, D) of the training windows, as the network was shown them."""
    part, of = (found[::2], "truth") if kind == HALF else (found, kind)
    data = synthesis_data.windows(part, of, heights, APART)
    return synthesis_scores.flat(places(data.future[data.there.all(axis=1)], NEUTRAL))


def _scored(network: Network, seed: int, tests: list[Test], known: Array) -> dict[str, Any]:
    """Scores by sampler and test, and how near samples are to training motions on average."""
    befores = [test.joints_m[:CONTEXT] for test in tests]
    contexts = [
        features(before, stand(before[-1], test.height_m))
        for test, before in zip(tests, befores, strict=True)
    ]
    found: dict[str, Any] = {}
    for name, sampler in (("cvae", synthesis_scores.plain), ("dlow", synthesis_scores.learned)):
        found[name] = _listed(synthesis_scores.score(sampler(network, seed), tests))
        sample = sampler(network, seed)
        made = np.concatenate([synthesis_scores.flat(places(sample(one), NEUTRAL)) for one in contexts])
        near = synthesis_scores.nearest_m(made, known).reshape(len(tests), -1)
        found[name]["nearest_m"] = near.mean(axis=1).tolist()
    return found


def _true_nearest(tests: list[Test], known: dict[str, Array]) -> dict[str, float]:
    """How near true futures are to training motions of each kind."""
    values = [features(test.joints_m, stand(test.joints_m[CONTEXT - 1], test.height_m)) for test in tests]
    true = places(np.stack(values)[:, CONTEXT:], NEUTRAL)
    return {
        kind: float(synthesis_scores.nearest_m(synthesis_scores.flat(true), known[kind]).mean())
        for kind in (*KINDS, HALF)
    }


def _speed_s(network: Network, test: Test) -> float:
    """Seconds of one core for ten futures: the least of some runs."""
    before, sampler = test.joints_m[:CONTEXT], synthesis_scores.learned(network, 0)
    context, taken = features(before, stand(before[-1], test.height_m)), []
    for _ in range(SPEED_RUNS):
        began = time.process_time()
        sampler(context)
        taken.append(time.process_time() - began)
    return min(taken)


def _listed(scores: dict[str, Array]) -> dict[str, Any]:
    return {name: values.tolist() for name, values in scores.items()}


def _brief(scores: dict[str, Any]) -> str:
    cells = [
        f"{np.mean(scores[name][key]):.3f}" for name in ("cvae", "dlow") for key in ("ade", "fde", "apd")
    ]
    return " ".join(cells)


if __name__ == "__main__":
    main()
