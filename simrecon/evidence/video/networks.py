"""BlazePose's two networks, run by LiteRT (extra `video`) on one thread or several."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.video import blazepose, candidates
from simrecon.evidence.video.blazepose import Image, Pose, Region
from simrecon.evidence.video.candidates import Candidate
from simrecon.system import extras
from simrecon.types import Array


class Networks:
    """Detector and landmark network.

    Args:
        detector: file of weights.
        landmarks: file of weights.
        threads: of LiteRT.

    Raises:
        InputError: the extra is missing, or a file holds another network.
    """

    def __init__(self, detector: Path, landmarks: Path, threads: int = 1) -> None:
        self._detector = _interpreter(detector, threads)
        self._landmarks = _interpreter(landmarks, threads)
        self._anchors = candidates.anchors()
        side, raw = candidates.DETECTOR_SIDE, (blazepose.RAW_COUNT, blazepose.RAW_VALUES)
        self._boxes = _output(self._detector, detector, (1, len(self._anchors), 12), (1, side, side, 3))
        self._scores = _output(self._detector, detector, (1, len(self._anchors), 1), (1, side, side, 3))
        side = blazepose.LANDMARK_SIDE
        shape = (1, side, side, 3)
        self._raw = _output(self._landmarks, landmarks, (1, raw[0] * raw[1]), shape)
        self._presence = _output(self._landmarks, landmarks, (1, 1), shape)
        heat = blazepose.HEATMAP_SIDE
        self._heatmap = _output(self._landmarks, landmarks, (1, heat, heat, raw[0]), shape)
        self._world = _output(self._landmarks, landmarks, (1, raw[0] * 3), shape)

    def candidates(self, image: Image, tile: tuple[int, int, int, int] | None = None) -> list[Candidate]:
        """People in an image (H, W, 3), blue green red, or in a tile x, y, width, height of it."""
        x, y, width, height = tile or (0, 0, image.shape[1], image.shape[0])
        side = candidates.DETECTOR_SIDE
        scale, bars = candidates.letterbox(width, height, side)
        size = (max(round(width / scale), 1), max(round(height / scale), 1))
        small = cv2.resize(image[y : y + height, x : x + width], size, interpolation=cv2.INTER_AREA)
        left, top = round(float(bars[0])), round(float(bars[1]))
        square = np.full((side, side, 3), 0, np.uint8)
        square[top : top + size[1], left : left + size[0]] = small
        self._detector.set_tensor(0, _tensor(square, 2.0 / 255, -1.0))
        self._detector.invoke()
        boxes = self._detector.get_tensor(self._boxes)[0].astype(float)
        scores = self._detector.get_tensor(self._scores)[0, :, 0].astype(float)
        rows = candidates.suppress(candidates.decode_candidates(boxes, scores, self._anchors))
        return candidates.to_candidates(rows, (x, y, width, height))

    def pose(self, image: Image, region: Region) -> Pose:
        """Landmarks of the person in a region of an image (H, W, 3), blue green red."""
        self._landmarks.set_tensor(0, _tensor(blazepose.crop(image, region), 1.0 / 255, 0.0))
        self._landmarks.invoke()
        get = self._landmarks.get_tensor
        raw: Array = get(self._raw).reshape(blazepose.RAW_COUNT, blazepose.RAW_VALUES).astype(float)
        world: Array = get(self._world).reshape(blazepose.RAW_COUNT, 3).astype(float)
        presence = float(get(self._presence)[0, 0])
        return blazepose.decode_pose(raw, presence, get(self._heatmap)[0], world, region)


def _tensor(image: Image, scale: float, offset: float) -> Any:
    """An image, blue green red, as the networks take it: (1, side, side, 3), red green blue, float32."""
    flipped = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    return (flipped.astype(np.float32) * np.float32(scale) + np.float32(offset))[None]


def _interpreter(path: Path, threads: int) -> Any:
    litert = extras.load("ai_edge_litert.interpreter", "video", "video")
    try:
        with _quiet():
            network = litert.Interpreter(str(path), num_threads=threads)
            network.allocate_tensors()
    except (ValueError, RuntimeError) as error:
        raise InputError(
            f"{path}: found no network ({error}); valid: simrecon models fetch --force"
        ) from error
    return network


def _output(network: Any, path: Path, shape: Sequence[int], input_shape: Sequence[int]) -> int:
    """Index of the output of a shape, in a network with the input shape."""
    inputs = network.get_input_details()
    if [tuple(one["shape"]) for one in inputs] != [tuple(input_shape)] or inputs[0]["index"] != 0:
        raise InputError(f"{path}: found a network of another kind; valid: BlazePose's")
    for one in network.get_output_details():
        if tuple(one["shape"]) == tuple(shape):
            return int(one["index"])
    raise InputError(f"{path}: found a network without an output of shape {tuple(shape)}; valid: BlazePose's")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """LiteRT writes a line to standard error when a network is made."""
    sys.stderr.flush()
    kept = os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(null)
