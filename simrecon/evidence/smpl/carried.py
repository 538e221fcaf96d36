"""The path of a camera that was carried, from a file that knows a person in the world and in the camera."""

from __future__ import annotations

import numpy as np
import scipy

from simrecon.evidence.options import Options
from simrecon.evidence.smpl.motion import SmplMotion, joints_m, offsets_m
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera

# A camera that turns by less is still: its one place follows better from the landmarks of all frames.
STILL_RAD = np.radians(10.0)
# A camera doesn't jump: so far its path may be from itself smoothed.
SMOOTH_S, JUMP_RAD, JUMP_M = 0.5, np.radians(3.0), 0.1
AGREE_M = 0.1  # so far the person may be from where the file has them in the camera's frame
NEAR_M = 0.3  # nobody is so near to a camera
USUAL = 0.95  # of the frames, for which these hold
ALONG = "along the path in the file"
# Why a path is of no use.
EACH_FRAME, FIRST_FRAME = (
    "the person is wanted in the frame of each image",
    "the file has no world that is level",
)


def along(camera_rotations: Array, camera_places: Array) -> Array:
    """The path (T, 4, 4) of a camera whose axes (T, 3, 3) and places (T, 3) in the world are known."""
    turns = rotations.conjugate(rotations.from_matrix(camera_rotations))
    return _path(turns, -rotations.rotate(turns, camera_places))


def at_rest(
    axes: Array, places: Array, world: SmplMotion, lens: Camera | None, options: Options
) -> tuple[Array | None, str]:
    """The path (T, 4, 4) of a camera that stands still where a file has it, and a note.

    There is none where landmarks of another file place it, or the user, or where it is not to be believed.

    Args:
        axes: (T, 3, 3) of the camera in the world.
        places: (T, 3) of it.
        world: the person.
        lens: of the file or the user.
        options: of the user.
    """
    if lens is None or lens.path is not None or options.landmarks:
        return None, ""
    first = along(axes[:1], np.median(places, axis=0, keepdims=True))
    path: Array = np.broadcast_to(first, (len(axes), 4, 4))
    if reason := fault(path, world):
        return None, f"where it stands is not known ({reason})"
    return path, "it stands where the file has it"


def between(world: SmplMotion, seen: SmplMotion) -> Array:
    """The path (T, 4, 4) on which a camera sees the root of `world` where and as `seen` has it.

    With root rotations G_w and G_c and pelvises x_w and x_c: R = G_c G_wᵀ and t = x_c - R x_w.
    """
    turns = rotations.multiply(seen.rotations[:, 0], rotations.conjugate(world.rotations[:, 0]))
    pelvis = offsets_m(world.model)[0]
    return _path(turns, seen.trans_m + pelvis - rotations.rotate(turns, world.trans_m + pelvis))


def placed(world: SmplMotion, seen: SmplMotion, camera: Camera) -> tuple[Array | None, str]:
    """Where a camera is (T, 4, 4) that hardly turns, by both motions, and what there is to say of it.

    That is one place, if it will do: its axes are the mean of those of all frames, and it is where it has the
    person in the middle of them.
    """
    each = between(world, seen)
    u, _, v = np.linalg.svd(each[:, :3, :3].mean(axis=0))
    axes = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    pelvis = offsets_m(world.model)[0]
    off = seen.trans_m + pelvis - (world.trans_m + pelvis) @ axes.T  # (T, 3)
    path = np.eye(4)
    path[:3, :3], path[:3, 3] = axes, np.median(off, axis=0)
    still: Array = np.broadcast_to(path, each.shape)
    outside = _unseen(joints_m(seen)[:, 0], camera)
    if reason := outside or fault(still, world, seen):
        if not (outside or fault(each, world, seen)):
            return each, ALONG
        return None, f"where the camera stands is not known ({reason})"
    return still, "the camera stands where both motions in the file have it"


def _unseen(pelvis_m: Array, camera: Camera) -> str:
    """Why nobody is to be seen whose pelvis is at (T, 3) of the camera's frame; nothing if that is so."""
    size = camera.lens.image_size_px
    still = cameras.still(camera.lens, np.eye(4), len(pelvis_m))
    pixels = cameras.project(still, pelvis_m)
    with np.errstate(invalid="ignore"):
        inside = ((pixels >= 0) & (pixels <= size)).all(axis=-1) & (pelvis_m[:, 2] > NEAR_M)
    share = float(1 - inside.mean())
    return f"the person is outside the image in {100 * share:.0f} % of the frames" if share > 0.5 else ""


def _path(turns: Array, translation: Array) -> Array:
    path = np.tile(np.eye(4), (len(turns), 1, 1))
    path[:, :3, :3] = rotations.matrix(turns)
    path[:, :3, 3] = translation
    return path


def centres_m(path: Array) -> Array:
    """Where the camera is, (T, 3)."""
    return -(np.swapaxes(path[:, :3, :3], 1, 2) @ path[:, :3, 3:])[..., 0]


def fault(path: Array, world: SmplMotion, seen: SmplMotion | None = None) -> str:
    """Why a path is not to be believed; nothing if it is.

    Args:
        path: (T, 4, 4).
        world: the person in its world.
        seen: the person in the camera's frame, where the file holds it independently of the path.
    """
    own = (path[:, None, :3, :3] @ joints_m(world)[..., None])[..., 0] + path[:, None, :3, 3]  # (T, B, 3)
    behind = float(np.mean(own[:, 0, 2] <= 0))
    if behind > 1 - USUAL:
        return f"by its path, the person is behind it in {100 * behind:.0f} % of the frames"
    if seen is not None:
        off = float(np.quantile(np.linalg.norm(own - joints_m(seen), axis=-1).mean(axis=1), USUAL))
        if off > AGREE_M:
            return f"by its path, the person in the camera's frame is {off:.2f} m off"
    turns = rotations.from_matrix(path[:, :3, :3])
    flips = np.sum(turns[1:] * turns[:-1], axis=-1, keepdims=True) < 0  # q and -q are one rotation
    turns[1:] *= np.cumprod(np.where(flips, -1.0, 1.0), axis=0)
    places, interval = centres_m(path), float(np.median(np.diff(world.times_s)))
    steady, smooth = _smoothed(turns, interval), _smoothed(places, interval)
    steady /= np.linalg.norm(steady, axis=-1, keepdims=True)
    angle = float(np.quantile(rotations.angle_between(steady, turns), USUAL))
    distance = float(np.quantile(np.linalg.norm(smooth - places, axis=-1), USUAL))
    if angle > JUMP_RAD or distance > JUMP_M:
        return f"its path jumps by {np.degrees(angle):.0f} degrees or {distance:.2f} m"
    return ""


def _smoothed(values: Array, interval_s: float) -> Array:
    """Values (T, C) by parabolas over `SMOOTH_S`, also at the ends."""
    window = min(2 * round(SMOOTH_S / interval_s / 2) + 1, len(values) - 1 + len(values) % 2)
    return scipy.signal.savgol_filter(values, window, 2, axis=0) if window > 2 else values


def turning(path: Array) -> str:
    """How a camera moves whose path follows from a person; nothing if it may as well stand still."""
    turns = rotations.from_matrix(path[:, :3, :3])
    angle = float(np.quantile(rotations.angle_between(turns, turns[:1]), USUAL))
    return f"the camera turns by {np.degrees(angle):.0f} degrees" if angle > STILL_RAD else ""


def choose(
    lens: Camera | None, path: Array | None, moves: str, reason: str
) -> tuple[Camera | None, Array | None, str]:
    """The lens and the path of a camera that moves: both, or neither.

    Args:
        lens: of the file or the user; with a path of its own it is that of a camera that stands still.
        path: (T, 4, 4), or None with a reason.
        moves: how the camera moves.
        reason: why the path can't be used, or nothing.

    Returns:
        Lens and path, and what of them is used, for the reading.
    """
    if lens is None:
        return None, None, moves
    if path is None or reason or lens.path is not None:
        return None, None, f"{moves}, so its lens is not used" + (f" ({reason})" if reason else "")
    return lens, path, f"{moves}, {ALONG}"
