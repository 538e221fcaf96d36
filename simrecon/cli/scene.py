"""`simrecon scene`: make, edit, check and show scenes, and suggest what stands in one."""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco

from simrecon import evidence, kinematics, plan
from simrecon import scene as scenes
from simrecon.body import names
from simrecon.cli import arguments
from simrecon.drawing import stage, video
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.evidence.npz import HEIGHT_RANGE_M, MASS_RANGE_KG
from simrecon.scene import check, files, kinds, meshes, parts, suggest
from simrecon.sim.address import with_items_at_rest
from simrecon.types import KinematicFit, Scene

GROUND = "ground"
PLAN = "quick"
LEAST_DEPTH_M = 0.005
FILE = "scene file (.toml, see docs/scenes.md)"


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(commands, "scene", _help, "make, edit, check and show a scene")
    actions = parser.add_subparsers(required=True, metavar="ACTION")

    new = _action(actions, "new", _new, "write a scene file that holds a floor")
    new.add_argument("--force", action="store_true", help="replace the file")
    _settings(new, "of the ground")

    put = _action(actions, "add", _add, "add a thing")
    put.add_argument("kind", metavar="KIND", help=", ".join(kinds.table()))
    _settings(put, "of the thing; what is left out has its default, name= included")

    change = _action(
        actions, "set", _set, "change a thing or the ground; KEY= alone goes back to the default"
    )
    change.add_argument("name", metavar="NAME", help=f"of a thing, or {GROUND}")
    _settings(change, "what to change", "+")

    move = _action(actions, "move", _move, "move or turn a thing")
    move.add_argument("name", metavar="NAME", help="of a thing")
    _settings(move, "to=X,Y,Z or by=X,Y,Z in metres; turn=RAD about z", "+")

    remove = _action(actions, "remove", _remove, "remove a thing")
    remove.add_argument("name", metavar="NAME", help="of a thing")

    look = _action(actions, "check", _check, "check the file, and what the kinematic motion goes through")
    _motion(look)
    show = _action(actions, "show", _show, "draw scene, kinematic motion and camera view")
    _motion(show)
    show.add_argument("-o", dest="output", metavar="PNG", help="picture [the scene file's name, .png]")

    propose = arguments.command(actions, "suggest", _suggest, "suggest supports that the motion needs")
    propose.add_argument("evidence", metavar="EVIDENCE", help="evidence (.npz, see docs/formats.md)")
    propose.add_argument("--scene", metavar="FILE", help="what is known already [a floor at z = 0]")
    propose.add_argument(
        "-o", dest="output", metavar="FILE", help="accept: write scene and suggestions there"
    )
    _person(propose)


def _action(
    actions: Any, name: str, function: Callable[[argparse.Namespace], int], purpose: str
) -> argparse.ArgumentParser:
    parser = arguments.command(actions, name, function, purpose)
    parser.add_argument("file", metavar="FILE", help=FILE)
    return parser


def _settings(parser: argparse.ArgumentParser, meaning: str, count: str = "*") -> None:
    parser.add_argument("settings", metavar="KEY=VALUE", nargs=count, help=meaning)


def _motion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("evidence", metavar="EVIDENCE", nargs="?", help="the motion to draw or check")
    _person(parser)


def _person(parser: argparse.ArgumentParser) -> None:
    for key, bounds, unit in (("height-m", HEIGHT_RANGE_M, "M"), ("mass-kg", MASS_RANGE_KG, "KG")):
        parser.add_argument(f"--{key}", type=arguments.number(bounds), metavar=unit, help="of the person")


def _help(_: argparse.Namespace) -> int:
    raise InputError("scene needs an action; `simrecon scene -h` shows what is valid")


def _new(options: argparse.Namespace) -> int:
    if Path(options.file).exists() and not options.force:
        raise InputError(f"{options.file}: is there already; valid: a new file, or --force to replace it")
    return _write({"ground": _pairs(options.settings), "item": []}, options.file)


def _add(options: argparse.Namespace) -> int:
    tables = _read(options.file)
    given = _pairs(options.settings)
    taken = [item["name"] for item in tables["item"]]
    name, count = options.kind, 2
    while name in taken:
        name, count = f"{options.kind}_{count}", count + 1
    item = {"name": name, "kind": options.kind, "position_m": [0.0, 0.0, 0.0], **given}
    files.item(item, f"{options.file}:")
    tables["item"].append(item)
    return _write(tables, options.file)


def _set(options: argparse.Namespace) -> int:
    tables = _read(options.file)
    table = tables["ground"] if options.name == GROUND else _item(tables, options)
    for key, value in _pairs(options.settings, empty=True).items():
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    return _write(tables, options.file)


def _move(options: argparse.Namespace) -> int:
    tables = _read(options.file)
    table = _item(tables, options)
    for key, value in _pairs(options.settings).items():
        if key not in ("to", "by", "turn"):
            raise InputError(
                f"scene move: unknown {key!r}{kinds.hint(key, ('to', 'by', 'turn'))}; valid: to, by, turn"
            )
        if key == "turn":
            turn = kinds.number(value, "turn", "scene move:", -kinds.LARGEST_M, kinds.LARGEST_M)
            table["yaw_rad"] = table.get("yaw_rad", 0.0) + turn
            continue
        place = kinds.vector(value, key, "scene move:")
        start = table["position_m"] if key == "by" else (0.0, 0.0, 0.0)
        table["position_m"] = [a + b for a, b in zip(start, place, strict=True)]
    return _write(tables, options.file)


def _remove(options: argparse.Namespace) -> int:
    tables = _read(options.file)
    tables["item"].remove(_item(tables, options))
    return _write(tables, options.file)


def _check(options: argparse.Namespace) -> int:
    scene = scenes.read(options.file)
    print(_listed(scene))
    if options.evidence is None:
        return 0
    fit = _fitted(options, scene)
    frame_s = float(fit.times_s[1] - fit.times_s[0])
    model = mujoco.MjModel.from_xml_string(scenes.build(fit.body.mjcf, _hard(scene), frame_s))
    found = check.penetrations(model, scene, with_items_at_rest(model, fit.qpos))
    deep = [entry for entry in found if entry.depth_m.max() > LEAST_DEPTH_M]
    print(
        f"\nkinematic motion, {len(fit.qpos)} frames: goes more than {1e3 * LEAST_DEPTH_M:.0f} mm into",
        end=" ",
    )
    print("nothing" if not deep else f"{len(deep)} of {len(scene.items) + 1}")
    for entry in deep:
        worst = entry.deepest
        spans = entry.spans(LEAST_DEPTH_M)
        when = ", ".join(f"{fit.times_s[a]:.2f}-{fit.times_s[b]:.2f} s" for a, b in spans[:6])
        more = f" and {len(spans) - 6} times more" if len(spans) > 6 else ""
        deepest = f"{1e3 * entry.depth_m[worst]:.0f} mm at {fit.times_s[worst]:.2f} s ({entry.parts[worst]})"
        print(f"{entry.name:<16} {deepest}; {when}{more}")
    check.refuse_start(model, scene, with_items_at_rest(model, fit.qpos[:1])[0])
    return 0


def _show(options: argparse.Namespace) -> int:
    scene = scenes.read(options.file)
    fit = None if options.evidence is None else _fitted(options, scene)
    path = Path(options.output or Path(options.file).with_suffix(".png"))
    if path.suffix.lower() != ".png":
        raise InputError(f"{path}: is no .png; valid: a name that ends in .png")
    video.write_image(path, stage.draw(scene, fit))
    print(_listed(scene))
    print(f"written   {path}")
    return 0


def _suggest(options: argparse.Namespace) -> int:
    scene = scenes.read(options.scene) if options.scene else Scene()
    given = evidence.read(options.evidence)
    metric = options.height_m is not None or given.height_m is not None or given.joints_frame == "world"
    if not metric:
        print(
            "# the person's height is not given, and one camera can't tell small and near from tall and far:"
        )
        print("# only seats can be found, not beams and steps under the feet; --height-m helps")
    fit = _fitted(options, scene, floating=metric)
    found = suggest.suggest(fit.body, scene, fit.times_s, fit.qpos)
    for entry in found:
        spans = ", ".join(f"{a}-{b}" for a, b in entry.spans)
        seconds = ", ".join(f"{fit.times_s[a]:.2f}-{fit.times_s[b]:.2f}" for a, b in entry.spans)
        print(f"# {entry.why}\n# frames {spans} ({seconds} s)")
        print(files.dumps_item(entry.item))
    if not found:
        print("# the motion needs no support but what is known")
    if options.output:
        folder = str(Path(options.output).parent)
        whole = replace(scene, items=(*scene.items, *(entry.item for entry in found)), folder=folder)
        scenes.write(whole, options.output)
        print(f"# written: {options.output}")
    return 0


def _fitted(options: argparse.Namespace, scene: Scene, floating: bool = False) -> KinematicFit:
    """Kinematic fit to the evidence as `run` makes it; `floating`: nothing holds the body to the scene."""
    given = evidence.read(options.evidence)
    evidence.check_names(given, names.valid_names(), options.evidence)
    if options.height_m is not None:
        given = replace(given, height_m=options.height_m)
    if options.mass_kg is not None:
        given = replace(given, mass_kg=options.mass_kg)
    uniform, _ = resample(given)
    weights = plan.read(PLAN).kinematics
    if floating:
        weights = kinematics.floating(weights)
    return kinematics.fit(uniform, scene, weights)


def _hard(scene: Scene) -> Scene:
    """Scene with a hard floor where its stiffness is still to be found."""
    if scene.ground.stiffness_Npm == scenes.FIT:
        return replace(scene, ground=replace(scene.ground, stiffness_Npm=None))
    return scene


def _listed(scene: Scene) -> str:
    """The scene for people, one line a thing."""
    ground = ", ".join(f"{key} {value}" for key, value in files.tables(scene)["ground"].items())
    lines = [f"{GROUND:<16} {ground}"]
    for item in scene.items:
        place = ", ".join(f"{value:g}" for value in item.position_m)
        mass = "" if item.mass_kg is None else f", movable, {item.mass_kg:g} kg"
        lines.append(f"{item.name:<16} {item.kind} at ({place}) m, turned {item.yaw_rad:g} rad{mass}")
        if item.kind == "mesh":
            lines[-1] += "; " + meshes.note(item, scene.folder)
        if item.kind == "trampoline":
            lines[-1] += f"; {parts.natural_frequency_hz(item):.2f} Hz under {parts.RATED_KG:g} kg"
    return "\n".join(lines)


def _item(tables: dict[str, Any], options: argparse.Namespace) -> dict[str, Any]:
    found: list[dict[str, Any]] = [item for item in tables["item"] if item["name"] == options.name]
    if not found:
        there = [item["name"] for item in tables["item"]]
        listed = ", ".join(there) or "none"
        raise InputError(
            f"{options.file}: there is no thing {options.name!r}{kinds.hint(options.name, there)}; "
            f"there: {listed}"
        )
    return found[0]


def _read(file: str) -> dict[str, Any]:
    """The tables of a valid scene file."""
    return files.tables(scenes.read(file))


def _write(tables: dict[str, Any], file: str) -> int:
    """Check all before the file is replaced."""
    scene = files.scene(tables, file)
    scenes.write(scene, file)
    print(_listed(scene))
    return 0


def _pairs(settings: list[str], empty: bool = False) -> dict[str, Any]:
    """KEY=VALUE arguments: numbers, true, false, X,Y,Z or text; None for KEY= where that is allowed."""
    found: dict[str, Any] = {}
    for text in settings:
        key, sign, value = text.partition("=")
        if not sign or not key or (not value and not empty):
            raise InputError(f"found {text!r}; valid: KEY=VALUE, such as height_m=0.45 or position_m=0.2,0,0")
        found[key] = _value(value) if value else None
    return found


def _value(text: str) -> Any:
    for form in (text, f"[{text}]") if "," in text else (text,):
        try:
            return tomllib.loads(f"value = {form}")["value"]
        except tomllib.TOMLDecodeError:
            continue
    return text
