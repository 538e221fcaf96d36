"""Make the example that ships with simrecon from the real beam clip.

usage: python -m tools.make.example DATA [FOLDER]

DATA holds `evidence/pose2sim_beam_cam01.npz`, `video/pose2sim_beam_cam01.mp4` and
`video/LICENSE.pose2sim`. FOLDER is where the example goes, `simrecon/example` of the checkout if left out.
The video is copied as it is: scaled down to half its size and encoded by OpenCV it takes twice the space.
`beam.toml`, the scene, is not made here: its numbers were measured in the video and stand in that file.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from simrecon import evidence
from simrecon.drawing import video
from tools import CHECKOUT

CLIP = "pose2sim_beam_cam01"
PROVENANCE = """\
beam.mp4 and beam.npz come from the demonstration data of Pose2Sim (https://github.com/perfanalytics/pose2sim),
Demo_SinglePerson, camera 1: a man walks on a beam and balances on one leg. His face is pixelated there.

beam.mp4   the video, unchanged: 100 frames at 60 Hz, 1080 x 1920 pixels.
beam.npz   simrecon.evidence/1: 2D landmarks and root-relative 3D joints that the network BlazePose (heavy)
           found in that video, and the calibration of its camera.
beam.toml  the scene, measured in the video with that calibration: part of simrecon, under its licence.

Licence of Pose2Sim, which covers the video and the calibration:

"""


def main() -> None:
    """Write `beam.npz`, `beam.mp4` and `NOTICE`."""
    parser = argparse.ArgumentParser(description="Make the example that ships with simrecon.")
    parser.add_argument("data", type=Path, help="folder with evidence/ and video/")
    default = CHECKOUT / "simrecon" / "example"
    parser.add_argument("folder", type=Path, nargs="?", default=default, help="where the example goes")
    arguments = parser.parse_args()
    clip = evidence.read(arguments.data / "evidence" / f"{CLIP}.npz")
    evidence.write(arguments.folder / "beam.npz", clip)
    source = arguments.data / "video" / f"{CLIP}.mp4"
    video.check_video(source, clip.times_s)
    shutil.copyfile(source, arguments.folder / "beam.mp4")
    licence = (arguments.data / "video" / "LICENSE.pose2sim").read_text(encoding="utf-8")
    (arguments.folder / "NOTICE").write_text(PROVENANCE + licence, encoding="utf-8")


if __name__ == "__main__":
    main()
