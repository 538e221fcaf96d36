"""The camera in the view: its frustum with the frame of the video, and that frame behind all else."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from simrecon.drawing.video import Image
from simrecon.errors import InputError
from simrecon.studio import camera as cameras
from simrecon.studio.camera import Seen
from simrecon.types import Array

_PICTURE_S, _SLOWLY_S = 0.1, 3.0
"""Between two frames of the video, while the cursor moves; where a browser is slow."""


class Sight:
    """What the camera saw, as viser draws it.

    Attributes:
        late: a frame of the video was passed over while the cursor moved.
    """

    def __init__(self, scene: Any, on_video: Callable[[], None]) -> None:
        """Draw nothing yet.

        Args:
            scene: of viser.
            on_video: is called when the video has been read.
        """
        self._scene, self._on_video = scene, on_video
        self._frustum: Any = None
        self._seen: Seen | None = None
        self._images: dict[int, Image] = {}
        self.late = self._under = False
        self._pictured, self._wait_s = 0.0, _PICTURE_S

    def draw(self, seen: Seen | None, times_s: Array | None, visible: bool) -> None:
        """Draw the frustum of a camera; the video is read on another thread."""
        if seen is not self._seen:
            self.drop()
            self._seen = seen
            if seen is not None and times_s is not None:
                self._add(seen)
                read = threading.Thread(target=self._read, args=(seen, times_s), daemon=True)
                read.start()
        if self._frustum is not None:
            self._frustum.visible = visible

    def show(self, frame: int, frustum: bool, aspect: float | None) -> None:
        """Show a frame; browsers may take long over a picture: while the cursor moves, not all are shown."""
        if self._seen is None or self._frustum is None:
            return
        self._frustum.visible = frustum
        self._frustum.position, self._frustum.wxyz = self._seen.pose(frame)
        now, image = time.monotonic(), self._images.get(frame)
        self.late = now - self._pictured < self._wait_s
        if self.late:
            return
        self._pictured = now
        if image is not None and frustum:
            self._frustum.image = image
        self._lay_under(None if image is None or aspect is None else framed(image, aspect))

    def hurry(self) -> None:
        """The next picture is shown at once."""
        self._pictured = 0.0

    def spare(self) -> None:
        """A browser draws slowly: the video waits until the cursor rests."""
        self._wait_s = _SLOWLY_S

    def pose(self, frame: int) -> tuple[Array, Array, float]:
        """Place, orientation and vertical field of view of the camera.

        Raises:
            InputError: it is not known where it stood.
        """
        if self._seen is None:
            raise InputError("it is not known where the camera stood")
        return (*self._seen.pose(frame), self._seen.fov_rad)

    def drop(self) -> None:
        """Take it away."""
        self._seen, self._images = None, {}
        if self._frustum is not None:
            self._frustum.remove()
            self._frustum = None
        self._lay_under(None)

    def _add(self, seen: Seen) -> None:
        width, height = seen.camera.lens.image_size_px
        self._frustum = self._scene.add_camera_frustum(
            "/camera",
            seen.fov_rad,
            width / height,
            scale=0.3,
            color=(90, 100, 115),
            thickness=0.006,
            cast_shadow=False,
        )

    def _read(self, seen: Seen, times_s: Array) -> None:
        """Read the frames of the video."""
        try:
            images = cameras.images(seen, times_s)
        except InputError:
            return
        if seen is self._seen:
            self._images = dict(enumerate(images))
            self.hurry()
            self._on_video()

    def _lay_under(self, image: Image | None) -> None:
        """Put an image behind all that is drawn, or none."""
        if image is None and not self._under:
            return
        self._under = image is not None
        self._scene.set_background_image(image, format="jpeg", jpeg_quality=70)


def framed(image: Image, aspect: float) -> Image:
    """An image with bars beside it, or above and below, so that it fills a view of another shape undistorted.

    Args:
        image: (H, W, 3).
        aspect: width over height of the view.
    """
    height, width = image.shape[:2]
    wide, high = max(width, round(height * aspect)), max(height, round(width / aspect))
    page = np.full((high, wide, 3), 235, np.uint8)
    y, x = (high - height) // 2, (wide - width) // 2
    page[y : y + height, x : x + width] = image
    return page
