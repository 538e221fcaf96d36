"""One frame of the overlay: the body's quads sorted by distance, the scene, landmarks and forces."""

from __future__ import annotations

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.drawing import canvas, figure, ground, legend, shapes
from simrecon.drawing.animation import Animation
from simrecon.drawing.canvas import Image
from simrecon.drawing.figure import Figure
from simrecon.drawing.geoms import LEFT, RIGHT, coarse_cell_m, of_model
from simrecon.drawing.shading import shades
from simrecon.drawing.views import View, corner_radius, has_view, three_quarter
from simrecon.geometry import camera as cameras
from simrecon.geometry import vectors
from simrecon.types import Array, Camera
from simrecon.types.motion import FALLBACK, PLANNED

# Colours are blue, green, red.
_SAID = {FALLBACK: "not simulated: kinematic fallback", PLANNED: "planned, not simulated"}
_FORCE, _FALLBACK, _HIDDEN = (40, 240, 250), (170, 170, 255), (140, 140, 140)
TOUCHES = (70, 50, 225)
"""Of what the scene pushes."""
_ALPHA = 0.75
_SOFT = 0.7  # of the length of a skin's faces, over which their shades are evened out
_ARROW_M_PER_WEIGHT = 0.5
_LEAST_FORCE = 0.01  # of body weight; smaller forces are not drawn
_BODY_CELL_M, _ITEM_CELL_M = 0.08, 0.1
_FOLLOW_M = 15.0  # a made-up camera goes along with a longer path


class Painter:
    """Holds what is the same for all frames of a clip, and draws one at a time."""

    def __init__(self, clip: Animation) -> None:
        """Cut the geoms into quads; make up a camera if there is none."""
        model = clip.model
        self.clip, self.model, self.data = clip, model, mujoco.MjData(model)
        self.marked: list[int] = []  # geoms that touch in the frame that is drawn
        self.geoms = of_model(model)
        person, items = self.geoms.person, self.geoms.items
        cells_m = _BODY_CELL_M, coarse_cell_m(model, items, _ITEM_CELL_M)
        self.person, self.all = figure.both(model, self.geoms, clip.skin, cells_m)
        trees = np.unique(model.body_rootid[model.geom_bodyid[person]])
        masses = model.body_mass[np.isin(model.body_rootid, trees) & (model.body_weldid != 0)]
        self.weight_N = max(float(masses.sum() * (np.linalg.norm(model.opt.gravity) or 9.81)), 1e-9)
        self.plain: tuple[View, Array, Array, Image] | None = None
        self.camera = clip.camera if clip.camera is not None and has_view(clip.camera) else self._made_up()
        self.still = cameras.is_still(self.camera)
        self.limit = 1.5 * corner_radius(self.camera)

    def draw(self, frame: int, view: View, image: Image | None, caption: str | None = None) -> Image:
        """One frame over `image`, or over plain ground; `caption` instead of number and time."""
        clip, camera = self.clip, self._at(frame)
        self._pose(frame)
        self.marked = [self.model.geom(name).id for name in clip.touching(frame)]
        surface = self.person if image is not None else self.all
        vertices = surface.place(self.data)  # (V, 3)
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
            up = cameras.extrinsics(camera)[0, 1, :3] * -_ARROW_M_PER_WEIGHT  # in the image
            ends_px = view.pixels(self._project(camera, self.data.qpos[:3] + np.stack((np.zeros(3), up)))[0])
            legend.scale(image, ends_px, f"{self.weight_N:.0f} N, body weight", _FORCE)
        if clip.keypoints_px is not None and clip.camera is self.camera:
            scores = np.ones(clip.keypoints_px.shape[1]) if clip.scores is None else clip.scores[frame]
            canvas.dots(image, view.pixels(clip.keypoints_px[frame]), scores)
        if caption is None:
            caption = f"frame {frame}   {clip.times_s[frame]:.2f} s"
        canvas.label(image, caption, 0, canvas.LIGHT)
        if clip.status is not None and (said := _SAID.get(int(clip.status[frame]))):
            canvas.label(image, said, 1, _FALLBACK)
        return image

    def is_seen(self, frames: NDArray[np.int64]) -> bool:
        """Whether any part of the person is in the camera's image in any of these frames."""
        size = np.array(self.camera.lens.image_size_px, float)
        for frame in frames:
            self._pose(int(frame))
            vertices = self.person.place(self.data)
            pixels = self._project(self._at(int(frame)), vertices)[0]
            if ((pixels >= 0) & (pixels <= size)).all(axis=-1).any():
                return True
        return False

    def bounds_px(self, frames: NDArray[np.int64]) -> tuple[Array, Array]:
        """Corners (2,), (2,) of the part of the camera's image that holds the person in these frames."""
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for frame in frames:
            self._pose(int(frame))
            vertices = self.person.place(self.data)
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
        surface: Figure,
        vertices: Array,
        alpha: float,
    ) -> None:
        image_px, distance = self._project(camera, vertices)
        pixels = view.pixels(image_px)[surface.faces]  # (F, 4, 2)
        corners = vertices[surface.faces]  # (F, 4, 3)
        normals = surface.normals(vertices)  # (F, 3)
        towards = vectors.unit(cameras.centre_m(camera) - corners.mean(axis=1))  # (F, 3)
        facing = np.maximum((normals * towards).sum(axis=-1), 0.0)  # (F,)
        area = canvas.areas(pixels)  # (F,) px²
        keep = np.flatnonzero((area > 0) & np.isfinite(pixels).all(axis=(1, 2)))
        if not len(keep):
            return
        soft_px = _SOFT * float(np.sqrt(np.median(area[keep]))) if surface.round else 0.0
        keep = keep[np.argsort(-distance[surface.faces[keep]].mean(axis=1), kind="stable")]
        shade = shades(camera, normals[keep], facing[keep])  # (F,)
        pushed = np.isin(surface.face_geom[keep], self.marked)[:, None]
        colours = np.minimum(
            np.where(pushed, TOUCHES, surface.colours[keep]) * shade[:, None], 255.0
        )  # (F, 3)
        canvas.paint(image, pixels[keep], colours, alpha, soft_px)

    def _ground(self, camera: Camera, view: View) -> Image:
        """Chequered ground of half-metre tiles that fades out; kept while the camera stands still."""
        places = self.data.geom_xpos[self.geoms.grounds]
        path = self.clip.qpos[:, :2] if self.clip.ground_m is None else self.clip.ground_m
        middle, reach = ground.around(path, self.data.qpos[:2])
        kept = self.plain if self.still else None
        same = kept is not None and kept[0] is view and np.allclose(kept[2], middle)
        if kept is not None and same and np.allclose(kept[1], places, atol=1e-3):
            return kept[3].copy()
        width, height = view.size
        image = np.full((height, width, 3), ground.SKY, np.uint8)
        for geom in self.geoms.grounds:
            corners, colours = ground.tiles(middle, reach)
            corners[..., 2] = ground.height(self.model, self.data, geom, corners[..., :2])
            pixels = view.pixels(self._project(camera, corners.reshape(-1, 3))[0]).reshape(-1, 4, 2)
            keep = np.isfinite(pixels).all(axis=(1, 2))
            canvas.paint(image, pixels[keep], colours[keep], 1.0)
        self.plain = (view, places, middle, image)
        return image.copy()

    def _shadow(self, image: Image, camera: Camera, view: View) -> None:
        """The person's shadow on the ground, light from straight above."""
        if not self.geoms.grounds:
            return
        vertices = self.person.place(self.data)
        vertices[:, 2] = ground.height(self.model, self.data, self.geoms.grounds[0], vertices[:, :2])
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
        for box in self.geoms.boxes:
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
        """A three-quarter view from the front that holds the whole motion, or goes along with a long one."""
        frames = np.unique(np.linspace(0, len(self.clip.qpos) - 1, 100).round().astype(int))
        centres = np.empty((len(frames), self.model.ngeom, 3))
        for i, frame in enumerate(frames):
            self._pose(int(frame))
            centres[i] = self.data.geom_xpos
        geoms = np.unique(self.person.vertex_geom)
        left = geoms[(self.geoms.colours[geoms] == LEFT).all(axis=-1)]
        right = geoms[(self.geoms.colours[geoms] == RIGHT).all(axis=-1)]
        facing = np.array([1.0, 0.0])
        if len(left) and len(right):
            across = (centres[:, left].mean(axis=1) - centres[:, right].mean(axis=1)).mean(axis=0)
            facing = np.array([across[1], -across[0]])
        radius = self.model.geom_rbound[geoms][:, None]
        follows = self._is_far()
        off = self.clip.qpos[frames, None, :3] if follows else np.zeros(3)
        low = (centres[:, geoms] - off - radius).min(axis=(0, 1))
        high = (centres[:, geoms] - off + radius).max(axis=(0, 1))
        view = three_quarter(low, high, float(np.arctan2(facing[1], facing[0])))
        fixed = cameras.lasting(view, len(self.clip.qpos))
        return cameras.moved(fixed, self.clip.qpos[:, :3]) if follows else fixed

    def _is_far(self) -> bool:
        """Whether the person goes farther than one picture shows well."""
        path = self.clip.qpos[:, :3]
        return float(np.linalg.norm(np.ptp(path, axis=0))) > _FOLLOW_M
