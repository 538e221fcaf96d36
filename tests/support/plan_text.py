"""The plan `quick` with other values, as the text of a file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from simrecon import resources


def quick(values: Mapping[str, Any]) -> str:
    """The plan with these values; a key stands for the first one of its name."""
    text = (resources.folder("windows") / "quick.toml").read_text(encoding="utf-8")
    for key, value in values.items():
        text, found = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text, count=1)
        assert found == 1, key
    return text
