"""The characters of Rempe 2020 (appendices D and E.6) beside each other, each planned on its own body.

usage: python -m tools.make.characters CLIP.npz -o FOLDER [--plan quick] [--planner centroidal]
           [--engine sampling]

FOLDER gets a result of the clip and one of each character; what is there is not run again, but for
`characters.png`: one row each, the same moments, at one scale.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import simrecon
from simrecon import Person, engines, planners
from simrecon import plan as plans
from simrecon.drawing import canvas, overlay, video
from simrecon.drawing.painter import Painter
from simrecon.drawing.views import View, three_quarter
from simrecon.geometry import camera as cameras
from simrecon.io.messages import counted
from simrecon.results import Result
from simrecon.types import Array, Camera

MOMENTS = 6
ROOM_M = 0.6
"""Around the path of a pelvis."""
TILE_PX = 260


@dataclass(frozen=True)
class Character:
    """One of them: folder and label, and the person."""

    name: str
    words: str
    person: Person


CHARACTERS = (
    Character("normal", "73 kg", Person(height_m=1.75, mass_distribution="standard")),
    Character(
        "light",
        "36.5 kg, 40 % in the head",
        Person(height_m=1.20, betas=(2.0, 1.0, -1.0), mass_distribution="heavy_head", mass_kg=36.5),
    ),
    Character(
        "heavy",
        "146 kg, 36 % in the arms",
        Person(height_m=2.00, betas=(-2.0, 1.0, 1.0), mass_distribution="heavy_arms", mass_kg=146.0),
    ),
)
"""Masses and distributions are the paper's; heights and proportions are ours, since it gives none."""


def main() -> None:
    """Run, draw, and say of each character what its plan and simulation came to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("clip", type=Path)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--planner", default="centroidal", choices=planners.names())
    parser.add_argument("--engine", default="sampling", choices=engines.names())
    options = parser.parse_args()
    results = made(options.clip, options.folder, options.plan, options.planner, options.engine)
    for character, result in zip(CHARACTERS, results, strict=True):
        print(said(character, result))
    path = options.folder / "characters.png"
    video.write_image(path, picture(results))
    print(f"written   {path}")


def made(clip: Path, folder: Path, plan: str, planner: str, engine: str) -> list[Result]:
    """The result of each character, from that of the clip."""
    folder.mkdir(parents=True, exist_ok=True)
    settings, first = plans.read(plan), folder / "person"
    if not first.is_dir():  # only its fit counts
        job = simrecon.Job(str(clip), str(first), plan=settings, planner="none", engine="none")
        simrecon.run(replace(job, no_report=True))
    results = []
    for character in CHARACTERS:
        target = folder / character.name
        if not target.is_dir():
            simrecon.retarget(
                first, target, character.person, plan=settings, planner=planner, engine=engine, no_report=True
            )
        results.append(simrecon.open_result(target))
    return results


def said(character: Character, result: Result) -> str:
    """A line: what is simulated, how far from the fit, and what the plan has to say."""
    report = result.report
    frames, notes = report["frames"], report["planner_notes"]
    off = 1e3 * report["agreement"]["fit_mean_m"]
    count = counted(frames["fallback"], "frame")
    words = f"{character.words}: {count} of {frames['count']} not simulated, joints {off:.0f} mm from the fit"
    return "; ".join((words, *notes))


def picture(results: list[Result]) -> canvas.Image:
    """All of them at the same moments and at one scale, one row each."""
    paths = [result.motion.qpos[:, :3] for result in results]
    half = max(float(np.ptp(path[:, :2], axis=0).max()) for path in paths) / 2 + ROOM_M
    high = max(result.body.height_m for result in results) * 1.05
    painters = [
        painter(result, camera(path, half, high)) for result, path in zip(results, paths, strict=True)
    ]
    frames = [np.linspace(0, len(path) - 1, MOMENTS).round().astype(int) for path in paths]
    bounds = np.array([own.bounds_px(rows) for own, rows in zip(painters, frames, strict=True)])
    low, shape = (
        bounds[:, 0].min(axis=0),
        np.ptp([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)], axis=0),
    )
    size = (TILE_PX, round(TILE_PX * shape[1] / shape[0]))
    view = View(low, np.array(size) / shape, size)
    tiles = [
        own.draw(int(frame), view, None, None if number else character.words)
        for own, rows, character in zip(painters, frames, CHARACTERS, strict=True)
        for number, frame in enumerate(rows)
    ]
    return overlay.contact_sheet(tiles, MOMENTS)


def painter(result: Result, before: Camera) -> Painter:
    """Of a result, before a camera of one frame that stays."""
    clip = result.animation()
    return Painter(replace(clip, camera=cameras.lasting(before, len(clip.times_s)), keypoints_px=None))


def camera(path_m: Array, half_m: float, high_m: float) -> Camera:
    """Before a path (T, 3), of a room of the same size for everybody."""
    middle = path_m[:, :2].mean(axis=0)
    low = np.array([*(middle - half_m), 0.0])
    return three_quarter(low, np.array([*(middle + half_m), high_m]), 0.0)


if __name__ == "__main__":
    main()
