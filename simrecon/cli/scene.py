"""`simrecon scene`: make, edit, check and show scenes, and suggest what stands in one."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from simrecon import scene as scenes
from simrecon.cli import arguments, observing, scene_motion
from simrecon.cli.commands import purpose
from simrecon.cli.scene_motion import listed
from simrecon.errors import InputError
from simrecon.io import toml
from simrecon.io.messages import hint
from simrecon.io.values import value_of
from simrecon.scene import edit, files, kinds
from simrecon.scene.edit import GROUND

FILE = "scene file (.toml, see docs/scenes.md)"
MOVES: dict[str, Any] = {
    "to": tuple[float, float, float],
    "by": tuple[float, float, float],
    "turn": float,
}
MOVE_LIMITS = {"low": -kinds.LARGEST_M, "high": kinds.LARGEST_M}


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "scene", _help, purpose("scene"))
    actions = parser.add_subparsers(required=True, metavar="ACTION")

    new = _action(actions, "new", _new, "write a scene file that holds a floor")
    new.add_argument("--force", action="store_true", help="replace the file")
    _settings(new, "settings of the ground")

    put = _action(actions, "add", _add, "add an item")
    put.add_argument("kind", metavar="KIND", help=", ".join(kinds.table()))
    _settings(put, "settings of the item; those left out have defaults, also name=")

    change = _action(
        actions, "set", _set, "change an item or the ground; KEY= alone goes back to the default"
    )
    change.add_argument("name", metavar="NAME", help=f"name of an item, or {GROUND}")
    _settings(change, "what to change", "+")

    move = _action(actions, "move", _move, "move or turn an item")
    move.add_argument("name", metavar="NAME", help="name of the item")
    _settings(move, "to=X,Y,Z or by=X,Y,Z in metres; turn=RAD about z", "+")

    remove = _action(actions, "remove", _remove, "remove an item")
    remove.add_argument("name", metavar="NAME", help="name of the item")

    look = _action(
        actions,
        "check",
        scene_motion.check_motion,
        "check the file, and what the kinematic motion goes through",
    )
    _motion(look)
    show = _action(actions, "show", scene_motion.show, "draw scene, kinematic motion and camera view")
    _motion(show)
    show.add_argument("-o", dest="output", metavar="PNG", help="picture [the scene file's name, .png]")

    propose = arguments.command(
        actions, "suggest", scene_motion.propose, "suggest supports that the motion needs"
    )
    propose.add_argument("evidence", metavar="EVIDENCE", help="as the INPUT of simrecon run, or a result")
    propose.add_argument(
        "--scene", metavar="FILE", help="scene file with what is known already [a floor at z = 0]"
    )
    propose.add_argument(
        "-o", dest="output", metavar="FILE", help="write the scene with the suggestions to this file"
    )
    observing.add(propose)


def _action(
    actions: Any, name: str, function: Callable[[argparse.Namespace], int], purpose: str
) -> argparse.ArgumentParser:
    parser = arguments.command(actions, name, function, purpose)
    parser.add_argument("file", metavar="FILE", help=FILE)
    return parser


def _settings(parser: argparse.ArgumentParser, meaning: str, count: str = "*") -> None:
    parser.add_argument("settings", metavar="KEY=VALUE", nargs=count, help=meaning)


def _motion(parser: argparse.ArgumentParser) -> None:
    text = "the motion to draw or check: an INPUT of simrecon run, or a result"
    parser.add_argument("evidence", metavar="EVIDENCE", nargs="?", help=text)
    observing.add(parser)


def _help(_: argparse.Namespace) -> int:
    raise InputError("scene needs an action; `simrecon scene -h` shows what is valid")


def _new(options: argparse.Namespace) -> int:
    if Path(options.file).exists() and not options.force:
        raise InputError(f"{options.file}: exists already; valid: a new file, or --force to replace it")
    scene = files.scene({"ground": _pairs(options.settings)}, options.file)
    scenes.write(scene, options.file)
    print(listed(scene))
    return 0


def _add(options: argparse.Namespace) -> int:
    edited = edit.Edited.read(options.file)
    name, count = options.kind, 2
    while name in edited.names:
        name, count = f"{options.kind}_{count}", count + 1
    table = {"name": name, "kind": options.kind, "position_m": [0.0, 0.0, 0.0], **_pairs(options.settings)}
    edited.add(scenes.item(table, f"{options.file}: item {len(edited.names) + 1}"))
    return _save(edited)


def _set(options: argparse.Namespace) -> int:
    edited = edit.Edited.read(options.file)
    for key, value in _pairs(options.settings, empty=True).items():
        edited.set(options.name, key, value)
    return _save(edited)


def _move(options: argparse.Namespace) -> int:
    edited = edit.Edited.read(options.file)
    item = edited.item(options.name)
    for key, value in _pairs(options.settings).items():
        if key not in MOVES:
            near, valid = hint(key, MOVES), ", ".join(MOVES)
            raise InputError(f"scene move: unknown {key!r}{near}; valid: {valid}")
        amount = value_of(MOVES[key], MOVE_LIMITS, value, f"scene move: {key}")
        if key == "turn":
            edited.set(item.name, "yaw_rad", item.yaw_rad + amount)
        else:
            start = item.position_m if key == "by" else (0.0, 0.0, 0.0)
            edited.set(item.name, "position_m", [a + b for a, b in zip(start, amount, strict=True)])
    return _save(edited)


def _remove(options: argparse.Namespace) -> int:
    edited = edit.Edited.read(options.file)
    edited.remove(options.name)
    return _save(edited)


def _save(edited: edit.Edited) -> int:
    print(listed(edited.save()))
    return 0


def _pairs(settings: list[str], empty: bool = False) -> dict[str, Any]:
    """KEY=VALUE arguments: numbers, true, false, X,Y,Z or text; None for KEY= where that is allowed."""
    pairs: dict[str, Any] = {}
    for text in settings:
        key, sign, value = text.partition("=")
        if not sign or not key or (not value and not empty):
            raise InputError(f"found {text!r}; valid: KEY=VALUE, such as height_m=0.45 or position_m=0.2,0,0")
        pairs[key] = _value(value) if value else None
    return pairs


def _value(text: str) -> Any:
    for form in (text, f"[{text}]") if "," in text else (text,):
        try:
            return toml.loads(f"value = {form}", "")["value"]
        except InputError:
            continue
    return text
