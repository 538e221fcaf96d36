"""One frame of the overlay: the body's quads sorted by distance, the scene, landmarks and forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon import scene as scenes
from simrecon.drawing import canvas, shapes
from simrecon.drawing.canvas import Colour, Image
from simrecon.geometry import camera as cameras
from simrecon.types import Array, Camera, Lens

# Colours are blue, green, red.
_LEFT, _RIGHT, _CENTRE, _ITEM = (48, 134, 240), (172, 152, 36), (196, 192, 188), (150, 176, 200)
_FORCE, _FALLBACK, _HIDDEN = (40, 240, 250), (170, 170, 255), (140, 140, 140)
_SKY, _TILES = (240, 238, 236), ((216, 212, 208), (228, 225, 222))
_PLAIN_RGBA = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default
_ALPHA = 0.75
_ARROW_M_PER_WEIGHT = 0.5
_LEAST_FORCE = 0.01  # of body weight; smaller forces are not drawn
_TILE_M = 0.5
_BODY_CELL_M, _ITEM_CELL_M = 0.08, 0.1
_LIGHT_FROM = np.array([0.35, 0.45, 0.8])  # to the right, towards the camera, up


@dataclass(frozen=True, eq=False)
class Clip:
    """What is drawn. T frames, J landmarks, C body parts.

    Attributes:
        model: body and scene; geoms that don't move and those named `item/...` are scene.
        times_s: (T,).
        qpos: (T, nq).
        camera: None, or without extrinsics: a view is made up, and there is nothing to draw on.
        keypoints_px: (T, J, 2) in the camera's image, NaN = not seen.
        scores: (T, J) in [0, 1].
        contact_point_m: (T, C, 3), NaN without contact.
        contact_force_N: (T, C, 3) on the body.
        status: (T,) other than 0 where a frame is not simulated.
        ground_m: (N, 2) points that the floor is drawn around; None: the person's path.
    """

    model: mujoco.MjModel
    times_s: Array
    qpos: Array
    camera: Camera | None = None
    keypoints_px: Array | None = None
    scores: Array | None = None
    contact_point_m: Array | None = None
    contact_force_N: Array | None = None
    status: NDArray[np.uint8] | None = None
    ground_m: Array | None = None


@dataclass(frozen=True, eq=False)
class View:
    """A crop of the camera's image, scaled; `size` = width and height of the output.

    Attributes:
        origin_px: (2,) upper left corner of the crop; 0 is the edge of the first pixel.
        scale: (2,) output pixels per pixel.
    """

    origin_px: Array
    scale: Array
    size: tuple[int, int]

    def pixels(self, image_px: Array) -> Array:
        """Pixels of the camera's image (..., 2) → pixels of the output; whole numbers are pixel centres."""
        return (image_px + 0.5 - self.origin_px) * self.scale - 0.5


class Painter:
    """Holds what is the same for all frames of a clip, and draws one at a time."""

    def __init__(self, clip: Clip) -> None:
        """Cut the geoms into quads; make up a camera if there is none."""
        model = clip.model
        self.clip, self.model, self.data = clip, model, mujoco.MjData(model)
        names = [model.geom(i).name or model.body(model.geom_bodyid[i]).name for i in range(model.ngeom)]
        moving = model.body_weldid[model.geom_bodyid] != 0
        shown = [i for i in range(model.ngeom) if model.geom_rgba[i, 3] > 0]
        person = [i for i in shown if moving[i] and not names[i].startswith(scenes.ITEM_PREFIX)]
        flat = [i for i in shown if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE]
        self.grounds = flat + [i for i in shown if names[i] == scenes.GROUND_GEOM and i not in flat]
        person = [i for i in person if i not in self.grounds]
        items = [i for i in shown if i not in {*person, *self.grounds}]
        self.boxes = [i for i in items if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX]
        self.person = shapes.surface(model, person, _BODY_CELL_M)
        self.all = shapes.surface(model, person + items, max(_ITEM_CELL_M, _coarse_cell_m(model, items)))
        self.colours = np.array([_side_colour(name) for name in names], float)
        self.colours[items] = _ITEM
        painted = [i for i in items if not np.allclose(model.geom_rgba[i], _PLAIN_RGBA)]
        self.colours[painted] = 255 * model.geom_rgba[painted, 2::-1]
        trees = np.unique(model.body_rootid[model.geom_bodyid[person]])
        masses = model.body_mass[np.isin(model.body_rootid, trees) & (model.body_weldid != 0)]
        self.weight_N = max(float(masses.sum() * (np.linalg.norm(model.opt.gravity) or 9.81)), 1e-9)
        self.plain: tuple[View, Array, Image] | None = None
        self.camera = clip.camera if clip.camera is not None and has_view(clip.camera) else self._made_up()
        self.still = cameras.is_still(self.camera)
        self.limit = 1.5 * _corner_radius(self.camera)

    def draw(self, frame: int, view: View, image: Image | None, caption: str | None = None) -> Image:
        """One frame over `image`, or over plain ground; `caption` instead of number and time."""
        clip, camera = self.clip, self._at(frame)
        self._pose(frame)
        surface = self.person if image is not None else self.all
        vertices = surface.place(self.data.geom_xpos, self.data.geom_xmat)  # (V, 3)
        if image is None:
            image = self._ground(camera, view)
            self._shadow(image, camera, view)
            self._faces(image, camera, view, surface, vertices, 1.0)
        else:
            self._wires(image, camera, view)
            self._faces(image, camera, view, surface, vertices, _ALPHA)
        if clip.contact_point_m is not None and clip.contact_force_N is not None:
            force = clip.contact_force_N[frame] * (_ARROW_M_PER_WEIGHT / self.weight_N)  # (C, 3) m
            self._forces(image, camera, view, clip.contact_point_m[frame], force)
        if clip.keypoints_px is not None and clip.camera is self.camera:
            scores = np.ones(clip.keypoints_px.shape[1]) if clip.scores is None else clip.scores[frame]
            canvas.dots(image, view.pixels(clip.keypoints_px[frame]), scores)
        if caption is None:
            caption = f"{frame + 1}/{len(clip.times_s)}   {clip.times_s[frame]:.2f} s"
        canvas.label(image, caption, 0, canvas.LIGHT)
        if clip.status is not None and clip.status[frame] != 0:
            canvas.label(image, "not simulated: kinematic fallback", 1, _FALLBACK)
        return image

    def bounds_px(self, frames: NDArray[np.int64]) -> tuple[Array, Array]:
        """Corners (2,), (2,) of the part of the camera's image that holds the person in these frames."""
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for frame in frames:
            self._pose(int(frame))
            vertices = self.person.place(self.data.geom_xpos, self.data.geom_xmat)
            pixels = self._project(self._at(int(frame)), vertices)[0]
            pixels = pixels[np.isfinite(pixels).all(axis=-1)]
            if len(pixels):
                low, high = np.minimum(low, pixels.min(axis=0)), np.maximum(high, pixels.max(axis=0))
        size = np.array(self.camera.lens.image_size_px, float)
        if not np.isfinite(low).all():
            return np.zeros(2), size
        margin = 0.08 * float((high - low).max()) + 1
        low, high = low - margin * np.array([1.0, 1.8]), high + margin  # more above, for the text
        low, high = np.maximum(low, -size), np.minimum(high, 2 * size)
        widen = np.maximum(0.45 * (high - low)[1] - (high - low)[0], 0) / 2 * np.array([1.0, 0.0])
        return low - widen, np.maximum(high + widen, low + 2)

    def _pose(self, frame: int) -> None:
        self.data.qpos[:] = self.clip.qpos[frame]
        mujoco.mj_kinematics(self.model, self.data)

    def _at(self, frame: int) -> Camera:
        return cameras.at(self.camera, slice(frame, frame + 1))

    def _project(self, camera: Camera, points_m: Array) -> tuple[Array, Array]:
        """World points (N, 3) → pixels (N, 2) of the camera's image, NaN out of view; distances (N,)."""
        xyz = cameras.to_camera(camera, points_m)
        with np.errstate(divide="ignore", invalid="ignore"):
            rays = xyz[:, :2] / xyz[:, 2:]
        # Far outside the image the distortion polynomial folds back into it.
        seen = (xyz[:, 2] > 0.05) & (np.hypot(rays[:, 0], rays[:, 1]) < self.limit)
        return cameras.distort(camera.lens, np.where(seen[:, None], rays, np.nan)), np.linalg.norm(
            xyz, axis=-1
        )

    def _faces(
        self,
        image: Image,
        camera: Camera,
        view: View,
        surface: shapes.Surface,
        vertices: Array,
        alpha: float,
    ) -> None:
        image_px, distance = self._project(camera, vertices)
        pixels = view.pixels(image_px)[surface.faces]  # (F, 4, 2)
        corners = vertices[surface.faces]  # (F, 4, 3)
        normals = _unit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))  # (F, 3)
        towards = _unit(cameras.centre_m(camera) - corners.mean(axis=1))  # (F, 3)
        facing = (normals * towards).sum(axis=-1)  # (F,)
        keep = np.flatnonzero((facing > 0) & np.isfinite(pixels).all(axis=(1, 2)))
        if not len(keep):
            return
        keep = keep[np.argsort(-distance[surface.faces[keep]].mean(axis=1), kind="stable")]
        lambert = np.maximum(normals[keep] @ _light(camera), 0.0)
        shade = (0.5 + 0.58 * lambert) * (0.6 + 0.4 * np.sqrt(facing[keep]))  # (F,)
        colours = np.minimum(self.colours[surface.face_geom[keep]] * shade[:, None], 255.0)  # (F, 3)
        canvas.paint(image, pixels[keep], colours, alpha)

    def _ground(self, camera: Camera, view: View) -> Image:
        """Chequered ground of half-metre tiles that fades out; kept while the camera stands still."""
        places = self.data.geom_xpos[self.grounds]
        kept = self.plain if self.still else None
        if kept is not None and kept[0] is view and np.allclose(kept[1], places, atol=1e-3):
            return kept[2].copy()
        width, height = view.size
        image = np.full((height, width, 3), _SKY, np.uint8)
        for ground in self.grounds:
            path = self.clip.qpos[:, :2] if self.clip.ground_m is None else self.clip.ground_m
            tiles, colours = _tiles(path)
            tiles[..., 2] = self._height(ground, tiles[..., :2])
            pixels = view.pixels(self._project(camera, tiles.reshape(-1, 3))[0]).reshape(-1, 4, 2)
            keep = np.isfinite(pixels).all(axis=(1, 2))
            canvas.paint(image, pixels[keep], colours[keep], 1.0)
        self.plain = (view, places, image)
        return image.copy()

    def _height(self, ground: int, xy_m: Array) -> Array:
        """Height of the upper side of a ground, a plane or a slab, at points (..., 2)."""
        normal = self.data.geom_xmat[ground].reshape(3, 3)[:, 2]
        slab = self.model.geom_type[ground] == mujoco.mjtGeom.mjGEOM_BOX
        top = self.data.geom_xpos[ground] + normal * (self.model.geom_size[ground, 2] if slab else 0.0)
        return np.asarray(top[2] - (xy_m - top[:2]) @ normal[:2] / normal[2])

    def _shadow(self, image: Image, camera: Camera, view: View) -> None:
        """The person's shadow on the ground, light from straight above."""
        if not self.grounds:
            return
        vertices = self.person.place(self.data.geom_xpos, self.data.geom_xmat)
        vertices[:, 2] = self._height(self.grounds[0], vertices[:, :2])
        pixels = view.pixels(self._project(camera, vertices)[0])
        mask = np.zeros(image.shape[:2], np.uint8)
        for geom in np.unique(self.person.vertex_geom):
            outline = pixels[self.person.vertex_geom == geom]
            if np.isfinite(outline).all():
                canvas.hull(mask, outline)
        soft = cv2.GaussianBlur(mask, (0, 0), max(1.0, view.size[1] / 200))
        image[:] = (image * (1 - 0.3 / 255 * soft[..., None])).astype(np.uint8)

    def _wires(self, image: Image, camera: Camera, view: View) -> None:
        """Edges of the scene's boxes; those behind their own box are darker and thinner."""
        eye = cameras.centre_m(camera)[0]
        for box in self.boxes:
            rotation, centre = self.data.geom_xmat[box].reshape(3, 3), self.data.geom_xpos[box]
            half = self.model.geom_size[box]
            ends, meeting = shapes.box_edges(half)
            local = (eye - centre) @ rotation  # (3,)
            seen = np.stack((local > half, local < -half), axis=-1).reshape(6)
            along = ends[:, :1] + np.linspace(0, 1, 25)[:, None] * (ends[:, 1:] - ends[:, :1])  # (12, 25, 3)
            points = (along @ rotation.T + centre).reshape(-1, 3)
            pixels = view.pixels(self._project(camera, points)[0]).reshape(12, 25, 2)
            front = np.array([seen[a] or seen[b] for a, b in meeting])  # (12,)
            for edge in np.argsort(front, kind="stable"):
                line = pixels[edge][np.isfinite(pixels[edge]).all(axis=-1)]
                canvas.line(image, line, canvas.LIGHT if front[edge] else _HIDDEN, outline=bool(front[edge]))

    def _forces(self, image: Image, camera: Camera, view: View, points_m: Array, arrows_m: Array) -> None:
        strong = np.linalg.norm(arrows_m, axis=-1) > _LEAST_FORCE * _ARROW_M_PER_WEIGHT
        drawn = strong & np.isfinite(points_m).all(axis=-1)
        base = view.pixels(self._project(camera, points_m[drawn])[0])
        tip = view.pixels(self._project(camera, points_m[drawn] + arrows_m[drawn])[0])
        for start, end in zip(base, tip, strict=True):
            if np.isfinite([start, end]).all():
                canvas.arrow(image, start, end, _FORCE)

    def _made_up(self) -> Camera:
        """A three-quarter view from the front that holds the whole motion."""
        frames = np.unique(np.linspace(0, len(self.clip.qpos) - 1, 100).round().astype(int))
        centres = np.empty((len(frames), self.model.ngeom, 3))
        for i, frame in enumerate(frames):
            self._pose(int(frame))
            centres[i] = self.data.geom_xpos
        geoms = np.unique(self.person.vertex_geom)
        left = geoms[(self.colours[geoms] == _LEFT).all(axis=-1)]
        right = geoms[(self.colours[geoms] == _RIGHT).all(axis=-1)]
        facing = np.array([1.0, 0.0])
        if len(left) and len(right):
            across = (centres[:, left].mean(axis=1) - centres[:, right].mean(axis=1)).mean(axis=0)
            facing = np.array([across[1], -across[0]])
        radius = self.model.geom_rbound[geoms][:, None]
        low = (centres[:, geoms] - radius).min(axis=(0, 1))
        high = (centres[:, geoms] + radius).max(axis=(0, 1))
        view = three_quarter(low, high, float(np.arctan2(facing[1], facing[0])))
        return cameras.lasting(view, len(self.clip.qpos))


def three_quarter(
    low_m: Array, high_m: Array, facing_rad: float, elevation_rad: float = np.deg2rad(15)
) -> Camera:
    """A camera of one frame, 40° beside `facing_rad` and a little above, that sees the whole box."""
    azimuth, elevation = facing_rad + np.deg2rad(40), elevation_rad
    towards = np.array(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
    )
    right = _unit(np.cross([0.0, 0.0, 1.0], towards))
    rotation = np.stack((right, np.cross(right, towards), -towards))  # rows: x right, y down, z forward
    corners = np.stack(np.meshgrid(*zip(low_m, high_m, strict=True)), axis=-1).reshape(8, 3)
    middle = (low_m + high_m) / 2
    local = (corners - middle) @ rotation.T  # (8, 3)
    width, height, focal = 960, 720, 1500.0
    tangent = 0.9 * np.array([width, height]) / 2 / focal
    distance = float((np.abs(local[:, :2]) / tangent - local[:, 2:]).max())
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ (middle + towards * distance)
    matrix = np.array([[focal, 0, width / 2 - 0.5], [0, focal, height / 2 - 0.5], [0, 0, 1]])
    return cameras.still(Lens(matrix, np.zeros(5), (width, height)), transform)


def _tiles(path_m: Array) -> tuple[Array, Array]:
    """Level tiles around a path (T, 2): corners (N, 4, 3) and colours (N, 3) that fade into the sky."""
    low, high = path_m.min(axis=0), path_m.max(axis=0)
    reach = 3.0 + float(np.linalg.norm(high - low)) / 2
    middle = np.round((low + high) / 2 / _TILE_M)  # (2,) in tiles
    count = int(np.ceil(reach / _TILE_M))
    here = np.arange(-count, count)
    corner = np.stack(np.meshgrid(here, here), axis=-1).reshape(-1, 2) + middle  # (N, 2)
    flat = (corner[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]) * _TILE_M  # (N, 4, 2)
    tiles = np.concatenate((flat, np.zeros((len(flat), 4, 1))), axis=-1)  # (N, 4, 3)
    far = np.linalg.norm(flat.mean(axis=1) - middle * _TILE_M, axis=-1) / reach  # (N,)
    colours = np.array(_TILES, float)[(corner.sum(axis=1) % 2).astype(int)]  # (N, 3)
    return tiles, colours + (np.array(_SKY) - colours) * np.clip(1.6 * far - 0.6, 0, 1)[:, None]


def _light(camera: Camera) -> Array:
    """Unit vector to the light: above, and a little beside and before what is seen. (3,)."""
    rotation = cameras.extrinsics(camera)[0, :3, :3]
    right, towards = rotation[0], -rotation[2]
    return _unit(
        _LIGHT_FROM[0] * right + _LIGHT_FROM[1] * towards + _LIGHT_FROM[2] * np.array([0.0, 0.0, 1.0])
    )


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))


def _side_colour(name: str) -> Colour:
    words = name.lower().replace(".", "_").replace("-", "_").replace("/", "_").split("_")
    if "left" in words or "l" in words:
        return _LEFT
    return _RIGHT if "right" in words or "r" in words else _CENTRE


def _coarse_cell_m(model: mujoco.MjModel, items: Sequence[int]) -> float:
    """A cell size that keeps large scenes at some thousand quads."""
    largest = [model.geom_size[i].max() for i in items if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX]
    return 2 * max(largest, default=0.0) / 60


def _corner_radius(camera: Camera) -> float:
    """Largest distance of the image's corners from the optical axis, in ideal image-plane coordinates."""
    width, height = camera.lens.image_size_px
    corners = np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])
    return float(np.linalg.norm(cameras.undistort(camera.lens, corners), axis=-1).max())


def has_view(camera: Camera | None) -> bool:
    """Whether it is known where the camera stands."""
    return camera is not None and camera.path is not None
