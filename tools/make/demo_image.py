"""Make docs/images/demo.jpg, three frames of the demo's overlay side by side.

usage: python -m tools.make.demo_image out/demo [FRAME FRAME FRAME]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2

from simrecon import results
from simrecon.drawing import overlay, video
from tools import CHECKOUT

TARGET = CHECKOUT / "docs" / "images" / "demo.jpg"
# The part of the image that the person walks through, as shares of its height and width.
TOP, BOTTOM, LEFT, RIGHT = 0.12, 0.82, 0.2, 1.0


def main() -> None:
    """Write the picture and say how large it is."""
    parser = argparse.ArgumentParser(description="Make the picture of the README.")
    parser.add_argument("result", type=Path, help="result folder of `simrecon demo`")
    parser.add_argument("frames", type=int, nargs="*", default=[5, 25, 85], help="which frames to show")
    options = parser.parse_args()
    images = list(
        video.frames(options.result / "overlay.mp4", results.open_result(options.result).motion.times_s)
    )
    height, width = images[0].shape[:2]
    part = slice(int(TOP * height), int(BOTTOM * height)), slice(int(LEFT * width), int(RIGHT * width))
    page = overlay.contact_sheet([images[frame][part] for frame in options.frames], len(options.frames))
    TARGET.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(TARGET), page, [cv2.IMWRITE_JPEG_QUALITY, 85])
    print(f"{TARGET}: {TARGET.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
