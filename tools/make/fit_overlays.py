"""Draw three frames of kinematic fits over the video, or over plain ground, with the 2D landmarks.

usage: python -m tools.make.fit_overlays OUT/kinematics --data DIR -o TARGET.jpg CLIP [CLIP ...]

OUT/kinematics is what `simrecon bench kinematics` wrote.
"""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path

import cv2
import mujoco
import numpy as np

from simrecon import evidence
from simrecon.bench import suite
from simrecon.drawing import canvas, overlay, video
from simrecon.drawing.animation import Animation
from simrecon.drawing.painter import Painter
from simrecon.drawing.views import View
from simrecon.io.npz import load
from simrecon.types import Array, IntArray

SUITE, FRAMES, TILE_PX, QUALITY = "kinematics", 3, 300, 82


def main() -> None:
    """Write the picture and say how large it is."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("fits", type=Path)
    parser.add_argument("clips", nargs="+")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    rows = [_row(options.fits, options.data, name) for name in options.clips]
    width = max(row.shape[1] for row in rows)
    page = np.vstack(
        [np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=255) for row in rows]
    )
    cv2.imwrite(str(options.output), page, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    print(f"{options.output}: {options.output.stat().st_size // 1000} kB")


def _row(fits: Path, data: Path, name: str) -> canvas.Image:
    """Three frames of a clip, equally spaced."""
    chosen = suite.read(SUITE)
    clip = next(clip for clip in chosen.clip if clip.name == name)
    arrays = load(fits / "runs" / name / chosen.variant[0].name / "seed0" / "fit.npz")
    times, qpos = arrays.finite("times_s", ("T",)), arrays.finite("qpos", ("T", "nq"))
    model = mujoco.MjModel.from_xml_string(str(arrays.array("mjcf")))
    seen, _ = evidence.resample(evidence.read(data / str(clip.evidence)))
    still = np.tile(model.qpos0[qpos.shape[1] :], (len(qpos), 1))  # items that can move, where they stand
    drawn = Animation(
        model,
        times,
        np.hstack((qpos, still)),
        seen.camera,
        keypoints_px=seen.keypoints_px,
        scores=seen.scores,
    )
    painter = Painter(drawn)
    frames = np.round((np.arange(FRAMES) + 0.5) / FRAMES * len(times)).astype(np.int64)
    low, high = painter.bounds_px(frames)
    scale = TILE_PX / float((high - low)[1])
    size = (max(2, round(scale * float((high - low)[0]))), TILE_PX)
    view = View(low, np.array(size) / (high - low), size)
    images = _images(data / "video" / f"{name}.mp4", times, frames, view)
    tiles = [
        painter.draw(int(frame), view, image, name.replace("_", " ") if k == 0 else f"{times[frame]:.2f} s")
        for k, (frame, image) in enumerate(zip(frames, images, strict=True))
    ]
    return overlay.contact_sheet(tiles, len(tiles))


def _images(path: Path, times: Array, frames: IntArray, view: View) -> list[canvas.Image | None]:
    """The frames of the video as the view crops them; None without a video."""
    if not path.is_file():
        return [None] * len(frames)
    with contextlib.closing(video.frames(path, times)) as every:
        images = {i: image for i, image in enumerate(every) if i in set(frames.tolist())}
    shift = view.scale * (0.5 - view.origin_px) - 0.5
    matrix = np.hstack((np.diag(view.scale), shift[:, None]))
    return [
        cv2.warpAffine(
            images[int(i)], matrix, view.size, flags=cv2.INTER_AREA, borderValue=(244, 244, 244)
        ).astype(np.uint8)
        for i in frames
    ]


if __name__ == "__main__":
    main()
