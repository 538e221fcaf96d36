"""`simrecon scene check`, `show` and `suggest`: a scene and the kinematic motion in it."""

from __future__ import annotations

import argparse
from pathlib import Path

from simrecon import kinematics, plan, suggesting
from simrecon import scene as scenes
from simrecon.cli import observing
from simrecon.drawing import stage, video
from simrecon.errors import InputError, printable
from simrecon.evidence import resample
from simrecon.io.messages import counted
from simrecon.job import Job, inputs
from simrecon.scene import check, edit, files, meshes, sheets
from simrecon.sim.address import with_items_at_rest
from simrecon.sim.models import compile_text
from simrecon.types import Evidence, KinematicFit, Scene

PLAN = "quick"
LEAST_DEPTH_M = 0.005


def check_motion(options: argparse.Namespace) -> int:
    """Check the file, and what the kinematic motion goes through."""
    scene = scenes.read(options.file)
    asked = observing.job(options, options.evidence)
    print(listed(scene))
    if not asked.input:
        return 0
    fit = _fitted(asked, observing.observe(asked), scene)
    frame_s = float(fit.times_s[1] - fit.times_s[0])
    model = compile_text(scenes.build(fit.body.mjcf, scenes.hard_floor(scene), frame_s))
    entries = check.penetrations(model, scene, with_items_at_rest(model, fit.qpos))
    deep = [entry for entry in entries if entry.depth_m.max() > LEAST_DEPTH_M]
    print(f"\nkinematic motion, {counted(len(fit.qpos), 'frame')}: {_found(len(deep), len(scene.items))}")
    for entry in deep:
        worst = entry.deepest
        spans = entry.spans(LEAST_DEPTH_M)
        when = ", ".join(f"{fit.times_s[a]:.2f}-{fit.times_s[b]:.2f} s" for a, b in spans[:6])
        more = f" and {counted(len(spans) - 6, 'time')} more" if len(spans) > 6 else ""
        deepest = f"{1e3 * entry.depth_m[worst]:.0f} mm at {fit.times_s[worst]:.2f} s ({entry.parts[worst]})"
        print(f"{printable(entry.name):<16} {deepest}; {when}{more}")
    check.refuse_start(model, scene, with_items_at_rest(model, fit.qpos[:1])[0])
    return 0


def _found(deep: int, items: int) -> str:
    """Into how many of the ground and the items a motion goes, in words."""
    depth = f"more than {1e3 * LEAST_DEPTH_M:.0f} mm deep"
    things = "the ground" + (f" and {items} item{'s' if items > 1 else ''}" if items else "")
    if not deep:
        return f"nowhere {depth} in {things}"
    return f"{depth} in {deep} of {items + 1} ({things})" if items else f"{depth} in the ground"


def show(options: argparse.Namespace) -> int:
    """Draw scene and motion."""
    scene = scenes.read(options.file)
    asked = observing.job(options, options.evidence)
    fit = _fitted(asked, observing.observe(asked), scene) if asked.input else None
    path = Path(options.output or Path(options.file).with_suffix(".png"))
    if path.suffix.lower() != ".png":
        raise InputError(f"{path}: is no .png; valid: a name that ends in .png")
    video.write_image(path, stage.draw(scene, fit))
    print(listed(scene))
    print(f"written   {printable(str(path))}")
    return 0


def propose(options: argparse.Namespace) -> int:
    """Suggest supports that the motion needs."""
    scene = scenes.read(options.scene) if options.scene else Scene()
    asked = observing.job(options, options.evidence)
    seen = observing.observe(asked)
    if not suggesting.has_size(seen):
        print(f"# {suggesting.UNSURE}; --height-m helps")
    fit, suggestions = suggesting.suggestions(seen, scene, asked.person)
    for entry in suggestions:
        spans = ", ".join(f"{a}-{b}" for a, b in entry.spans)
        seconds = ", ".join(f"{fit.times_s[a]:.2f}-{fit.times_s[b]:.2f}" for a, b in entry.spans)
        print(f"# {entry.why}\n# frames {spans} ({seconds} s)")
        print(files.dumps_item(entry.item))
    if not suggestions:
        print("# nothing to suggest: what is known supports the motion")
    if options.output:
        edited = edit.Edited.read(options.scene) if options.scene else edit.Edited(files.dumps(scene))
        for entry in suggestions:
            edited.add(entry.item)
        edited.save(options.output)
        print(f"# written: {printable(options.output)}")
    return 0


def _fitted(asked: Job, seen: Evidence, scene: Scene) -> KinematicFit:
    """Kinematic fit to the evidence as `run` makes it."""
    shape = inputs.shape_of(asked.person)
    return kinematics.fit(resample(seen)[0], scene, plan.read(PLAN).kinematics, shape)


def listed(scene: Scene) -> str:
    """The scene for people, one line an item."""
    ground = ", ".join(f"{key} {value}" for key, value in files.tables(scene)["ground"].items())
    lines = [f"{edit.GROUND:<16} {ground}"]
    for item in scene.items:
        place = ", ".join(f"{value:g}" for value in item.position_m)
        mass = "" if item.mass_kg is None else f", movable, {item.mass_kg:g} kg"
        lines.append(f"{item.name:<16} {item.kind} at ({place}) m, turned {item.yaw_rad:g} rad{mass}")
        if item.kind == "mesh":
            lines[-1] += "; " + meshes.note(item, scene.folder)
        if item.kind == "trampoline":
            lines[-1] += f"; {sheets.natural_frequency_hz(item):.2f} Hz under {sheets.RATED_KG:g} kg"
    return "\n".join(map(printable, lines))
