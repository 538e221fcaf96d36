"""Text of files in panels: viser's page renders Markdown with all HTML that is in it, scripts too."""

from __future__ import annotations

import re

from simrecon.errors import printable

_ACTIVE = re.compile(r"[\\`*_\[\]<>&~!|#$]")
"""What begins something in Markdown or HTML."""


def plain(text: object) -> str:
    """Text for a panel, whatever it is from: shown as it stands, on one line.

    A name of an item, a path or a message of a run may hold tags, links and pictures; each letter that would
    begin one is escaped.
    """
    return _ACTIVE.sub(lambda found: f"\\{found[0]}", printable(str(text)))
