"""Train the synthesis of futures (models/synthesis/futures.npz), the cVAE and DLow of Xie 2021, section 3.4.

usage: python -m tools.train.synthesis CORPUS [--kind simulation] [--seed 0] [-o FILE]
                                          (needs the extra [train]; about four minutes of one core)

CORPUS is a folder that `tools.train.reconstruct_corpus` made; of it the training part is used. The seed fixes
all draws: same corpus, same seed, same file on one machine.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch

from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.io.messages import counted
from simrecon.synthesis import network_file
from simrecon.synthesis.network import Network
from tools import CHECKOUT
from tools.train import synthesis_corpus, synthesis_data, synthesis_training
from tools.train.synthesis_corpus import Clip
from tools.train.synthesis_training import Settings

TARGET = CHECKOUT / "models" / "synthesis" / "futures.npz"
SIZE_MAX = 2_000_000


def main() -> None:
    """Train, and write the file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("corpus", type=Path, metavar="CORPUS")
    parser.add_argument("--kind", choices=synthesis_corpus.KINDS, default="simulation")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", dest="target", type=Path, default=TARGET, metavar="FILE")
    options = parser.parse_args()
    try:
        found = synthesis_data.clips(options.corpus, synthesis_corpus.split().train)
        made = trained(options.corpus, found, options.kind, options.seed, print)
    except InputError as error:
        sys.exit(str(error))
    size = write(options.target, *made)
    print(f"{options.target}: {size} bytes")


def trained(
    corpus: Path, found: list[Clip], kind: str, seed: int, say: Callable[[str], None]
) -> tuple[Network, str]:
    """A network, and what it was made of as JSON.

    Args:
        corpus: folder.
        found: clips to train on.
        kind: one of `synthesis_corpus.KINDS`.
        seed: of all draws.
        say: told of the progress.
    """
    torch.set_num_threads(1)  # sums in another order are other bits
    torch.use_deterministic_algorithms(True)
    data = synthesis_data.windows(found, kind, synthesis_data.heights(corpus))
    say(f"{counted(len(data.context), 'window')} of {counted(len(found), 'clip')}, {kind}, seed {seed}")
    settings = Settings()
    network = synthesis_training.train(data, seed, settings, say).network()
    made = {
        "kind": kind,
        "seed": seed,
        "settings": asdict(settings),
        "clips": [clip.name for clip in found],
        "windows": len(data.context),
        "torch": torch.__version__,
    }
    return network, json.dumps(made)


def write(target: Path, network: Network, provenance: str) -> int:
    """Write a network's file, and return its size.

    Raises:
        SystemExit: it is larger than `SIZE_MAX`.
    """
    content = atomic.npz_bytes(network_file.content(network, provenance))
    if len(content) > SIZE_MAX:
        sys.exit(f"{target}: {len(content)} bytes, more than {SIZE_MAX}")
    target.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(target, content)
    return len(content)


if __name__ == "__main__":
    main()
