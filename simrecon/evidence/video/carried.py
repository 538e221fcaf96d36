"""The camera of a video as its background shows it: standing still, or with the path along which it turns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.evidence.camera import turning
from simrecon.evidence.camera.turning import Turn, Views
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, Lens

LEVEL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""World to camera of one that stands upright and looks along x."""


@dataclass(frozen=True, eq=False)
class Carried:
    """A camera, and what its background said of it.

    Attributes:
        camera: with a path if it turns; else as it was known.
        zooms: (T,) focal length of each frame over that of the camera.
        notes: for the reading; empty if the camera stands still.
    """

    camera: Camera
    zooms: Array
    notes: tuple[str, ...] = ()

    def in_one_lens(self, points_px: Array) -> Array:
        """Pixels (T, J, 2) of a lens that zooms, as they would be through that of the camera."""
        centre = self.camera.lens.matrix_px[:2, 2]
        return np.asarray(centre + (points_px - centre) / self.zooms[:, None, None])


def follow(camera: Camera, views: Views) -> Carried:
    """The path of a camera, by the homographies of its background.

    Args:
        camera: its lens as far as it is known, and where it stands in the first frame if that is known.
        views: of the frames.
    """
    ones, known = np.ones(len(views.shares)), float((views.shares > 0).mean())
    if turning.is_still(views, camera.lens.image_size_px):
        return Carried(camera, ones)
    if known < turning.KNOWN_LEAST:
        return Carried(camera, ones, (f"the camera moves, and is taken for still: {_lost(views)}",))
    lens, found = _lens(camera.lens, views)
    turn = turning.turned(views, lens)
    notes = [f"the camera turns by up to {_most_deg(turn):.0f}°{found}"]
    if turn.zooms.max() > turn.zooms.min():
        notes.append(
            f"it zooms from {turn.zooms.min():.2f} to {turn.zooms.max():.2f} times the first focal length"
        )
    if known < 1:
        notes.append(_lost(views))
    agreeing = float(views.shares[views.shares > 0].mean())
    if turn.unlike > turning.UNLIKE_MAX or agreeing < turning.AGREE_LEAST:
        notes.append(
            "it is carried as well, which the background does not measure: the way of the person may be wrong"
        )
    path = _path(turn, None if camera.path is None else camera.path[0])
    return Carried(Camera(lens, path), turn.zooms, tuple(notes))


def _lens(lens: Lens, views: Views) -> tuple[Lens, str]:
    """The lens, or where nobody knows it the one by which the background turns, and what to say of it."""
    if not lens.focal_sigma:
        return lens, ""
    offset, sigma = turning.focal_offset(views, lens)
    matrix = lens.matrix_px.copy()
    matrix[[0, 1], [0, 1]] *= np.exp(offset)
    found = replace(lens, matrix_px=matrix, focal_sigma=sigma)
    said = f"{cameras.focal_px(found):.0f} px to ±{100 * np.expm1(sigma):.0f} %"
    return found, f", by which the focal length is {said}"


def _path(turn: Turn, first: Array | None) -> Array:
    """World to camera (T, 4, 4) from the place in the first frame; without one it is level on average."""
    path = np.tile(np.eye(4), (len(turn.rotations), 1, 1))
    if first is None:
        mean, _, right = np.linalg.svd(turn.rotations.sum(axis=0))
        path[:, :3, :3] = turn.rotations @ (mean @ right).T @ LEVEL
        return path
    path[:, :3] = turn.rotations @ first[:3]
    return path


def _most_deg(turn: Turn) -> float:
    """The largest angle between the first orientation and another."""
    vectors = rotations.log(rotations.from_matrix(turn.rotations))
    return float(np.degrees(np.linalg.norm(vectors, axis=-1).max()))


def _lost(views: Views) -> str:
    missing = int((views.shares == 0).sum())
    return f"its background could not be followed in {missing} of {len(views.shares)} frames"
