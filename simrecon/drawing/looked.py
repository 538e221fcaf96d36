"""A sheet of what was seen in a video: people by number, and the landmarks of the one who is followed."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from simrecon.drawing import canvas
from simrecon.drawing.canvas import Colour, Image
from simrecon.drawing.overlay import contact_sheet
from simrecon.evidence.video import frames
from simrecon.evidence.video.detection import Look
from simrecon.evidence.video.kept import Detection

TILES, TILE_PX = 12, 360
STRIP_PX = 26
CHOSEN: Colour = (80, 235, 60)
OTHER: Colour = (60, 150, 255)
SEEN: Colour = (110, 190, 70)
UNCLEAR: Colour = (60, 200, 240)
LOST: Colour = (60, 50, 220)
CLEAR_MIN = 0.5
"""Mean score of the landmarks under which a frame counts as unclear."""


def sheet(path: Path, detected: Detection, look: Look) -> Image:
    """Frames of the whole clip with all that was found in them, over a strip with one column for each frame.

    Args:
        path: of the video.
        detected: of it.
        look: how it was looked at.
    """
    rows = _rows(detected)
    tiles = []
    for frame in frames.frames(path, look.span, fps=look.fps, turn_deg=look.turn_deg):
        index = int(np.searchsorted(detected.rows, frame.row))
        if frame.row in rows and detected.rows[index] == frame.row:
            tiles.append(_tile(frame.image, detected, index))
    height, width = tiles[0].shape[:2]
    page = contact_sheet(tiles, max(1, min(len(tiles), round(np.sqrt(len(tiles) * 1.6 * height / width)))))
    return np.concatenate((page, _strip(detected, page.shape[1])))


def _rows(detected: Detection) -> set[int]:
    """Frames that are drawn: those in which everybody was looked for, if they are enough."""
    looked = detected.looked[np.isin(detected.looked, detected.rows)]
    source = looked if len(looked) >= min(TILES, len(detected.rows)) else detected.rows
    picked = np.linspace(0, len(source) - 1, min(TILES, len(source))).round().astype(int)
    return {int(row) for row in source[picked]}


def _tile(image: Image, detected: Detection, index: int) -> Image:
    """One frame: boxes with numbers, landmarks, and in a word whether the person is seen."""
    scale = TILE_PX / max(image.shape[:2])
    size = (max(2, round(image.shape[1] * scale)), max(2, round(image.shape[0] * scale)))
    small = canvas.scaled(image, size)
    row = int(detected.rows[index])
    for _, person, *box in detected.sightings[detected.sightings[:, 0] == row]:
        colour = CHOSEN if int(person) == detected.chosen else OTHER
        left, top, right, bottom = (round(scale * value) for value in box)
        cv2.rectangle(small, (left, top), (right, bottom), colour, 1, cv2.LINE_AA)
        _text(small, str(int(person) + 1), (left + 3, max(top + 16, 16)), colour)
    seen = bool(detected.seen[index])
    if seen:
        canvas.dots(small, scale * (detected.points_px[index] + 0.5) - 0.5, detected.scores[index])
    word = f"frame {row}" if seen else f"frame {row}: lost"
    word = f"frame {row}: hidden" if detected.hidden[index] else word
    _text(small, word, (4, size[1] - 6), canvas.LIGHT if seen else LOST)
    return small


def _text(image: Image, text: str, at: tuple[int, int], colour: Colour) -> None:
    for tone, thick in ((canvas.DARK, 3), (colour, 1)):
        cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.45, tone, thick, cv2.LINE_AA)


def _strip(detected: Detection, width: int) -> Image:
    """All frames from left to right: seen, seen unclearly, lost."""
    score = np.where(detected.seen, detected.scores.mean(axis=1), -1.0)
    colours = np.array([LOST, UNCLEAR, SEEN], np.uint8)
    kinds = (score >= 0).astype(int) + (score >= CLEAR_MIN)
    columns = np.minimum(np.arange(width) * len(kinds) // width, len(kinds) - 1)
    return np.broadcast_to(colours[kinds[columns]], (STRIP_PX, width, 3)).copy()
