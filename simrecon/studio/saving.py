"""Files of a tab, written where the user says."""

from __future__ import annotations

from pathlib import Path

from simrecon.studio import asking, keeping
from simrecon.studio.asking import Wanted
from simrecon.studio.tab import Tab


def scene(tab: Tab, path: Path, *, replaces: bool = False) -> None:
    """Write the scene.

    Raises:
        InputError: it is there already and is not to be replaced, or can't be written.
    """
    keeping.scene(tab.document, path, replaces=replaces)
    tab.settle(tab.document.saved_scene)


def contacts(tab: Tab, path: Path, *, replaces: bool = False) -> None:
    """Write the wishes.

    Raises:
        InputError: as of `scene`.
    """
    keeping.contacts(tab.document, tab.clip, path, replaces=replaces)
    tab.settle(tab.document.saved_wishes)


def job(tab: Tab, path: Path, wanted: Wanted, *, replaces: bool = False) -> None:
    """Write the job of the next run; scene and wishes are in it.

    Raises:
        InputError: as of `scene`.
    """
    keeping.target(path, replaces)
    asking.save(tab.job(wanted, path.with_suffix("")), path, tab.journal.folder)
    tab.settle(tab.document.saved_all)
