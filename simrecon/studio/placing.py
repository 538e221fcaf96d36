"""Where items are put: snapping, the floor under them, and what a stiffness means."""

from __future__ import annotations

import math

import numpy as np

from simrecon import scene as scenes
from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.scene import sheets
from simrecon.types import Ground, Scene, SceneItem

STEP_M, STEP_RAD = 0.01, math.radians(5)
"""Snapping: to centimetres and to 5°."""
MASS_KG = sheets.RATED_KG
"""Of the person by whom a stiffness is explained."""
SOLES_M2 = 0.045
"""Area of two soles, for the sink of somebody who stands on foam: 0.25 m by 0.09 m each."""


def snapped(value: float, step: float) -> float:
    """The nearest multiple of a step."""
    return round(round(value / step) * step, 10)


def snapped_place(position_m: tuple[float, ...]) -> tuple[float, float, float]:
    """A place (3,) to the centimetre."""
    x, y, z = (snapped(float(value), STEP_M) for value in position_m)
    return x, y, z


def snapped_turn(yaw_rad: float) -> float:
    """An angle to 5°, between -180° and 180°."""
    turned = math.remainder(yaw_rad, 2 * math.pi)
    return round(snapped(turned, STEP_RAD), 6)


def on_floor(scene: Scene, x: float, y: float) -> float:
    """Height of the floor, without the items, at a place, to the millimetre."""
    floor = Scene(scenes.hard_floor(scene).ground)
    return round(float(scenes.support_height(floor, np.array([x, y]))), 3)


def sink_m(stiffness_Npm: float, mass_kg: float = MASS_KG) -> float:
    """How far a spring gives under somebody at rest: weight over stiffness."""
    return mass_kg * GRAVITY_MPS2 / stiffness_Npm


def ground_words(ground: Ground) -> str:
    """What the stiffness of a floor means."""
    if ground.calibrate:
        return "its stiffness is fitted to the clip when it is run"
    if ground.stiffness_Npm is None:
        return "hard: nobody sinks in"
    return f"{ground.stiffness_Npm:g} N/m: a {MASS_KG:g} kg person sinks {_mm(sink_m(ground.stiffness_Npm))}"


def item_words(item: SceneItem) -> str:
    """What the stiffness of a sprung item means; empty for a solid one."""
    sheet = sheets.sheet_of(item)
    if sheet is None:
        return ""
    person = f"a {MASS_KG:g} kg person"
    if item.kind == "trampoline":
        stiffness = float(str(item.parameters["stiffness_Npm"]))
        return f"{stiffness:g} N/m: {person} sinks {_mm(sink_m(stiffness))} in the middle"
    stiffness = float(str(item.parameters["stiffness_Npm3"])) * SOLES_M2
    return f"{stiffness:g} N/m under two soles: {person} who stands sinks {_mm(sink_m(stiffness))}"


def _mm(length_m: float) -> str:
    return f"{1e3 * length_m:.0f} mm"
