"""How often the right person is followed in a video, against landmarks that were checked by eye.

usage: python -m tools.bench.tracking FOLDER [--model heavy] [--out docs/results/video.md]

FOLDER holds `pose2sim_beam_cam01.mp4` and `pose2sim_beam_cam03.mp4`. Each is followed as it is, turned by 90
and by 180 degrees, and, the first, with the man of the second cut out and walking through the picture in
front. Then the skin of a recorded back flip (`../mocap/mass_bvh/backflip.bvh`) is painted over the first
without its man, seen by its camera (`../evidence`), from three sides (`flips`). A frame is right where the
median distance of the landmarks is below a tenth of the person's height, wrong above three tenths; else, or
unseen, it is neither. Landmarks of a hidden person are those that the tracker bridges.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon.evidence.video import detection, weights
from simrecon.evidence.video.blazepose import NAMES
from simrecon.evidence.video.detection import Look
from simrecon.evidence.video.networks import Networks
from simrecon.types import Array, IntArray
from tools.bench import flips

LANDMARKS = Path(__file__).parents[2] / "tests" / "data" / "landmarks"
FIRST, SECOND = "pose2sim_beam_cam01", "pose2sim_beam_cam03"
RIGHT, WRONG = 0.1, 0.3
ANKLES_TO_SHOULDERS = 0.78
"""Of a person's height."""
TURNS = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180}
RATE_HZ = 60.0
HEADINGS_DEG = {"behind": 60.0, "the side": 150.0, "the front": 240.0}
"""Of the flip."""
PLACE_M, PLATE_EVERY, PLATE_SHARE = (-0.9, 0.0), 6, 0.25
WIDTH_SHARE = 0.16
"""Of the image, how far the passer-by's landmarks are widened to be his outline."""


def read(path: Path) -> tuple[IntArray, IntArray, Array]:
    """Frames (F,), BlazePose's numbers of the landmarks (J,), and pixels (F, J, 2), NaN where hidden."""
    with path.open(newline="") as file:
        header, *rows = list(csv.reader(file))
    columns = np.array([NAMES.index(name.removesuffix(" x")) for name in header[1::2]])
    values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows])
    return values[:, 0].astype(int), columns, values[:, 1:].reshape(len(rows), -1, 2)


@dataclass(frozen=True, eq=False)
class Case:
    """A video, and where somebody is in it.

    Attributes:
        name: for the table. path: of the video. must: share of frames that have to be right, %.
        rows: (F,) frames that are judged. columns: (J,) BlazePose's numbers.
        true_px: (F, J, 2), NaN where hidden.
        height_px: (F,) of the person.
    """

    name: str
    path: Path
    must: int
    rows: IntArray
    columns: IntArray
    true_px: Array
    height_px: Array


def heights_px(true_px: Array) -> Array:
    """Height (F,) of somebody who stands, from landmarks (F, J, 2), NaN where hidden."""
    tall = (np.nanmax(true_px, axis=1) - np.nanmin(true_px, axis=1)).max(axis=1)  # ankles to shoulders
    return np.asarray(tall / ANKLES_TO_SHOULDERS)


def score(found_px: Array, true_px: Array, height_px: Array) -> tuple[float, float]:
    """Shares of frames in which the landmarks are right, and in which they are wrong.

    Args:
        found_px: (F, J, 2), NaN where the person is unseen.
        true_px: (F, J, 2), NaN where hidden.
        height_px: (F,) of the person.
    """
    seen = np.isfinite(found_px).all(axis=(1, 2))
    off = np.full(len(found_px), np.nan)
    off[seen] = np.nanmedian(np.linalg.norm(found_px[seen] - true_px[seen], axis=2), axis=1)
    share = off / height_px
    return float((share < RIGHT).mean()), float((share > WRONG).mean())


def images(path: Path) -> Iterator[np.ndarray]:
    """The frames of a video."""
    video = cv2.VideoCapture(str(path))
    while True:
        there, image = video.read()
        if not there:
            return
        yield image


def write(path: Path, frames: Iterator[np.ndarray], rate_hz: float = RATE_HZ) -> Path:
    """A video of frames."""
    first = next(frames)
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"mp4v"), rate_hz, (first.shape[1], first.shape[0])
    )
    writer.write(first)
    for image in frames:
        writer.write(image)
    writer.release()
    return path


def turned_px(points_px: Array, turn_deg: int, size: tuple[int, int]) -> Array:
    """Pixels of an image of (width, height) in the one that is turned clockwise."""
    width, height = size
    x, y = points_px[..., 0], points_px[..., 1]
    if turn_deg == 90:
        return np.stack((height - 1 - y, x), axis=-1)
    return np.stack((width - 1 - x, height - 1 - y), axis=-1)


def passing(folder: Path) -> Iterator[np.ndarray]:
    """The first video with the man of the second, in other colours, walking through in front."""
    rows, _, points = read(LANDMARKS / f"{SECOND}.csv")
    others = list(images(folder / f"{SECOND}.mp4"))
    for t, image in enumerate(images(folder / f"{FIRST}.mp4")):
        other = others[t][:, ::-1] if t < len(others) else others[-1]
        near = points[int(np.argmin(np.abs(rows - t)))]
        mask = flips.outline(near, other.shape, WIDTH_SHARE)[:, ::-1]
        shade = cv2.cvtColor(other, cv2.COLOR_BGR2HSV)
        shade[..., 0] = (shade[..., 0].astype(int) + 60) % 180
        way = int((t / 99 * 1.6 - 0.8) * image.shape[1])
        shift = np.array([[1, 0, way], [0, 1, 0]], float)
        shown = (image.shape[1], image.shape[0])
        front = cv2.warpAffine(cv2.cvtColor(shade, cv2.COLOR_HSV2BGR), shift, shown)
        covers = cv2.warpAffine(np.ascontiguousarray(mask), shift, shown) > 0
        yield np.where(covers[..., None], front, image)


def cases(folder: Path, scratch: Path) -> Iterator[Case]:
    """What is followed."""
    for name in (FIRST, SECOND):
        path = folder / f"{name}.mp4"
        rows, columns, points = read(LANDMARKS / f"{name}.csv")
        tall = heights_px(points)
        yield Case(name, path, 100, rows, columns, points, tall)
        size = next(images(path)).shape[1::-1]
        for turn, code in TURNS.items():
            made = write(scratch / f"{name}_{turn}.mp4", (cv2.rotate(one, code) for one in images(path)))
            true = turned_px(points, turn, (size[0], size[1]))
            yield Case(f"{name}, turned by {turn}°", made, 98, rows, columns, true, tall)
        if name == FIRST:
            made = write(scratch / "passing.mp4", passing(folder))
            yield Case(f"{name}, a man passes in front", made, 95, rows, columns, points, tall)
    yield from flipped(folder, scratch)


def flipped(folder: Path, scratch: Path) -> Iterator[Case]:
    """The flip from three sides."""
    rows, _, points = read(LANDMARKS / f"{FIRST}.csv")
    some = rows[::PLATE_EVERY].tolist()
    shown = (image for t, image in enumerate(images(folder / f"{FIRST}.mp4")) if t in some)
    behind = flips.plate(shown, iter(points[::PLATE_EVERY]), grow=PLATE_SHARE)
    recording = folder.parent / "mocap" / "mass_bvh" / "backflip.bvh"
    seen = folder.parent / "evidence" / f"{FIRST}.npz"
    for side, heading in HEADINGS_DEG.items():
        made = flips.filmed(recording, seen, place_m=PLACE_M, heading_deg=heading)
        frames = flips.frames(made, itertools.repeat(behind))
        path = write(scratch / f"flip_{heading:.0f}.mp4", frames, flips.RATE_HZ)
        every = np.arange(len(made.true_px))
        yield Case(f"a back flip from {side}", path, 90, every, made.columns, made.true_px, made.height_px)


def main() -> None:
    """Print the table, or write it into the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--model", default="heavy")
    parser.add_argument("--out", type=Path, help="page whose table between the marks is made anew")
    options = parser.parse_args()
    network = Networks(weights.find("detector")[0], weights.find(options.model)[0])
    lines = ["| video | right | wrong | hidden, bridged | must |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as scratch:
        for case in cases(options.folder, Path(scratch)):
            followed = detection.follow(case.path, network, Look())
            found = followed.points_px[case.rows][:, case.columns]
            right, wrong = score(found, case.true_px, case.height_px)
            hidden = int(followed.hidden[case.rows].sum())
            told = f"{100 * right:.0f} % | {100 * wrong:.0f} % | {hidden} of {len(case.rows)}"
            lines.append(f"| {case.name} | {told} | {case.must} %, 0 % |")
            print(lines[-1], flush=True)
    if options.out is not None:
        head, _, rest = options.out.read_text().partition("<!-- tracking -->\n")
        tail = rest.partition("<!-- end of tracking -->")[2]
        page = f"{head}<!-- tracking -->\n" + "\n".join(lines) + f"\n<!-- end of tracking -->{tail}"
        options.out.write_text(page)


if __name__ == "__main__":
    main()
