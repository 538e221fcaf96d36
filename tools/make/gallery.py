"""Make the pictures of docs/gallery.md: run what is not there yet, and film its 3D view. Needs Chromium.

usage: python -m tools.make.gallery --data DATA -o FOLDER [--only NAME ...]

The motions are in `gallery.toml` beside this file. FOLDER keeps a result for each; one that is there is not
run again.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import simrecon
from simrecon import plan as plans
from simrecon import resources
from simrecon import scene as scenes
from simrecon.io import tables
from simrecon.io.tables import option, text
from simrecon.types import Array, Scene
from tools import CHECKOUT
from tools.make import browser, film, seated
from tools.make.browser import Page

MOTIONS = Path(__file__).with_suffix(".toml")
PICTURES = CHECKOUT / "docs" / "images" / "gallery"
OWN = {"sitting_down": seated.sitting_down, "getting_up": seated.getting_up}
WINDOW_PX, WIDTH_PX, RATE_HZ, BYTES_MAX = (560, 900), 400, 10.0, 150_000
BARE = """
simrecon.view.camera.position.lerp(simrecon.view.controls.target, 0.22);
for (const hidden of document.querySelectorAll(".toggles, .swatches")) hidden.style.display = "none";
"""
BOX = "(b => [b.left, b.top, b.width, b.height])(simrecon.view.canvas.getBoundingClientRect())"


@dataclass(frozen=True)
class Motion:
    """`[[motion]]`: what is seen, where, and by which plan it is run."""

    name: str = text()
    evidence: str = text()
    plan: str = text()
    scene: str | None = None


@dataclass(frozen=True)
class Motions:
    """All of `gallery.toml`."""

    motion: tuple[Motion, ...] = option()


def main() -> None:
    """Run and film, one line for each motion."""
    parser = argparse.ArgumentParser(description="Make the pictures of the gallery.")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    options = parser.parse_args()
    for motion in tables.read(Motions, MOTIONS, "list of motions").motion:
        if options.only and motion.name not in options.only:
            continue
        folder = made(motion, options.data, options.folder)
        path = PICTURES / f"{motion.name}.webp"
        with browser.page() as page:
            film.write(path, images(page, folder), RATE_HZ, BYTES_MAX)
        print(f"{path}: {path.stat().st_size // 1000} kB", flush=True)


def made(motion: Motion, data: Path, folder: Path) -> Path:
    """Folder of a motion's result, which is run if it is not there."""
    target = folder / motion.name
    if not target.is_dir():
        job = simrecon.Job(
            input=str(source(motion, data, folder)),
            output=str(target),
            scene=scene(motion),
            plan=plans.read(motion.plan),
        )
        simrecon.run(job)
    return target


def source(motion: Motion, data: Path, folder: Path) -> Path:
    """The evidence of a motion: written if it is one by formula, else the example, or of the data folder."""
    if motion.evidence in OWN:
        path = folder / f"{motion.evidence}.npz"
        folder.mkdir(parents=True, exist_ok=True)
        simrecon.write_evidence(path, OWN[motion.evidence]())
        return path
    example = resources.folder("example") / motion.evidence
    return Path(str(example)) if example.is_file() else data / motion.evidence


def scene(motion: Motion) -> Scene:
    """What stands there."""
    if motion.scene is None:
        return Scene()
    example = resources.folder("example") / motion.scene
    if example.is_file():
        return scenes.read(Path(str(example)))
    kind, name = motion.scene.split()
    entry: dict[str, object] = {"name": name, "kind": kind, "position_m": [*seated.SEAT_AT_M, 0.0]}
    if kind == "box":
        entry["size_m"] = list(seated.BENCH_M)
    return Scene(items=(scenes.item(entry, str(MOTIONS)),))


def images(page: Page, folder: Path) -> list[Array]:
    """The 3D view of a result over its time, without buttons."""
    film.show(page, folder, WINDOW_PX)
    page.run(BARE + "dispatchEvent(new Event('resize')); null")
    left, top, width, height = (round(value) for value in page.run(BOX))
    whole = film.frames(page, RATE_HZ)
    return [film.narrowed(image[top : top + height, left : left + width], WIDTH_PX) for image in whole]


if __name__ == "__main__":
    main()
