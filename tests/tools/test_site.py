"""The documentation as a site: built as CI builds it, and a broken link fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tools import CHECKOUT
from tools.make import site


def test_every_page_of_the_contents_is_there(tmp_path: Path) -> None:
    site.lay_out(tmp_path)
    named = [
        line.split()[-1] for line in site.CONFIG.read_text(encoding="utf-8").splitlines() if ".md" in line
    ]
    assert len(named) > 20
    assert all((tmp_path / name).is_file() for name in named)
    assert (tmp_path / "docs" / "images" / "report.webp").is_file()


@pytest.mark.slow
def test_a_broken_link_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("material", reason="needs the extra docs")
    command = [sys.executable, "-m", "tools.make.site", "-o", str(tmp_path / "site")]
    assert subprocess.run(command, cwd=CHECKOUT, check=False).returncode == 0
    assert (tmp_path / "site" / "docs" / "gallery.html").is_file()
    (plain, laid) = (site.lay_out, [])

    def broken(pages: Path) -> None:
        plain(pages)
        laid.append(pages)
        with (pages / "docs" / "gallery.md").open("a", encoding="utf-8") as page:
            page.write("\n[nowhere](report.md#nowhere)\n")

    monkeypatch.setattr(site, "lay_out", broken)
    monkeypatch.setattr(sys, "argv", ["site", "-o", str(tmp_path / "broken")])
    with pytest.raises(SystemExit):
        site.main()
    assert laid
