"""Which solid parts an item has: by its measures, or from the file of its mesh."""

from __future__ import annotations

from simrecon.scene import furniture, meshes
from simrecon.scene.mesh_shapes import Field
from simrecon.scene.parts import Part, hull
from simrecon.types import SceneItem


def parts_of(item: SceneItem, folder: str) -> tuple[Part, ...]:
    """The solid parts of an item, in its frame.

    Args:
        item: of any kind.
        folder: of the scene file, which holds the files of meshes.

    Raises:
        InputError: its mesh can't be used.
    """
    if item.kind == "mesh":
        return _of_mesh(item, folder)
    return tuple(furniture.build(item.kind, dict(item.parameters)))


def _of_mesh(item: SceneItem, folder: str) -> tuple[Part, ...]:
    shape = meshes.load(item, folder)
    if isinstance(shape, Field):
        return (Part("", "field", shape.centre_m, shape.half_m, True, heights_m=shape.heights_m),)
    if len(shape) == 1:
        return (hull("", shape[0]),)
    return tuple(hull(f"part_{i + 1}", points) for i, points in enumerate(shape))
