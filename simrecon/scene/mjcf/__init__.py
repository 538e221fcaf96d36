"""The MJCF of a person in a scene: the person, the floor (`ground`), then the items (`items`, `tiles`).

Items come after the person, so the person's coordinates are the first of `qpos` and `qvel`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree  # nosec B405  # reads what MuJoCo has just written

import mujoco

from simrecon.scene.mjcf import ground, items
from simrecon.scene.mjcf.ground import hard_floor
from simrecon.scene.mjcf.names import GROUND_GEOM, ITEM_PREFIX, owner
from simrecon.types import Scene

__all__ = ["GROUND_GEOM", "ITEM_PREFIX", "build", "hard_floor", "owner"]


def build(body_mjcf: str, scene: Scene, timestep_s: float) -> str:
    """MJCF of a person in a scene; it loads alone.

    Options come from the body's MJCF, apart from the time step, which keeps all its digits. Contacts with the
    scene take the scene's friction (priority 1): MuJoCo would otherwise use the larger one of the two geoms.
    The scene's solref and solimp are those of the main default class of the body's MJCF, except on sprung
    surfaces, whose contacts are all but hard.

    Args:
        body_mjcf: the person alone.
        scene: floor and items.
        timestep_s: of the simulation.

    Raises:
        InputError: a mesh can't be used, or the ground's stiffness is still to be fitted.
    """
    spec = mujoco.MjSpec.from_string(body_mjcf)
    load_kg = float(mujoco.MjModel.from_xml_string(body_mjcf).body_mass.sum())
    ground.add(spec, scene.ground, timestep_s, load_kg)
    for item in scene.items:
        items.add(spec, item, scene, timestep_s)
    spec.option.timestep = timestep_s
    spec.compile()
    return _with_timestep(spec.to_xml(), timestep_s)


def _with_timestep(mjcf: str, timestep_s: float) -> str:
    """Put the time step back in full: MuJoCo prints six digits."""
    root = ElementTree.fromstring(mjcf)  # nosec B314  # MuJoCo's own text
    option = root.find("option")
    if option is None:
        option = ElementTree.SubElement(root, "option")
    option.set("timestep", repr(float(timestep_s)))
    return ElementTree.tostring(root, encoding="unicode") + "\n"
