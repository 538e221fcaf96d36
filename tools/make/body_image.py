"""Make docs/images/bodies.jpg: three body shapes side by side, primitives and skin.

usage: python -m tools.make.body_image
"""

from __future__ import annotations

import cv2
import mujoco
import numpy as np

from simrecon import body as bodies
from simrecon.body import shape, shape_fit
from simrecon.drawing import canvas
from simrecon.drawing.animation import Animation
from simrecon.drawing.painter import Painter
from simrecon.drawing.views import View
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import configurations
from simrecon.types import Array, Body, Camera, Lens
from tools import CHECKOUT

TARGET = CHECKOUT / "docs" / "images" / "bodies.jpg"
PEOPLE = (("1.58 m, 50 kg", 1.58, 50.0), ("1.75 m, 70 kg", 1.75, 70.0), ("1.85 m, 115 kg", 1.85, 115.0))
SIZE, HEIGHT_M = (560, 740), 2.0
SKIN = np.array([178.0, 190.0, 208.0])


def main() -> None:
    """Write the picture and say how large it is."""
    columns = [_column(text, height_m, mass_kg) for text, height_m, mass_kg in PEOPLE]
    page = cv2.resize(np.hstack(columns), None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(TARGET), page, [cv2.IMWRITE_JPEG_QUALITY, 85])
    print(f"{TARGET}: {TARGET.stat().st_size // 1000} kB")


def _column(text: str, height_m: float, mass_kg: float) -> canvas.Image:
    betas = shape_fit.fit({}, height_m=height_m, mass_kg=mass_kg)
    person = bodies.build(betas=betas, height_m=height_m, mass_kg=mass_kg)
    qpos = _standing(person, betas)
    model = mujoco.MjModel.from_xml_string(person.mjcf)
    camera = _camera()
    clip = Animation(model, np.zeros(1), qpos[None], camera=camera)
    blank = np.full((SIZE[1], SIZE[0], 3), 244, np.uint8)
    view = View(np.zeros(2), np.ones(2), SIZE)
    painter = Painter(clip)
    drawn = painter.draw(0, view, blank.copy())
    drawn[: SIZE[1] // 12] = 244  # the frame's number says nothing here
    skin = blank.copy()
    _paint_skin(skin, camera, betas, height_m, qpos)
    both = np.hstack((drawn[:, 10:-30], skin[:, 10:-30]))
    canvas.label(both, text, 0, canvas.LIGHT)
    return both


def _standing(person: Body, betas: Array) -> Array:
    """The relaxed stance of the shape space, soles on the floor, turned a little to the side."""
    _, axes = shape.space().frames(betas)
    tree = person.skeleton
    local = np.empty((16, 4))
    for i, parent in enumerate(tree.parents[1:], start=1):
        rest = rotations.matrix(tree.rest[i])
        local[i - 1] = rotations.from_matrix((axes[parent] @ rest).T @ axes[i])
    qpos = np.concatenate((np.zeros(3), [1.0, 0, 0, 0], local.ravel()))
    marks = configurations(person, qpos[None])[1][0]
    qpos[2] = -marks[tree.point_names.index("left_toe"), 2] + 0.02
    return qpos


def _camera() -> Camera:
    turn, far = np.deg2rad(28), 9.0
    focal = SIZE[1] / HEIGHT_M * far * 0.95
    towards = np.array([np.cos(turn), np.sin(turn), 0.0])
    right = np.cross([0.0, 0.0, 1.0], towards)
    rotation = np.stack((right, [0.0, 0.0, -1.0], -towards))
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ (np.array([0.0, 0.0, 0.97]) + far * towards)
    matrix = np.array([[focal, 0, SIZE[0] / 2], [0, focal, SIZE[1] / 2], [0, 0, 1]])
    return cameras.still(Lens(matrix, np.zeros(5), SIZE), transform)


def _paint_skin(image: canvas.Image, camera: Camera, betas: Array, height_m: float, qpos: Array) -> None:
    space = shape.space()
    skin = space.vertices_m(betas) * height_m / shape.stature_m(betas)
    skin = skin + np.array([0.0, 0.0, qpos[2]])
    corners = skin[space.faces]  # (F, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    eye = cameras.centre_m(camera)[0]
    facing = np.sum(normal * (eye - corners.mean(axis=1)), axis=1) > 0
    order = np.argsort(-np.linalg.norm(eye - corners.mean(axis=1), axis=1))
    order = order[facing[order]]
    light = np.array([0.6, 0.3, 0.75]) / np.linalg.norm([0.6, 0.3, 0.75])
    tone = 0.55 + 0.45 * np.clip(normal @ light, 0, 1)
    canvas.paint(image, cameras.project(camera, corners[order]), tone[order, None] * SKIN, 1.0)


if __name__ == "__main__":
    main()
