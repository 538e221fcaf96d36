"""Bundle the parts of three.js that the page of a result needs: `python -m tools.make.three_bundle`.

Needs npm. Versions are those of `three/package-lock.json`; the licence goes beside the bundle.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from tools import CHECKOUT

SOURCE = Path(__file__).parent / "three"
VIEWER = CHECKOUT / "simrecon" / "viewer"
BUNDLE, LICENCE = VIEWER / "three.min.js", VIEWER / "three.LICENSE.txt"
OPTIONS = ("--bundle", "--minify", "--format=iife", "--global-name=THREE", "--target=es2022")


def main() -> None:
    """Write bundle and licence."""
    with tempfile.TemporaryDirectory() as scratch:
        work = Path(scratch)
        for path in SOURCE.iterdir():
            if path.is_file():
                shutil.copy(path, work)
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=work, check=True)
        bundle = ["npx", "--no-install", "esbuild", "entry.js", *OPTIONS, "--legal-comments=none"]
        subprocess.run([*bundle, f"--outfile={BUNDLE}"], cwd=work, check=True)
        shutil.copy(work / "node_modules" / "three" / "LICENSE", LICENCE)


if __name__ == "__main__":
    main()
