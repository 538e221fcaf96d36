"""Pictures of the page of a result for docs/report.md: on a desk, in the dark, on a phone. Needs Chromium.

usage: python -m tools.make.report_images out/demo [--at 1.2] [-o docs/images]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2

from tools import CHECKOUT
from tools.make import browser, film

SIZES_PX = {"report": (1280, 900), "report_dark": (1280, 900), "report_phone": (390, 1100)}
QUALITY = 82


def main() -> None:
    """Write a JPEG of each size."""
    parser = argparse.ArgumentParser(description="Make the pictures of docs/report.md.")
    parser.add_argument("result", type=Path, help="result folder of `simrecon demo`")
    parser.add_argument("--at", type=float, default=1.2, metavar="S", help="time of the motion [1.2]")
    parser.add_argument("-o", dest="folder", type=Path, default=CHECKOUT / "docs" / "images")
    options = parser.parse_args()
    with browser.page() as page:
        for name, size_px in SIZES_PX.items():
            film.show(page, options.result, size_px, dark=name.endswith("dark"))
            target = options.folder / f"{name}.jpg"
            cv2.imwrite(str(target), film.at(page, options.at), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
            print(f"{target}: {target.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
