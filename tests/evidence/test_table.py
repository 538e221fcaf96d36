"""The table of readers in docs/formats.md has a row for each of them, with the trust that their files get."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from simrecon import trust
from simrecon.evidence import formats
from tests.support import corpus
from tools import CHECKOUT

NOT_READ = {"mot", "video"}
"""Refused as it is; needs a network."""


def rows() -> dict[str, list[str]]:
    """Cells of the table by format."""
    text = (CHECKOUT / "docs" / "formats.md").read_text(encoding="utf-8")
    table = text[text.index("| `--format` |") :].split("\n\n", 1)[0].splitlines()
    cells = [[cell.strip() for cell in line[1:-1].split("|")] for line in table[2:]]
    return {row[0].strip("`"): row for row in cells}


def test_every_reader_has_a_row_and_every_row_a_reader() -> None:
    assert sorted(rows()) == sorted(formats.names())
    assert all(len(row) == 7 for row in rows().values())
    assert all(row[3] and row[4] for row in rows().values())


@pytest.mark.parametrize("sample", corpus.MAKERS, ids=lambda row: row[0])
def test_files_are_trusted_as_the_table_says(tmp_path: Path, sample: tuple[str, object, object]) -> None:
    name, make, options = sample
    if name in NOT_READ:
        pytest.skip("not read here")
    found = corpus.read(corpus.Sample(name, make(tmp_path), options))  # type: ignore[operator, arg-type]
    assert trust.of(found).source in re.findall(r"`(\w+)`", rows()[name][3])
