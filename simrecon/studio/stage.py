"""The view: persons, forces, scene and camera of the current tab, in the frame of the cursor."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from simrecon.studio.clip import Clip
from simrecon.studio.figure import Figure, Forces
from simrecon.studio.furnishing import Furniture
from simrecon.studio.session import Session
from simrecon.studio.sight import Sight
from simrecon.studio.tab import Tab

A_COLOUR, B_COLOUR, GHOST_COLOUR = (88, 132, 196), (224, 138, 60), (110, 118, 130)

_THIN = 0.72
"""Of a person in whom arrows of forces are to be seen."""


@dataclass
class Looks:
    """What of a motion is shown."""

    skin: bool = False
    ghost: bool = True
    forces: bool = True
    before: bool = True
    after: bool = True
    frustum: bool = True
    underlay: bool = False


class Stage:
    """All that is drawn.

    Attributes:
        looks: what of it is shown.
        furniture: the scene.
    """

    def __init__(self, server: Any, session: Session) -> None:
        self._server, self._session = server, session
        self.looks, self.lock = Looks(), threading.RLock()
        self.furniture = Furniture(server.scene, self.choose)
        self._figures: dict[str, Figure] = {}
        self._forces: dict[str, Forces] = {}
        self._drawn: dict[str, tuple[Any, ...]] = {}
        self._sight = Sight(server.scene, self._again)
        self._tab: Tab | None = None
        self._shown = -1
        self._aimed: tuple[Any, ...] = ()

    def choose(self, name: str) -> None:
        """Put the gizmo at an item."""
        tab = self._session.current
        if tab is not None:
            with self.lock, self._server.atomic():
                self.furniture.choose(name, tab.document, tab.inside)
            tab.tell("choice")

    def draw(self) -> None:
        """Draw the current tab as it is now; what has not changed stays."""
        tab = self._session.current
        with self.lock, self._server.atomic():
            if tab is not self._tab:
                self._tab = tab
                self.furniture.reset()
                self._sight.drop()
            if tab is None:
                return
            self.furniture.draw(tab.document, tab.inside)
            self.furniture.see_floor(not self.looks.underlay)
            first, second = tab.clip, tab.preview
            solid = _THIN if self.looks.forces and not self.looks.skin else None
            shown = {
                "a": (first, first.qpos if first else None, A_COLOUR, solid, self.looks.before),
                "ghost": (first, _ghost(first), GHOST_COLOUR, 0.35, self.looks.ghost),
                "b": (second, second.qpos if second else None, B_COLOUR, solid, self.looks.after),
            }
            for name, (clip, qpos, colour, opacity, visible) in shown.items():
                self._draw_figure(name, clip, qpos, colour, opacity, visible)
            for name, clip, visible in (("a", first, self.looks.before), ("b", second, self.looks.after)):
                self._draw_forces(name, clip, visible and self.looks.forces)
            self._sight.draw(tab.seen, first.times_s if first else None, self.looks.frustum)
            self._aim(tab)
            self._shown = -1
        self.show()

    def show(self) -> None:
        """Show the frame of the cursor."""
        tab, time_s = self._session.current, self._session.player.time_s
        clip = None if tab is None else tab.clip
        if tab is None or clip is None:
            return
        with self.lock, self._server.atomic():
            frame = clip.frame_at(time_s)
            if frame == self._shown and "b" not in self._figures:
                return
            self._shown = frame
            for figure in self._figures.values():
                figure.show(min(figure.clip.frame_at(time_s), figure.clip.frames - 1))
            for name, forces in self._forces.items():
                forces.show(self._figures[name].clip.frame_at(time_s))
            second = tab.preview if tab.after is not None else None
            moving = second if second is not None and self.looks.after else clip
            self.furniture.show(moving, moving.frame_at(time_s), tab.document.scene)
            under = self.looks.underlay
            self._sight.show(frame, self.looks.frustum and not under, self._aspect() if under else None)

    def _draw_figure(
        self, name: str, clip: Clip | None, qpos: Any, colour: Any, opacity: float | None, visible: bool
    ) -> None:
        key = (clip, None if qpos is None else len(qpos), self.looks.skin, opacity)
        if self._drawn.get(name) != key:
            if name in self._figures:
                self._figures.pop(name).remove()
            if clip is not None and qpos is not None:
                self._figures[name] = Figure(
                    self._server.scene,
                    f"/{name}",
                    clip,
                    qpos,
                    skin=self.looks.skin,
                    colour=colour,
                    opacity=opacity,
                )
            self._drawn[name] = key
        if name in self._figures:
            self._figures[name].see(visible)

    def _draw_forces(self, name: str, clip: Clip | None, visible: bool) -> None:
        key = (clip,)
        if self._drawn.get(f"forces {name}") != key:
            if name in self._forces:
                self._forces.pop(name).remove()
            if clip is not None and clip.motion is not None:
                colour = (16, 140, 70) if name == "a" else (190, 40, 120)
                self._forces[name] = Forces(self._server.scene, f"/forces-{name}", clip, colour)
            self._drawn[f"forces {name}"] = key
        if name in self._forces:
            self._forces[name].see(visible)

    def spare(self) -> None:
        """A browser draws slowly."""
        self._sight.spare()

    def catch_up(self) -> None:
        """Show the frame of the video that was passed over while the cursor moved."""
        if self._sight.late:
            self._again()

    def look_through(self, client: Any) -> None:
        """Put the eye of a browser where the camera stood.

        Raises:
            InputError: it is not known where that was.
        """
        place, turn, fov = self._sight.pose(max(self._shown, 0))
        with client.atomic():
            client.camera.wxyz, client.camera.position = turn, place
            client.camera.fov = fov

    def _aspect(self) -> float:
        """Width over height of the view, in the first browser."""
        shapes = [client.camera.aspect for client in self._server.get_clients().values()]
        return float(shapes[0]) if shapes else 16 / 9

    def _again(self) -> None:
        """Show the frame of the cursor anew."""
        self._sight.hurry()
        self._shown = -1
        self.show()

    def _aim(self, tab: Tab) -> None:
        """Where new browsers look from: beside the person, who is in the middle."""
        clip = tab.clip
        if clip is None or self._aimed == (tab, tab.seen):
            return
        self._aimed = (tab, tab.seen)
        low, high = clip.qpos[:, :3].min(axis=0), clip.qpos[:, :3].max(axis=0)
        middle = (low + high) / 2
        reach = 2.6 + 1.2 * float(np.linalg.norm(high - low))
        eye = middle + reach * np.array([*_aside(tab, middle), 0.35])
        self._server.initial_camera.position = tuple(eye)
        self._server.initial_camera.look_at = tuple(middle)
        for client in self._server.get_clients().values():
            client.camera.position, client.camera.look_at = tuple(eye), tuple(middle)


def _ghost(clip: Clip | None) -> Any:
    """The kinematic fit beside a simulation."""
    return None if clip is None else clip.fit_qpos


def _aside(tab: Tab, middle_m: Any) -> tuple[float, float]:
    """From where a person is looked at first, seen from above: beside the camera, where there is one."""
    if tab.seen is None:
        return 0.75, -0.75
    away = tab.seen.pose(0)[0][:2] - middle_m[:2]
    angle = float(np.arctan2(away[1], away[0])) + np.deg2rad(50)
    return float(np.cos(angle)), float(np.sin(angle))
