"""Floor and items of `scene.toml`: files, geometry, and the MJCF of a person among them.

kinds     what items there are, and their parameters (models/scene/kinds.toml)
files     scene.toml ↔ Scene; schema: its tables
solids    an item's solid parts: by its measures (furniture) or from a file (meshes); sheets: sprung ones
geometry  heights and distances, for the kinematic fit; surfaces: of one part
mjcf      person and scene for MuJoCo
suggest   supports that a motion needs; check: items that a motion goes through; edit: a user's scene file
"""

from simrecon.scene.files import dumps, parse, read, write
from simrecon.scene.geometry import distances, nearby, support_height
from simrecon.scene.mjcf import GROUND_GEOM, ITEM_PREFIX, build, hard_floor, owner
from simrecon.scene.schema import item

__all__ = [
    "GROUND_GEOM",
    "ITEM_PREFIX",
    "build",
    "distances",
    "dumps",
    "hard_floor",
    "item",
    "nearby",
    "owner",
    "parse",
    "read",
    "support_height",
    "write",
]
