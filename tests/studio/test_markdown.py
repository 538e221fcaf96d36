"""Text of files is shown in panels as it stands: no tag, link or picture of it becomes one."""

from __future__ import annotations

import re

import pytest

from simrecon import resources
from simrecon.studio.markdown import plain

PANELS = sorted(resources.folder("studio").glob("panel*.py"))
SHOWN = re.compile(r"\{([^{}]*(?:words|name|why|path|failure|message)[^{}]*)\}")


@pytest.mark.parametrize(
    "text",
    [
        "<script>alert(1)</script>",
        '<img src=x onerror="alert(1)">',
        "![x](http://example.org/seen.png)",
        "[click](javascript:alert(1))",
        "&lt;b&gt; `code` **bold** _x_ ~~y~~ | a | b |",
        "a\\<b",
        "# title\n\n<b>",
    ],
)
def test_nothing_in_a_text_is_active(text: str) -> None:
    shown = plain(text)
    assert "\n" not in shown
    assert re.search(r"(?<!\\)(?:\\\\)*[`*_\[\]<>&~!|#$]", shown) is None
    assert re.sub(r"\\(.)", r"\1", shown) == text.replace("\n", "\\n")


def test_plain_words_stay_as_they_are() -> None:
    assert plain("bench: 3 cm (at 1.25 s), 50 %") == "bench: 3 cm (at 1.25 s), 50 %"


def test_panels_show_no_text_of_files_otherwise() -> None:
    """Every text in a Markdown field of a panel that comes from elsewhere goes through `plain`."""
    for path in PANELS:
        for line in path.read_text(encoding="utf-8").splitlines():
            if 'f"**' in line:
                assert all("plain(" in one for one in SHOWN.findall(line)), f"{path.name}: {line}"
