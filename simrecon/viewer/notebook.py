"""The page of a result inside a notebook."""

from __future__ import annotations

import html

from simrecon.errors import SimreconError
from simrecon.results import Result
from simrecon.viewer import page

HEIGHT_PX = 680
MAY = "allow-scripts allow-downloads allow-modals"
"""What the page may do: not look at the notebook around it."""


def frame(result: Result) -> str:
    """A frame that holds the whole page, wherever the notebook is opened; a line if it can't be made."""
    try:
        text = page.render(result, alone=True)
    except SimreconError as error:
        return f"<p>{html.escape(str(error))}</p>"
    return (
        f'<iframe srcdoc="{html.escape(text)}" sandbox="{MAY}" title="a simrecon result" loading="lazy" '
        f'style="width:100%;height:{HEIGHT_PX}px;border:0"></iframe>'
    )
