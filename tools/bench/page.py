"""How many frames a second the page of a result shows as it plays, in a browser that draws on the processor.

usage: python -m tools.bench.page out/demo

Needs Chromium. Says the load of the machine, too: a busy one shows fewer.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from tools.make import browser, film

SIZES_PX = ((1280, 900), (390, 844))
SECONDS = 4.0
PLAYED = """
new Promise(done => {
  simrecon.play(true);
  let drawn = 0;
  const begun = performance.now();
  const go = moment => {
    drawn += 1;
    if (moment - begun > SECONDS * 1000) done(drawn * 1000 / (moment - begun));
    else requestAnimationFrame(go);
  };
  requestAnimationFrame(go);
})
"""


def main() -> None:
    """Play it, and print frames a second by size of the window."""
    parser = argparse.ArgumentParser(description="Frames a second of the page of a result.")
    parser.add_argument("result", type=Path, help="result folder, with report.html")
    options = parser.parse_args()
    with browser.page() as page:
        for width, height in SIZES_PX:
            film.show(page, options.result, (width, height))
            rate_hz = float(page.run(PLAYED.replace("SECONDS", f"{SECONDS}")))
            print(f"{width} x {height}: {rate_hz:.0f} frames a second, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
