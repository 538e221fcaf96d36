"""What is edited: the text of a scene file and the wishes for contacts, with undo and redo."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.scene import kinds
from simrecon.scene.edit import GROUND, Edited
from simrecon.types import ContactWish, Scene, SceneItem

UNDO_MAX = 500
"""Edits that can be undone."""
NEW_SIZES: Mapping[str, dict[str, Any]] = {
    "box": {"size_m": [0.4, 1.2, 0.45]},
    "beam": {"length_m": 2.0, "width_m": 0.1, "height_m": 0.1},
}
"""What a new item of a kind without usual sizes has; a box is a bench."""
NAMES = {"bench": "box"}
"""Things that are items of another kind."""


@dataclass(frozen=True)
class Edits:
    """A state of a document.

    Attributes:
        scene: text of the scene file.
        wishes: of the contacts.
        label: what led to it, for people.
    """

    scene: str
    wishes: tuple[ContactWish, ...] = ()
    label: str = ""


class Document:
    """A scene and wishes while they are edited.

    Every edit is checked as a file would be: one that is not valid is an `InputError`, and changes nothing.

    Attributes:
        where: path of the scene file, for messages and for the folder of its meshes.
        on_change: is called after each change.
    """

    def __init__(self, scene: str, wishes: tuple[ContactWish, ...] = (), where: str = "scene.toml") -> None:
        self.where = where
        self.on_change: Callable[[], None] = lambda: None
        self._states = [Edits(scene, wishes)]
        self._at = 0
        self._saved = self._states[0]
        self._merge = ""
        self._scene = scenes.parse(scene, where)

    @property
    def edits(self) -> Edits:
        """The state now."""
        return self._states[self._at]

    @property
    def scene(self) -> Scene:
        """The scene now."""
        return self._scene

    @property
    def unsaved(self) -> bool:
        """Whether anything differs from what was opened or saved last."""
        now = self.edits
        return (now.scene, now.wishes) != (self._saved.scene, self._saved.wishes)

    @property
    def undoes(self) -> str:
        """What `undo` would take back; empty: nothing."""
        return self.edits.label if self._at else ""

    @property
    def redoes(self) -> str:
        """What `redo` would do again; empty: nothing."""
        return self._states[self._at + 1].label if self._at + 1 < len(self._states) else ""

    def saved_scene(self) -> None:
        """Note that the scene is saved as it is now."""
        self._saved = Edits(self.edits.scene, self._saved.wishes)
        self._merge = ""

    def saved_wishes(self) -> None:
        """Note that the wishes are saved as they are now."""
        self._saved = Edits(self._saved.scene, self.edits.wishes)

    def saved_all(self) -> None:
        """Note that all is saved as it is now."""
        self.saved_scene()
        self.saved_wishes()

    def undo(self) -> None:
        """Take the last edit back, if there is one."""
        self._go(max(self._at - 1, 0))

    def redo(self) -> None:
        """Do again what was undone last, if anything was."""
        self._go(min(self._at + 1, len(self._states) - 1))

    def restore(self, edits: Edits) -> None:
        """Take up a state that was kept elsewhere."""
        scene = scenes.parse(edits.scene, self.where)
        self._push(edits, scene, "")

    def take_up(self, states: Sequence[Edits]) -> int:
        """Take up the states of an earlier studio, and return how many; none that came to nothing."""
        first = self._saved
        if not states or (states[-1].scene, states[-1].wishes) == (first.scene, first.wishes):
            return 0
        for edits in states:
            self.restore(edits)
        return len(states)

    def item(self, name: str) -> SceneItem:
        """An item by name.

        Raises:
            InputError: there is none.
        """
        return Edited(self.edits.scene, self.where).item(name)

    def add(self, what: str, position_m: tuple[float, float, float], **settings: Any) -> str:
        """Add an item and return its name.

        Args:
            what: a kind, or a word of `NAMES`.
            position_m: centre of its footprint, at its lowest height.
            settings: other keys of its table; what has no default and is left out is of a usual size.

        Raises:
            InputError: there is no such kind, or a setting is not valid.
        """
        kind = NAMES.get(what, what)
        table = {"kind": kind, "position_m": list(position_m), **NEW_SIZES.get(kind, {}), **settings}
        name = self.free_name(what)
        return self.put(scenes.item({"name": name, **table}, f"{self.where}: new item"))

    def put(self, item: SceneItem) -> str:
        """Add an item as it is, under a free name, which is returned."""
        name = self.free_name(item.name)
        item = SceneItem(
            name, item.kind, item.position_m, item.parameters, item.yaw_rad, item.friction, item.mass_kg
        )
        self._edit(f"add {name}", lambda edited: edited.add(item))
        return name

    def free_name(self, wanted: str) -> str:
        """A name that no item has yet."""
        taken = {item.name for item in self.scene.items} | {GROUND}
        name, count = wanted, 2
        while name in taken:
            name, count = f"{wanted}_{count}", count + 1
        return name

    def remove(self, name: str) -> None:
        """Remove an item.

        Raises:
            InputError: there is none.
        """
        self._edit(f"remove {name}", lambda edited: edited.remove(name))

    def rename(self, name: str, wanted: str) -> None:
        """Give an item another name.

        Raises:
            InputError: there is no such item, or the name is empty or another's.
        """
        taken = {item.name for item in self.scene.items} | {GROUND}
        if not wanted.strip() or wanted in taken - {name}:
            raise InputError(f"name: found {wanted!r}; valid: a name that no other item has")
        self._edit(f"{name}: name", lambda edited: edited.set(name, "name", wanted))

    def set(self, name: str, values: Mapping[str, Any], *, merge: str = "") -> None:
        """Change keys of an item or of the floor (`ground`); None: its default.

        Args:
            name: of the item.
            values: by key.
            merge: edits of the same word that follow each other are one to `undo`, such as a drag.

        Raises:
            InputError: there is no such item, or a value is not valid.
        """

        def change(edited: Edited) -> None:
            for key, value in values.items():
                edited.set(name, key, value)

        self._edit(f"{name}: {', '.join(values)}", change, merge and f"{name} {merge}")

    def wish(self, wishes: tuple[ContactWish, ...], label: str) -> None:
        """Replace the wishes."""
        if wishes != self.edits.wishes:
            self._push(Edits(self.edits.scene, wishes, label), self.scene, "")

    def settle(self) -> None:
        """End a drag: the next edit is one of its own."""
        self._merge = ""

    def _edit(self, label: str, change: Callable[[Edited], None], merge: str = "") -> None:
        edited = Edited(self.edits.scene, self.where)
        change(edited)
        text = edited.text
        if text == self.edits.scene:
            return
        self._push(Edits(text, self.edits.wishes, label), scenes.parse(text, self.where), merge)

    def _push(self, edits: Edits, scene: Scene, merge: str) -> None:
        keep = self._at if merge and merge == self._merge and self._at else self._at + 1
        self._states = [*self._states[:keep], edits][-UNDO_MAX:]
        self._at, self._scene, self._merge = len(self._states) - 1, scene, merge
        self.on_change()

    def _go(self, at: int) -> None:
        if at == self._at:
            return
        self._scene = scenes.parse(self._states[at].scene, self.where)
        self._at, self._merge = at, ""
        self.on_change()


def kinds_to_add() -> tuple[str, ...]:
    """What can be added, by word."""
    return (*NAMES, *kinds.table())
