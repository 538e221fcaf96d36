"""Draw ten futures of a walk and of a kick, as the documentation shows them (docs/synthesis.md).

usage: python -m tools.make.futures --data DATA [-o FOLDER] [--seed N]

Both motions are tests of the synthesis: it was not trained on them.
"""

from __future__ import annotations

import argparse
import tarfile
import tempfile
from pathlib import Path

import cv2
import numpy as np

import simrecon
from simrecon.drawing import stage
from simrecon.drawing.canvas import Image
from simrecon.drawing.overlay import contact_sheet
from simrecon.drawing.video import write_image
from simrecon.evidence import from_arrays
from simrecon.evidence import write as write_evidence
from simrecon.synthesis import Futures
from simrecon.types import KinematicFit
from tools import CHECKOUT

IMAGES = CHECKOUT / "docs" / "images"
COLUMNS, PANEL_PX = 5, (384, 288)
WALK, WALK_AT_S = "cmu_bvh/007/007_02.bvh", 0.8
KICK, KICK_AT_S = "truth/synth_kick.npz", 0.5
"""The moments after which: in the middle of a step, and as the leg begins to swing."""


def main() -> None:
    """Write `futures_walk.jpg` and `futures_kick.jpg`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", dest="folder", type=Path, default=IMAGES)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        room = Path(scratch)
        for name, path, at_s in (
            ("walk", walk(options.data, room), WALK_AT_S),
            ("kick", kick(options.data, room), KICK_AT_S),
        ):
            made = simrecon.synthesize(path, room / name, at_s=at_s, seed=options.seed)
            write_image(options.folder / f"futures_{name}.jpg", sheet(made.futures))


def walk(data: Path, folder: Path) -> Path:
    """A walk of the CMU database."""
    with tarfile.open(data / "mocap" / "cmu_asf_amc_bvh.tar.xz") as archive:
        archive.extract(WALK, folder, filter="data")
    return folder / WALK


def kick(data: Path, folder: Path) -> Path:
    """DeepMimic's kick, as motion capture."""
    with np.load(data / KICK, allow_pickle=False) as truth:
        names = [str(name) for name in truth["joint_names"]]
        seen = from_arrays(
            truth["times_s"], joint_names=names, joints_m=truth["joints_m"], trust="mocap", height_m=1.62
        )
    write_evidence(folder / "kick.npz", seen)
    return folder / "kick.npz"


def sheet(futures: Futures) -> Image:
    """One panel for each future: some poses of it, from the moment on."""
    return contact_sheet([_panel(futures, row) for row in range(len(futures.qpos))], COLUMNS)


def _panel(futures: Futures, row: int) -> Image:
    count = len(futures.times_s)
    fit = KinematicFit(
        body=futures.body, scene=futures.scene, camera=None, times_s=futures.times_s - futures.times_s[0],
        qpos=futures.qpos[row], com_m=np.zeros((count, 3)), reprojection_px=np.empty((count, 0)),
        interpolated=np.zeros(count, bool), iterations=0, loss={},
    )  # fmt: skip
    return cv2.resize(stage.draw(futures.scene, fit), PANEL_PX, interpolation=cv2.INTER_AREA).astype(np.uint8)


if __name__ == "__main__":
    main()
