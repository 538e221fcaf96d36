"""The fields of one item: place, turn, measures, friction and mass."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from simrecon.scene import kinds
from simrecon.studio import placing
from simrecon.studio.panel import Event, set_to
from simrecon.types import SceneItem

Change = Callable[[str, Mapping[str, Any]], None]
Doing = Callable[[Callable[[Event], None]], Callable[[Event], None]]


class ItemFields:
    """The fields of an item; built for one, and filled with its values.

    Attributes:
        name: of the item.
    """

    def __init__(self, gui: Any, item: SceneItem, doing: Doing, change: Change) -> None:
        """Build them.

        Args:
            gui: viser's.
            item: whose fields they are.
            doing: makes a callback of a field.
            change: is called with name and keys.
        """
        self.name, self._gui, self._doing, self._change = item.name, gui, doing, change
        self._own: dict[str, Any] = {}
        self._place = gui.add_vector3("place, m", item.position_m, step=placing.STEP_M)
        self._place.on_update(self._changing(lambda v: {"position_m": [round(float(x), 4) for x in v]}))
        self._turn = gui.add_number("turn, °", round(math.degrees(item.yaw_rad), 2), step=5.0)
        self._turn.on_update(self._changing(lambda v: {"yaw_rad": round(math.radians(float(v)), 6)}))
        kind = kinds.table()[item.kind]
        for parameter in kind.parameters:
            self._add(parameter, item.parameters[parameter.name])
        self._friction = gui.add_number("friction", item.friction.sliding, min=0.0, max=10.0, step=0.05)
        self._friction.on_update(self._changing(lambda v: {"friction": round(float(v), 4)}))
        self._mass: Any = None
        if kind.movable:
            mass = item.mass_kg or 0.0
            self._mass = gui.add_number(
                "mass, kg", mass, min=0.0, step=0.5, hint="0: it is fixed to the floor"
            )
            self._mass.on_update(self._changing(lambda v: {"mass_kg": round(float(v), 4) or None}))
        self._means = gui.add_markdown(placing.item_words(item))

    def fill(self, item: SceneItem) -> None:
        """Show the values of the item as it is now."""
        set_to(self._place, tuple(item.position_m))
        set_to(self._turn, round(math.degrees(item.yaw_rad), 2))
        set_to(self._friction, item.friction.sliding)
        if self._mass is not None:
            set_to(self._mass, item.mass_kg or 0.0)
        for name, field in self._own.items():
            value: Any = item.parameters[name]
            set_to(field, tuple(value) if isinstance(value, tuple) else value)
        words = placing.item_words(item)
        if self._means.content != words:
            self._means.content = words

    def _add(self, parameter: kinds.Parameter, value: Any) -> None:
        label, hint = _label(parameter.name), parameter.meaning
        if parameter.type == "flag":
            field = self._gui.add_checkbox(label, bool(value), hint=hint)
            self._bind(parameter.name, field, bool)
        elif parameter.type == "vector":
            field = self._gui.add_vector3(label, tuple(value), step=0.01, hint=hint)
            self._bind(parameter.name, field, lambda v: [round(float(x), 4) for x in v])
        elif parameter.type == "text":
            field = self._gui.add_text(label, str(value), hint=hint)
            self._bind(parameter.name, field, str)
        elif parameter.type == "count":
            field = self._gui.add_number(label, int(value), step=1, hint=hint)
            self._bind(parameter.name, field, int)
        else:
            field = self._gui.add_number(label, float(value), step=_step(parameter, float(value)), hint=hint)
            self._bind(parameter.name, field, lambda v: round(float(v), 6))

    def _bind(self, name: str, field: Any, read: Callable[[Any], Any]) -> None:
        self._own[name] = field
        field.on_update(self._changing(lambda value: {name: read(value)}))

    def _changing(self, keys: Callable[[Any], Mapping[str, Any]]) -> Callable[[Event], None]:
        return self._doing(lambda event: self._change(self.name, keys(event.target.value)))


def _label(name: str) -> str:
    """The name of a key with its unit set apart: `seat_height_m` is `seat height, m`."""
    units = {
        "m": "m",
        "Npm": "N/m",
        "Nspm": "N·s/m",
        "Npm3": "N/m per m²",
        "Nspm3": "N·s/m per m²",
        "kg": "kg",
    }
    words = name.split("_")
    unit = units.get(words[-1])
    return " ".join(words) if unit is None else f"{' '.join(words[:-1])}, {unit}"


def _step(parameter: kinds.Parameter, value: float) -> float:
    """Of a field: a centimetre, or a tenth of the value's size."""
    if parameter.name.endswith("_m"):
        return placing.STEP_M if value >= 0.1 else 0.005
    return float(10 ** (math.floor(math.log10(value)) - 1)) if value > 0 else 100.0
