"""When does what touch: labels by frame and part, from rules or from a network, and what a user wishes.

parts        the parts of a body whose contact is told apart
rules        what touches and what rests, by speed, height and force: all such rules
cues         what evidence shows, as labels are made of it
stillness    the source `rules`: what is still rests
features     what the network looks at
network      the source `network`: learned from motion capture
labels       labels made of what is known of feet and hips
wishes       `contacts.toml`: what a user wishes of them
honoured     which wishes hold
"""

from __future__ import annotations

from collections.abc import Callable

from simrecon.contact import network, stillness
from simrecon.contact.cues import Cues
from simrecon.errors import InputError
from simrecon.types import ContactLabels

__all__ = ["SOURCES", "Cues", "label"]

Source = Callable[[Cues], ContactLabels]

SOURCES: dict[str, Source] = {"rules": stillness.label, "network": network.label}


def label(cues: Cues, source: str = "rules") -> ContactLabels:
    """Labels of a clip.

    Args:
        cues: what the evidence shows.
        source: what they are made by, one of `SOURCES`.

    Raises:
        InputError: there is no such source.
    """
    if source not in SOURCES:
        raise InputError(f"there is no source of contacts {source!r}; valid: {', '.join(SOURCES)}")
    return SOURCES[source](cues)
