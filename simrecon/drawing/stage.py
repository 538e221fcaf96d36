"""A scene as a picture, with poses of a motion in it: from the front, and as the camera sees it."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon import body as bodies
from simrecon import prior
from simrecon import scene as scenes
from simrecon.body import primitives
from simrecon.body.primitives import FEET
from simrecon.drawing import canvas
from simrecon.drawing.animation import Animation
from simrecon.drawing.canvas import Image
from simrecon.drawing.overlay import contact_sheet
from simrecon.drawing.painter import Painter
from simrecon.drawing.views import View, has_view, three_quarter
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.io.messages import counted
from simrecon.sim.models import compile_text
from simrecon.sim.poses import posed
from simrecon.types import Array, Body, Camera, KinematicFit, Scene

POSES = 7
"""Of a motion in one picture."""
_STEP_S = 0.01
_ELEVATION_RAD = np.deg2rad(22)
_ASIDE_M = 0.7


def draw(scene: Scene, fit: KinematicFit | None = None) -> Image:
    """The scene from the front, beside it the camera's view where the motion has one.

    Args:
        scene: what to draw.
        fit: motion in it; without one a person stands beside the items, for scale.
    """
    if fit is None:
        person = upright()
        return _paint(scene, person, beside(scene, person), None, _title(scene))
    frames = np.unique(np.linspace(0, len(fit.qpos) - 1, POSES).round().astype(int))
    times = f"{fit.times_s[frames[0]]:.2f} to {fit.times_s[frames[-1]]:.2f} s"
    first = _paint(scene, fit.body, fit.qpos[frames], None, f"{counted(len(frames), 'pose')}, {times}")
    if fit.camera is None or not has_view(fit.camera):
        return first
    middle = int(frames[len(frames) // 2])
    shown = slice(middle, middle + 1)
    camera = cameras.at(fit.camera, shown)
    second = _paint(scene, fit.body, fit.qpos[shown], camera, f"camera, {fit.times_s[middle]:.2f} s")
    return contact_sheet([first, second], 2)


def upright() -> Body:
    """A person of the usual size."""
    height = primitives.default_height_m()
    skeleton = bodies.scaled({}, height)
    return bodies.build(skeleton, height_m=height, mass_kg=primitives.default_mass_kg(height), sole_m=0.02)


def beside(scene: Scene, person: Body, gap_m: float = _ASIDE_M) -> Array:
    """Configuration (1, nq) of a person who stands relaxed on the left of all items."""
    model = compile_text(scenes.build(person.mjcf, scene, _STEP_S))
    low, high = _bounds(model, [_rest(model, person)])[1]
    qpos = _rest(model, person)[: 7 + 4 * len(person.skeleton.names[1:])]
    qpos[0] = (low[0] + high[0]) / 2 if np.isfinite(low).all() else 0.0
    qpos[1] = high[1] + gap_m if np.isfinite(low).all() else 0.0
    qpos[2] += float(scenes.support_height(scene, qpos[:2]))
    return qpos[None]


def _rest(model: mujoco.MjModel, person: Body) -> Array:
    """All of the model at rest, the person relaxed with the soles at height zero."""
    qpos: Array = np.array(model.qpos0)
    count = len(person.skeleton.names) - 1
    qpos[:7] = 0.0
    qpos[3] = 1.0
    qpos[7 : 7 + 4 * count] = rotations.exp(prior.gaussian(person.skeleton).mean_rad).ravel()
    data = next(posed(model, qpos[None]))
    feet = [model.geom(foot).id for foot in FEET]
    reach = np.abs(data.geom_xmat[feet].reshape(-1, 3, 3)[:, 2] * model.geom_size[feet]).sum(axis=1)
    qpos[2] = -float((data.geom_xpos[feet, 2] - reach).min())
    return qpos


def _paint(scene: Scene, person: Body, poses: Array, camera: Camera | None, caption: str) -> Image:
    """One picture of as many persons as there are poses (P, nq)."""
    mjcf = scenes.build(_crowd(person.mjcf, len(poses)), scenes.hard_floor(scene), _STEP_S)
    model = compile_text(mjcf)
    qpos = np.array(model.qpos0)
    qpos[: poses.size] = poses.ravel()
    (low, high), _ = _bounds(model, [qpos])
    if camera is None:
        camera = three_quarter(low, high, _facing(poses), _ELEVATION_RAD)
    corners = np.stack((low[:2], high[:2]))
    clip = Animation(model=model, times_s=np.zeros(1), qpos=qpos[None], camera=camera, ground_m=corners)
    size = camera.lens.image_size_px
    scale = min(1.0, 960 / max(size))
    shape = (round(size[0] * scale), round(size[1] * scale))
    view = View(np.zeros(2), np.array(shape) / size, shape)
    image = Painter(clip).draw(0, view, None, caption)
    return _padded(image, (960, 720))  # pictures of one size stand side by side


def _padded(image: Image, size: tuple[int, int]) -> Image:
    """The image in the middle of a plain page, smaller if it has to be."""
    height, width = image.shape[:2]
    scale = min(size[0] / width, size[1] / height)
    small = canvas.scaled(image, (round(width * scale), round(height * scale)))
    page = np.full((size[1], size[0], 3), 245, np.uint8)
    y, x = (size[1] - small.shape[0]) // 2, (size[0] - small.shape[1]) // 2
    page[y : y + small.shape[0], x : x + small.shape[1]] = small
    return page


def _crowd(mjcf: str, count: int) -> str:
    """MJCF of several copies of a person."""
    spec = mujoco.MjSpec.from_string(mjcf)
    crowd = mujoco.MjSpec()
    crowd.compiler.degree = False
    for option in ("integrator", "jacobian", "disableflags"):
        setattr(crowd.option, option, getattr(spec.option, option))
    for i in range(count):
        crowd.attach(spec.copy(), prefix=f"{i}/", frame=crowd.worldbody.add_frame())
    text: str = crowd.to_xml()
    return text


def _facing(poses: Array) -> float:
    """Mean direction in which the pelvis looks, rad from +x."""
    forward = rotations.matrix(poses[:, 3:7])[:, :2, 0].mean(axis=0)
    return float(np.arctan2(forward[1], forward[0]))


def _bounds(
    model: mujoco.MjModel, configurations: list[Array]
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Corners of the box that holds persons and items, and of the one that holds the items alone."""
    whole, items = [], []
    for data in posed(model, np.array(configurations)):
        for geom in range(model.ngeom):
            name = model.geom(geom).name
            if name == scenes.GROUND_GEOM or model.geom_rgba[geom, 3] == 0:
                continue
            axes = data.geom_xmat[geom].reshape(3, 3)
            centre = data.geom_xpos[geom] + axes @ model.geom_aabb[geom, :3]
            reach = np.abs(axes) @ model.geom_aabb[geom, 3:]
            whole.append((centre - reach, centre + reach))
            if name.startswith(scenes.ITEM_PREFIX):
                items.append(whole[-1])
    none = (np.full(3, np.inf), np.full(3, -np.inf))
    both = [np.array(boxes) if boxes else np.array([none]) for boxes in (whole, items)]
    (a, b) = ((boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)) for boxes in both)
    return a, b


def _title(scene: Scene) -> str:
    names = ", ".join(item.name for item in scene.items)
    return names if names else "floor"
