"""Make the pictures and tables of docs/scenes.md from models/scene/kinds.toml.

usage: python -m tools.make.scene_docs
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import cv2
import trimesh

from simrecon import scene as scenes
from simrecon.drawing import stage
from simrecon.scene import kinds
from simrecon.types import Scene
from tools import CHECKOUT

DOCS = CHECKOUT / "docs"
PICTURES = DOCS / "images" / "scenes"
BEGIN, END = "<!-- kinds: made by tools/make/scene_docs.py -->", "<!-- end of kinds -->"
# What the pictures show where there is no default.
SHOWN: dict[str, dict[str, object]] = {
    "box": {"size_m": [0.5, 0.8, 0.45]},
    "beam": {"length_m": 3.0, "width_m": 0.1, "height_m": 0.1},
    "chair": {"arms": True},
    "mesh": {"file": "torus.ply"},
}


def table(kind: kinds.Kind) -> str:
    """Markdown of one kind."""
    rows = [f"### {kind.name}", "", f"![{kind.name}](images/scenes/{kind.name}.jpg)", ""]
    movable = " Movable with `mass_kg`." if kind.movable else ""
    rows += [f"{kind.about[0].upper()}{kind.about[1:]}.{movable}", ""]
    rows += ["| parameter | meaning | valid | default |", "|---|---|---|---|"]
    for parameter in kind.parameters:
        rows.append(
            f"| `{parameter.name}` | {parameter.meaning} | {valid(parameter)} | {default(parameter)} |"
        )
    return "\n".join(rows)


def valid(of: kinds.Parameter) -> str:
    """The range of a parameter."""
    if of.type == "flag":
        return "true, false"
    if of.type == "text":
        return ", ".join(f"`{word}`" for word in of.valid) or "text"
    low = f"above {of.low:g}" if of.above else f"{of.low:g}"
    return f"{'three numbers, each ' if of.type == 'vector' else ''}{low} to {of.high:g}"


def default(of: kinds.Parameter) -> str:
    """The default of a parameter."""
    if of.default is None:
        return "must be given"
    return str(of.default).lower() if isinstance(of.default, bool) else f"{of.default}"


def tables() -> str:
    """Markdown of all kinds."""
    return "\n\n".join([BEGIN, *(table(kind) for kind in kinds.table().values()), END])


def picture(name: str, folder: Path) -> None:
    """Write the picture of one kind, with a person of 1.70 m beside it."""
    entry: dict[str, object] = {
        "name": name,
        "kind": name,
        "position_m": [0.0, 0.0, 0.0],
        **SHOWN.get(name, {}),
    }
    scene = Scene(items=(scenes.item(entry, "docs"),), folder=str(folder))
    image = cv2.resize(stage.draw(scene), (560, 420), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(PICTURES / f"{name}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 82])


def main() -> None:
    """Write pictures and tables."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        trimesh.creation.torus(0.6, 0.2).export(Path(folder) / "torus.ply")
        for name in kinds.table():
            picture(name, Path(folder))
    path = DOCS / "scenes.md"
    text = path.read_text(encoding="utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    path.write_text(before + tables() + after, encoding="utf-8")
    size = sum(file.stat().st_size for file in PICTURES.iterdir())
    print(f"{path}; {len(kinds.table())} pictures, {size // 1000} kB")


if __name__ == "__main__":
    main()
