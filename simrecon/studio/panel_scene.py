"""The panel of the scene: floor and items, what the motion goes through, and what it needs."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from typing import Any

from simrecon.errors import InputError, SimreconError
from simrecon.scene.edit import GROUND
from simrecon.studio import document, opening, placing
from simrecon.studio.markdown import plain
from simrecon.studio.opening import Needed
from simrecon.studio.panel import Event, Panel, say, set_to
from simrecon.studio.panel_item import ItemFields
from simrecon.studio.session import Session
from simrecon.studio.stage import Stage
from simrecon.types import Ground

_NONE = "(none)"
SOFT_NPM, SOFT_NSPM = 20000.0, 400.0
"""Of a floor that is made soft."""


class ScenePanel(Panel):
    """Items, the one that is chosen, and suggestions."""

    def __init__(self, gui: Any, session: Session, stage: Stage, home: Any) -> None:
        """Build it in a tab of the page, `home`."""
        super().__init__(gui, session, stage)
        self._home = home
        self._needed: Needed | None = None
        self._fields: ItemFields | None = None
        self._inside = gui.add_markdown("")
        self._add = gui.add_dropdown("add", document.kinds_to_add(), initial_value="bench")
        self._mesh = gui.add_text("mesh file", "", hint="of a mesh, beside the scene file")
        self.button("Add at the person", self._put, color="blue")
        self._item = gui.add_dropdown("item", [_NONE], initial_value=_NONE)
        self._item.on_update(self.doing(lambda _: self._choose()))
        self._folder = gui.add_folder("The item")
        self._order = self._folder.order
        with gui.add_folder("Snap", expand_by_default=False):
            snap = gui.add_checkbox("to 1 cm and 5°", True)
            snap.on_update(self.doing(lambda event: self._snap(event.target.value)))
            floor = gui.add_checkbox("to the floor", True)
            floor.on_update(self.doing(lambda event: self._to_floor(event.target.value)))
            self.button("To what the motion suggests", self._to_suggestion)
        with gui.add_folder("What the motion needs", expand_by_default=False):
            self.button("Suggest", self._suggest)
            self._says = gui.add_markdown("")
            self._take = self.button("Add what is suggested", self._take_all, visible=False)

    def refresh(self, what: str) -> None:
        """See `Panel`."""
        tab = self.session.current
        if tab is None or what == "run":
            return
        if what == "tab":
            self._needed = None
            self._show_needed()
        names = tuple(item.name for item in tab.document.scene.items)
        self._item.options = (_NONE, *names)
        chosen = self.stage.furniture.chosen
        set_to(self._item, chosen if chosen in names else _NONE)
        words = "  \n".join(f"**inside** {plain(one.words)}" for one in tab.inside)
        words = words or ("The motion goes through nothing." if tab.clip is not None else "")
        if self._inside.content != words:
            self._inside.content = words
        self._show_item(chosen if chosen in names else "")

    def _show_item(self, name: str) -> None:
        """Fields of the chosen item; they are built anew for another one."""
        if self._fields is not None and self._fields.name == name:
            self._fields.fill(self.tab.document.item(name))
            return
        self._folder.remove()
        self._fields = None
        self._folder = self._container(f"Item {name}" if name else "No item is chosen")
        with self._folder:
            if not name:
                self.gui.add_markdown("Click an item in the view, or choose it above.")
                return
            self._fields = ItemFields(self.gui, self.tab.document.item(name), self.changing, self._change)
            called = self.gui.add_text("name", name)
            self.button("Rename", lambda _: self._rename(name, called.value.strip()))
            self.button("Remove", lambda _: self.tab.document.remove(name), color="red")

    def _rename(self, name: str, wanted: str) -> None:
        self.tab.document.rename(name, wanted)
        self.stage.choose(wanted)

    def _container(self, label: str) -> Any:
        """A folder in the place of the one before, in the panel's own tab."""
        with self._home:
            return self.gui.add_folder(label, order=self._order)

    def _change(self, name: str, values: Mapping[str, Any]) -> None:
        self.tab.document.set(name, values, merge=",".join(values))

    def _choose(self) -> None:
        value = self._item.value
        self.stage.choose("" if value == _NONE else value)

    def _put(self, _: Event) -> None:
        tab, kind = self.tab, self._add.value
        x, y = 0.0, 0.0
        if tab.clip is not None:
            row = tab.clip.frame_at(self.session.player.time_s)
            x, y = (float(value) for value in tab.clip.qpos[row, :2])
        place = (*placing.snapped_place((x, y, 0.0))[:2], placing.on_floor(tab.document.scene, x, y))
        more = {"file": self._mesh.value} if kind == "mesh" else {}
        self.stage.choose(tab.document.add(kind, place, **more))

    def _snap(self, on: bool) -> None:
        self.stage.furniture.gizmos.snap = bool(on)

    def _to_floor(self, on: bool) -> None:
        self.stage.furniture.gizmos.floor = bool(on)
        chosen = self.stage.furniture.chosen
        if on and chosen:
            x, y, _ = self.tab.document.item(chosen).position_m
            height = placing.on_floor(self.tab.document.scene, x, y)
            self.tab.document.set(chosen, {"position_m": [x, y, height]})

    def _to_suggestion(self, _: Event) -> None:
        """The chosen item goes to the suggestion that is nearest to it."""
        chosen = self.stage.furniture.chosen
        if not chosen:
            raise InputError("no item is chosen; valid: click one in the view")
        if self._needed is None or not self._needed.suggestions:
            raise InputError("nothing is suggested; valid: press Suggest first")
        item = self.tab.document.item(chosen)
        places = [one.item for one in self._needed.suggestions]
        best = min(places, key=lambda one: math.dist(one.position_m, item.position_m))
        values: dict[str, Any] = {"position_m": list(best.position_m), "yaw_rad": best.yaw_rad}
        if best.kind == item.kind:
            values |= dict(best.parameters)
        self.tab.document.set(chosen, values)

    def _suggest(self, event: Event) -> None:
        tab = self.tab
        self._says.content = "Looking at the motion …"

        def work() -> None:
            try:
                self._needed = opening.needed(tab.base, tab.clip, tab.document.scene)
            except SimreconError as error:
                self._needed = None
                say(event.client, str(error))
            self._show_needed()

        threading.Thread(target=work, daemon=True, name="simrecon suggest").start()

    def _show_needed(self) -> None:
        needed = self._needed
        if needed is None:
            self._says.content, self._take.visible = "", False
            return
        lines = [f"**{plain(one.item.name)}**: {plain(one.why)}" for one in needed.suggestions]
        lines = lines or ["What is known supports the motion."]
        if needed.warning:
            lines.append(f"*{needed.warning}*")
        self._says.content = "\n\n".join(lines)
        self._take.visible = bool(needed.suggestions)

    def _take_all(self, _: Event) -> None:
        """All suggestions are items then, and the first of them is chosen."""
        if self._needed is None or not self._needed.suggestions:
            return
        names = [self.tab.document.put(one.item) for one in self._needed.suggestions]
        self.stage.choose(names[0])


class FloorPanel(Panel):
    """Height, slope, friction and softness of the floor; undo and redo."""

    def __init__(self, gui: Any, session: Session, stage: Stage) -> None:
        super().__init__(gui, session, stage)
        self._height = self._number("height, m", 0.0, 0.01, lambda v: {"height_m": round(v, 4)})
        self._slope = self._number(
            "slope, °", 0.0, 0.5, lambda v: {"slope_rad": round(math.radians(v), 6) or None}
        )
        self._rises = self._number(
            "rises towards, °", 0.0, 5.0, lambda v: {"slope_yaw_rad": round(math.radians(v), 6)}
        )
        self._friction = self._number("friction", 0.9, 0.05, lambda v: {"friction": round(v, 4)})
        self._soft = gui.add_checkbox("soft floor", False)
        self._soft.on_update(self.doing(lambda event: self._soften(bool(event.target.value))))
        self._stiffness = self._number("stiffness, N/m", SOFT_NPM, 1000.0, lambda v: {"stiffness_Npm": v})
        self._damping = self._number("damping, N·s/m", SOFT_NSPM, 50.0, lambda v: {"damping_Nspm": v})
        self._means = gui.add_markdown("")
        self.refresh("tab")

    def refresh(self, what: str) -> None:
        """See `Panel`."""
        tab = self.session.current
        if tab is None or what not in ("tab", "scene", "clip", "refused"):
            return
        ground: Ground = tab.document.scene.ground
        set_to(self._height, round(ground.height_m, 4))
        set_to(self._slope, round(math.degrees(ground.slope_rad), 3))
        set_to(self._rises, round(math.degrees(ground.slope_yaw_rad), 3))
        self._rises.visible = bool(ground.slope_rad)
        set_to(self._friction, ground.friction.sliding)
        soft = ground.stiffness_Npm is not None
        set_to(self._soft, soft)
        self._stiffness.visible = self._damping.visible = soft
        if ground.stiffness_Npm is not None:
            set_to(self._stiffness, ground.stiffness_Npm)
            set_to(self._damping, ground.damping_Nspm or 0.0)
        self._means.content = placing.ground_words(ground)

    def _number(self, label: str, value: float, step: float, keys: Any) -> Any:
        field = self.gui.add_number(label, value, step=step)
        field.on_update(self.changing(lambda event: self._set(keys(float(event.target.value)))))
        return field

    def _set(self, values: Mapping[str, Any]) -> None:
        if "slope_rad" in values and values["slope_rad"] is None:
            values = {**values, "slope_yaw_rad": None}
        self.tab.document.set(GROUND, values, merge=",".join(values))

    def _soften(self, soft: bool) -> None:
        stiffness, damping = (SOFT_NPM, SOFT_NSPM) if soft else (None, None)
        self.tab.document.set(GROUND, {"stiffness_Npm": stiffness, "damping_Nspm": damping})
