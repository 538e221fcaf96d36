"""Floor and things of `scene.toml`: files, geometry, and the MJCF of a person among them.

kinds     what things there are, and their parameters (models/scene/kinds.toml)
files     scene.toml ↔ Scene
parts     a thing's solid shapes and sprung sheets; meshes: from files
geometry  heights and distances, for the kinematic fit
mjcf      person and scene for MuJoCo
"""

from simrecon.scene.files import FIT, dumps, item, parse, read, write
from simrecon.scene.geometry import distances, nearby, support_height
from simrecon.scene.mjcf import GROUND_GEOM, ITEM_PREFIX, build, owner

__all__ = [
    "FIT",
    "GROUND_GEOM",
    "ITEM_PREFIX",
    "build",
    "distances",
    "dumps",
    "item",
    "nearby",
    "owner",
    "parse",
    "read",
    "support_height",
    "write",
]
