"""Moving pictures of the page of a result, made in a browser without a screen. Needs Chromium.

usage: python -m tools.make.film out/demo [-o docs/images/report.webp]

Without -o it makes the picture of the README.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from simrecon import results, viewer
from simrecon.types import Array
from tools import CHECKOUT
from tools.make import browser
from tools.make.browser import Page

TARGET = CHECKOUT / "docs" / "images" / "report.webp"
READY = "document.documentElement?.dataset.ready === '3d'"
WINDOW_PX, WIDTH_PX = (1180, 860), 820
RATE_HZ, BYTES_MAX, QUALITIES = 12.0, 2_000_000, (80, 70, 60, 50, 40, 30, 20)


def main() -> None:
    """Write the picture and say how large it is."""
    parser = argparse.ArgumentParser(description="Make the moving picture of the README.")
    parser.add_argument("result", type=Path, help="result folder of `simrecon demo`")
    parser.add_argument("-o", dest="target", type=Path, default=TARGET)
    options = parser.parse_args()
    with browser.page() as page:
        show(page, options.result, WINDOW_PX)
        images = frames(page, RATE_HZ)
    write(options.target, [narrowed(image, WIDTH_PX) for image in images], RATE_HZ, BYTES_MAX)
    print(f"{options.target}: {len(images)} frames, {options.target.stat().st_size // 1000} kB")


def show(page: Page, folder: Path, size_px: tuple[int, int], *, dark: bool = False) -> None:
    """Make the page of a result anew, and open it in a window of a size."""
    path = viewer.write(results.open_result(folder))
    page.size(*size_px, dark=dark)
    page.open(path.resolve().as_uri(), READY)


def frames(page: Page, rate_hz: float) -> list[Array]:
    """The window at times of a motion, so many a second."""
    last_s = float(page.run("Number(document.getElementById('scrub').max)"))
    return [at(page, time_s) for time_s in np.arange(0.0, last_s + 1e-9, 1 / rate_hz)]


def at(page: Page, time_s: float) -> Array:
    """The window at a time of the motion, (H, W, 3) BGR."""
    page.run(f"simrecon.seek({time_s}); simrecon.view.draw(false); new Promise(requestAnimationFrame)")
    image = cv2.imdecode(np.frombuffer(page.picture(), np.uint8), cv2.IMREAD_COLOR)
    return np.asarray(image)


def narrowed(image: Array, width_px: int) -> Array:
    """An image at another width."""
    height = round(image.shape[0] * width_px / image.shape[1])
    return np.asarray(cv2.resize(image, (width_px, height), interpolation=cv2.INTER_AREA))


def write(path: Path, images: list[Array], rate_hz: float, bytes_max: int) -> None:
    """Write images as one moving WebP, as well as fits into so many bytes.

    Raises:
        ValueError: they do not fit at any quality.
    """
    animation = cv2.Animation()
    animation.frames = images
    animation.durations = [round(1000 / rate_hz)] * (len(images) - 1) + [1000]
    for quality in QUALITIES:
        made, content = cv2.imencodeanimation(path.suffix, animation, [cv2.IMWRITE_WEBP_QUALITY, quality])
        if made and len(content) <= bytes_max:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content.tobytes())
            return
    raise ValueError(f"{path}: {len(images)} frames do not fit into {bytes_max} bytes")


if __name__ == "__main__":
    main()
