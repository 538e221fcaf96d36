"""Build the documentation as a site; a broken link, or an anchor that is not there, fails.

usage: python -m tools.make.site [-o out/site]

Needs the extra `docs`. Pages stay where they are, and link to each other as they do in the checkout: they are
laid out in a scratch folder in the same way, beside `mkdocs.yml`.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tools import CHECKOUT

FOLDERS = ("docs", "models", "windows", "tools")
SUFFIXES = {".md", ".jpg", ".png", ".svg", ".webp", ".py", ".toml"}
CONFIG = CHECKOUT / "mkdocs.yml"


def main() -> None:
    """Build it, and end with mkdocs' status."""
    parser = argparse.ArgumentParser(description="Build the documentation as a site.")
    parser.add_argument("-o", dest="target", type=Path, default=Path("out/site"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        pages = Path(scratch) / "pages"
        lay_out(pages)
        shutil.copy(CONFIG, scratch)
        command = [sys.executable, "-m", "mkdocs", "build", "--strict"]
        config = ["--config-file", str(Path(scratch) / CONFIG.name)]
        command += [*config, "--site-dir", str(options.target.resolve())]
        done = subprocess.run(command, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, check=False)
    if done.returncode:
        sys.exit(done.returncode)
    print(f"{options.target}: {len(list(options.target.rglob('*.html')))} pages")


def lay_out(pages: Path) -> None:
    """Copy pages and their pictures into a folder, as they lie in the checkout."""
    found = [*CHECKOUT.glob("*.md"), CHECKOUT / "LICENSE"]
    for folder in FOLDERS:
        found += [path for path in (CHECKOUT / folder).rglob("*") if path.suffix in SUFFIXES]
    for path in found:
        target = pages / path.relative_to(CHECKOUT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)


if __name__ == "__main__":
    main()
