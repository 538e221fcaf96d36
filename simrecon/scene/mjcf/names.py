"""Names of the scene's geoms in a model, and whose they are."""

from __future__ import annotations

from simrecon.types import Scene

GROUND_GEOM = "ground"
ITEM_PREFIX = "item/"


def owner(geom: str, scene: Scene) -> str | None:
    """Name of the item that a geom belongs to, `ground`, or None for a part of the person."""
    if geom == GROUND_GEOM:
        return GROUND_GEOM
    if geom.startswith(ITEM_PREFIX):
        name = geom.removeprefix(ITEM_PREFIX)
        owners = [item.name for item in scene.items if name == item.name or name.startswith(f"{item.name}/")]
        return max(owners, key=len, default=None)
    return None
