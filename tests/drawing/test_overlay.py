"""The overlay: shapes, what is in front of what, where it lies in the image, and the files."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np
import pytest

from simrecon.drawing import geoms, ground, overlay, shapes, video
from simrecon.drawing.canvas import Image
from simrecon.drawing.overlay import Animation
from simrecon.drawing.painter import Painter
from simrecon.drawing.views import View
from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.types import Array, Camera, Lens, Part

SIZE = (400, 300)
LEVEL = [[1, 0, 0, 0], [0, 0, -1, 1], [0, 1, 0, 4], [0, 0, 0, 1]]  # looks along +y from (0, -4, 1)
WHITE = np.array([250, 250, 250], float)


def camera(frames: int = 2, **changes: Any) -> Camera:
    matrix = np.array([[300.0, 0, 199.5], [0, 300.0, 149.5], [0, 0, 1]])
    return cameras.still(replace(Lens(matrix, np.zeros(5), SIZE), **changes), np.array(LEVEL, float), frames)


def capsules(*, items: str = "", extra: str = "") -> mujoco.MjModel:
    """A torso with a left and a right arm, the left one at -x, which the camera sees left."""
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <worldbody>
        <geom name="ground" type="plane" size="0 0 .1"/>
        {items}
        <body name="pelvis" pos="0 0 1">
          <freejoint/>
          <geom name="torso" type="capsule" fromto="0 0 -.3 0 0 .3" size=".12"/>
          <geom name="left_arm" type="capsule" fromto="-.4 0 -.3 -.4 0 .3" size=".06"/>
          <body name="right_arm"><geom type="capsule" fromto=".4 0 -.3 .4 0 .3" size=".06"/></body>
          {extra}
        </body>
      </worldbody>
    </mujoco>""")


def clip(model: mujoco.MjModel | None = None, frames: int = 2, **changes: Any) -> Animation:
    model = capsules() if model is None else model
    times_s = np.arange(frames) / 30
    return replace(Animation(model, times_s, np.tile(model.qpos0, (frames, 1)), camera(frames)), **changes)


def black(frames: int = 2) -> list[Image]:
    return [np.zeros((SIZE[1], SIZE[0], 3), np.uint8) for _ in range(frames)]


def first(shown: Animation) -> Image:
    return next(overlay.render(shown, black(len(shown.times_s))))


def orange(pixel: Array) -> bool:
    blue, green, red = (float(value) for value in pixel)
    return red > green + 20 > blue + 30


def teal(pixel: Array) -> bool:
    blue, green, red = (float(value) for value in pixel)
    return blue > red + 40 and green > red + 40


def grey(pixel: Array) -> bool:
    return float(np.ptp(pixel.astype(float))) < 20 and pixel.min() > 30


# --- shapes


KINDS = {
    "sphere": ('type="sphere" size=".3"', 4 / 3 * np.pi * 0.3**3),
    "ellipsoid": ('type="ellipsoid" size=".3 .2 .1"', 4 / 3 * np.pi * 0.3 * 0.2 * 0.1),
    "capsule": ('type="capsule" size=".1 .2"', np.pi * 0.1**2 * 0.4 + 4 / 3 * np.pi * 0.1**3),
    "cylinder": ('type="cylinder" size=".1 .2"', np.pi * 0.1**2 * 0.4),
    "box": ('type="box" size=".1 .2 .3"', 8 * 0.1 * 0.2 * 0.3),
}


@pytest.mark.parametrize("kind", KINDS)
def test_surfaces_are_closed_point_outwards_and_have_the_volume(kind: str) -> None:
    attributes, volume = KINDS[kind]
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody><geom {attributes}/></worldbody></mujoco>")
    surface = shapes.surface(model, [0], 0.15)
    a, b, c, d = np.moveaxis(surface.vertices_m[surface.faces], 1, 0)
    area = np.cross(c - a, d - b) / 2  # (F, 3)
    np.testing.assert_allclose(area.sum(axis=0), 0, atol=1e-12)
    assert ((area * (a + b + c + d) / 4).sum(axis=1) > -1e-12).all()
    enclosed = ((a * np.cross(b, c)).sum() + (a * np.cross(c, d)).sum()) / 6  # divergence theorem
    assert 0.9 * volume <= enclosed <= volume * (1 + 1e-9)


def test_surfaces_lie_where_the_geoms_are() -> None:
    model = capsules()
    data = mujoco.MjData(model)
    data.qpos[:7] = 1, 2, 3, np.cos(0.4), 0, 0, np.sin(0.4)
    mujoco.mj_kinematics(model, data)
    geom = model.geom("left_arm").id
    surface = shapes.surface(model, [geom], 0.1)
    placed = surface.place(data.geom_xpos, data.geom_xmat)
    np.testing.assert_allclose((placed.min(0) + placed.max(0)) / 2, data.geom_xpos[geom], atol=1e-9)
    np.testing.assert_allclose(np.ptp(placed[:, 2]), 0.6 + 2 * 0.06)


def test_a_plane_has_no_quads() -> None:
    assert len(shapes.surface(capsules(), [0], 0.1).faces) == 0


def test_box_edges_lie_on_both_of_their_faces() -> None:
    half = np.array([0.1, 0.2, 0.3])
    ends, meeting = shapes.box_edges(half)
    assert ends.shape == (12, 2, 3)
    assert len({tuple(sorted(pair)) for pair in meeting.tolist()}) == 12
    for edge, faces in zip(ends, meeting, strict=True):
        for face in faces:
            axis, sign = face // 2, 1 - 2 * (face % 2)
            np.testing.assert_allclose(edge[:, axis], sign * half[axis])


# --- what a frame shows


def test_the_body_is_where_the_camera_sees_it() -> None:
    image = first(clip())
    assert grey(image[150, 200])
    assert orange(image[150, 170])
    assert teal(image[150, 230])
    assert not image[150, 185].any()
    drawn = np.argwhere(image[100:, :].any(axis=(0, 2)))
    # The arms' outer sides: 300 px · (0.4 ± 0.06) m / 4 m from the middle.
    assert (drawn.min(), drawn.max()) == (
        pytest.approx(199.5 - 34.5, abs=1.5),
        pytest.approx(199.5 + 34.5, abs=1.5),
    )


def test_the_image_shines_through() -> None:
    dark, bright = (
        first(clip()),
        next(overlay.render(clip(), [np.full_like(image, 255) for image in black()])),
    )
    difference = bright[150, 200].astype(float) - dark[150, 200]
    np.testing.assert_allclose(difference, 0.25 * 255, atol=2)


@pytest.mark.parametrize(("y", "colour"), [(-0.5, orange), (0.5, grey)])
def test_what_is_nearer_hides_what_is_farther(y: float, colour: Callable[[Array], bool]) -> None:
    extra = f'<body name="left_hand"><geom type="box" pos="0 {y} 0" size=".05 .05 .05"/></body>'
    assert colour(first(clip(capsules(extra=extra)))[150, 200])


def test_boxes_of_the_scene_are_wires_on_video_and_solid_without() -> None:
    model = capsules(items='<geom name="item/box" type="box" pos="1 0 1.3" size=".3 .2 .3"/>')
    bare, shown = first(clip()), first(clip(model))
    inside = np.s_[110:145, 262:285]
    assert not shown[inside].any()
    assert (shown != bare).any(axis=2).sum() > 100
    plain, solid = (next(overlay.render(clip(m))) for m in (capsules(), model))
    assert (plain[inside] != solid[inside]).any(axis=2).all()


def test_a_box_before_the_person_hides_it_without_video() -> None:
    model = capsules(items='<geom name="item/box" type="box" pos="-.2 -1 1" size=".3 .1 .3"/>')
    assert orange(next(overlay.render(clip()))[150, 170])
    assert not orange(next(overlay.render(clip(model)))[150, 170])


def test_landmarks_are_dots_coloured_by_score() -> None:
    pixels = np.tile(np.array([[50.0, 250.0], [80.0, 250.0], [110.0, 250.0], [np.nan, 250.0]]), (2, 1, 1))
    scores = np.tile([1.0, 0.05, 0.0, 1.0], (2, 1))
    image = first(clip(keypoints_px=pixels, scores=scores)).astype(int)
    assert image[250, 50, 1] > 200 > 100 > image[250, 50, 2]
    assert image[250, 80, 2] > 200 > 100 > image[250, 80, 1]
    assert not image[240:260, 100:120].any()


def test_landmarks_and_body_keep_together_when_the_image_shrinks() -> None:
    size = (1920, 1080)
    matrix = np.array([[1500.0, 0, 959.5], [0, 1500.0, 539.5], [0, 0, 1]])
    big = camera(matrix_px=matrix, image_size_px=size)
    dot = np.tile([959.5, 539.5], (2, 1, 1))
    image = next(
        overlay.render(
            clip(camera=big, keypoints_px=dot, scores=np.ones((2, 1))),
            [np.zeros((1080, 1920, 3), np.uint8)] * 2,
        )
    )
    assert image.shape == (540, 960, 3)
    green = np.argwhere((image[..., 1] > 200) & (image[..., 2] < 120))
    np.testing.assert_allclose(green.mean(axis=0), [269.5, 479.5], atol=0.6)
    body = np.argwhere(image[200:240].any(axis=(0, 2)))
    assert (body.min() + body.max()) / 2 == pytest.approx(479.5, abs=1)


def test_a_view_maps_pixels_as_resizing_does() -> None:
    view = View(np.array([8.0, 4.0]), np.array([0.25, 0.5]), (10, 10))
    # The mean of columns 8 to 11 and rows 4 and 5 is the first pixel of the output.
    np.testing.assert_allclose(view.pixels(np.array([9.5, 4.5])), [0, 0])


def test_one_body_weight_is_half_a_metre() -> None:
    model = capsules()
    weight = model.body_mass.sum() * 9.81
    point = np.tile([[1.0, 0.0, 0.6], [np.nan] * 3], (2, 1, 1))
    force = np.tile([[0.0, 0.0, weight], [0.0, 0.0, weight]], (2, 1, 1))
    bare = first(clip(model))
    image = first(clip(model, contact_point_m=point, contact_force_N=force))
    rows, columns = np.nonzero((image != bare).any(axis=2)[:200])
    assert columns.mean() == pytest.approx(199.5 + 75, abs=1)
    # From z = 0.6 to 1.1 m at 4 m: rows 179.5 to 142.
    assert (rows.min(), rows.max()) == (pytest.approx(142, abs=3), pytest.approx(179.5, abs=3))
    # The scale at the lower left: as long as that, with its words beside it.
    rows, columns = np.nonzero((image != bare).any(axis=2)[200:])
    assert np.ptp(rows[columns < 10]) == pytest.approx(37.5, abs=6)
    assert columns.max() > 80


def test_tiny_forces_are_left_out() -> None:
    point, force = np.tile([1.0, 0, 1], (2, 1, 1)), np.full((2, 1, 3), 0.001)
    shown = first(clip(contact_point_m=point, contact_force_N=force))
    np.testing.assert_array_equal(shown[:200], first(clip())[:200])  # below is the scale


def test_fallback_frames_say_so() -> None:
    shown = clip(status=np.array([0, 1], np.uint8))
    simulated, fallback = overlay.render(shown, black())
    bare = list(overlay.render(clip(), black()))
    np.testing.assert_array_equal(simulated, bare[0])
    assert (fallback != bare[1]).any(axis=2).sum() > 200


def test_distortion_moves_the_body() -> None:
    def arm(image: Image) -> float:
        columns = np.argwhere(image[100:200].any(axis=(0, 2)))
        return float(columns.max())

    pulled = camera(distortion=np.array([-5.0, 0, 0, 0, 0]))
    assert arm(first(clip(camera=pulled))) < arm(first(clip())) - 1


def test_a_moving_camera() -> None:
    moving = np.tile(np.array(LEVEL, float), (2, 1, 1))
    moving[1, 0, 3] = 1.0
    still, moved = overlay.render(clip(camera=Camera(camera().lens, moving)), black())
    assert grey(still[150, 200])
    assert not moved[150, 200].any()
    assert grey(moved[150, 275])


@pytest.mark.parametrize("height", [-20.0, 0.0])
def test_a_body_out_of_view_or_around_the_camera_is_no_error(height: float) -> None:
    shown = clip()
    shown.qpos[:, :3] = 0, -4.0, 1.0 + height
    assert first(shown).shape == (300, 400, 3)
    assert overlay.sheet(shown).ndim == 3


def test_same_clip_same_bits() -> None:
    for a, b in zip(overlay.render(clip(), black()), overlay.render(clip(), black()), strict=True):
        np.testing.assert_array_equal(a, b)


# --- without a camera


@pytest.mark.parametrize("known", [None, Camera(camera().lens)], ids=["none", "intrinsics only"])
def test_a_made_up_view_holds_the_whole_motion(known: Camera | None) -> None:
    shown = clip(frames=30, camera=known)
    shown.qpos[:, 0] = np.linspace(-3, 3, 30)
    shown.qpos[:, 2] = np.linspace(0.5, 2, 30)
    painter = Painter(shown)
    low, high = painter.bounds_px(np.arange(30))
    assert (low > -60).all()
    assert (high < np.array(painter.camera.lens.image_size_px) + 60).all()
    for image in (list(overlay.render(shown))[i] for i in (0, 29)):
        assert any(orange(pixel) for pixel in image.reshape(-1, 3)[::7])


def test_the_made_up_view_is_from_the_front() -> None:
    # Left is at -x, up at +z: the person faces +y.
    painter = Painter(clip(camera=None))
    eye = cameras.centre_m(painter.camera)[0]
    assert eye[1] > 1
    assert eye[2] > 1


def test_the_sheet_has_at_most_twelve_frames_of_one_size() -> None:
    shown = clip(frames=40)
    page = overlay.sheet(shown)
    assert (page == 255).all(axis=(1, 2)).sum() <= 4 * 5
    assert max(page.shape) <= 12 * 320
    assert overlay.sheet(clip(frames=2)).shape != page.shape


def test_contact_sheet_goes_row_by_row() -> None:
    tiles = [np.full((2, 3, 3), value, np.uint8) for value in (10, 20, 30)]
    page = overlay.contact_sheet(tiles, columns=2, gap_px=1)
    assert page.shape == (7, 9, 3)
    assert (page[1, 1, 0], page[1, 5, 0], page[4, 1, 0], page[4, 5, 0]) == (10, 20, 30, 255)


# --- files


def make_video(path: Path, frames: int, fps: float = 30.0, size: tuple[int, int] = SIZE) -> Path:
    """A video whose frames grow brighter by 8 grey levels each."""
    images = (np.full((size[1], size[0], 3), 8 * i + 8, np.uint8) for i in range(frames))
    video.write_video(path, images, fps)
    return path


def brightness(images: list[Image]) -> list[int]:
    return [round(float(image.mean()) / 8) - 1 for image in images]


def test_video_round_trip(tmp_path: Path) -> None:
    path = make_video(tmp_path / "a.mp4", 10)
    assert [found.name for found in tmp_path.iterdir()] == ["a.mp4"]
    assert brightness(list(video.frames(path, np.arange(10) / 30))) == list(range(10))


def test_frames_are_taken_by_time(tmp_path: Path) -> None:
    path = make_video(tmp_path / "a.mp4", 10)
    assert brightness(list(video.frames(path, np.array([0.1, 0.2, 0.3 - 1e-9])))) == [3, 6, 9]


def test_frames_of_a_part_are_those_of_its_source(tmp_path: Path) -> None:
    path = make_video(tmp_path / "a.mp4", 10)
    uneven = np.array([0.11, 0.21, 0.28])  # times of frames 2, 4 and 6 of a variable rate
    assert brightness(list(video.frames(path, uneven, Part(2, 2, 10)))) == [2, 4, 6]
    assert brightness(list(video.frames(path, np.arange(10) / 30, Part(4, 1, 400))))[:3] == [
        0,
        1,
        2,
    ]  # by time


def test_write_on_video(tmp_path: Path) -> None:
    source = make_video(tmp_path / "in.mp4", 3)
    folder = tmp_path / "out"
    folder.mkdir()
    path = overlay.write(folder, clip(frames=3), source)
    assert path == folder / "overlay.mp4"
    assert list(folder.iterdir()) == [path]
    capture = cv2.VideoCapture(str(path))
    assert (capture.get(cv2.CAP_PROP_FRAME_COUNT), capture.get(cv2.CAP_PROP_FPS)) == (3, 30)
    found, image = capture.read()
    assert found
    assert image.shape == (300, 400, 3)
    assert orange(image[150, 170])
    capture.release()


@pytest.mark.parametrize("known", [None, camera()], ids=["no camera", "no video"])
def test_write_without_video(tmp_path: Path, known: Camera | None) -> None:
    path = overlay.write(tmp_path, clip(camera=known))
    assert path == tmp_path / "overlay.png"
    assert list(tmp_path.iterdir()) == [path]
    np.testing.assert_array_equal(cv2.imread(str(path)), overlay.sheet(clip(camera=known)))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "no such video"),
        (b"", "cannot be opened as a video"),
        (b"no video " * 99, "cannot be opened"),
        (b"\0\0\0\x18ftypmp42" + b"\0" * 99, "cannot be opened"),
    ],
)
def test_bad_videos(
    tmp_path: Path, content: bytes | None, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "v.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=rf"v\.mp4: .*{words}"):
        video.check_video(path, np.arange(3) / 30)
    assert capfd.readouterr() == ("", "")


def test_a_short_video_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    source = make_video(tmp_path / "in.mp4", 3)
    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(InputError, match="has 3 frames, but the evidence reaches to frame 8"):
        overlay.write(folder, clip(frames=8), source)
    assert list(folder.iterdir()) == []


def test_another_aspect_ratio_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    source = make_video(tmp_path / "in.mp4", 2, size=(300, 400))
    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(InputError, match="300 x 400 pixels, but the evidence's image_size_px is 400 x 300"):
        overlay.write(folder, clip(), source)
    assert list(folder.iterdir()) == []


def test_too_few_images() -> None:
    with pytest.raises(InputError, match="found 1 image for 2 frames"):
        list(overlay.render(clip(), black(1)))


def test_unwritable_places(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        overlay.write(tmp_path / "none", clip())
    with pytest.raises(InputError, match="cannot write the video"):
        video.write_video(tmp_path / "none" / "a.mp4", black(), 30.0)
    with pytest.raises(InputError, match="no frames"):
        video.write_video(tmp_path / "a.mp4", [], 30.0)


@pytest.mark.slow
def test_a_frame_takes_at_most_20_ms() -> None:
    extra = "".join(
        f'<body name="l_{i}"><geom type="capsule" fromto="{i / 20} 0 -.3 {i / 20} 0 .3" size=".08"/></body>'
        for i in range(-11, 12)
    )
    shown = clip(capsules(extra=extra), 50)
    shown = replace(shown, camera=camera(50, image_size_px=(960, 540)))
    images = [np.zeros((540, 960, 3), np.uint8)] * 50
    start = time.process_time()
    for _ in overlay.render(shown, images):
        pass
    assert (time.process_time() - start) / 50 < 0.02


# --- work that is bounded by what can be seen


def strolling(metres: float, camera_: Camera | None = None) -> Animation:
    """The two capsules on a straight path of so many metres, over a floor."""
    shown = clip(frames=40, camera=camera_)
    qpos = shown.qpos.copy()
    qpos[:, 0] += np.linspace(0.0, metres, len(qpos))
    return replace(shown, qpos=qpos)


@pytest.mark.parametrize("metres", [5.0, 30.0, 1e3, 1e4, 1e6])
def test_a_path_of_any_length_takes_as_much_memory_as_a_short_one(metres: float) -> None:
    tracemalloc.start()
    page = overlay.sheet(strolling(metres))
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 60e6
    person = [orange(pixel) or teal(pixel) for pixel in page.reshape(-1, 3)[::7]]
    assert np.mean(person) > 0.005  # it is to be seen, wherever it is


def test_the_ground_lies_around_the_person_on_a_long_path() -> None:
    for shown in (strolling(1e4), strolling(10.0)):
        painter = Painter(shown)
        view = View(np.zeros(2), np.ones(2), painter.camera.lens.image_size_px)
        for frame in (0, 39):
            image = painter.draw(frame, view, None, "")
            assert (np.abs(image.astype(int) - np.array(ground.SKY)).max(axis=-1) > 6).mean() > 0.1


@pytest.mark.parametrize("reach", [0.5, 3.0, 19.0, 400.0, 1e5])
def test_tiles_are_few_and_reach_far_enough(reach: float) -> None:
    corners, colours = ground.tiles(np.array([3.0, -2.0]), reach)
    assert len(corners) == len(colours) <= 4 * 40**2
    assert corners[..., 0].min() <= 3.0 - reach + 0.51 * np.ptp(corners[0, :, 0])
    assert corners[..., 1].max() >= -2.0 + reach - 0.51 * np.ptp(corners[0, :, 0])


def test_many_or_large_boxes_are_cut_into_few_quads() -> None:
    edges = np.array([[100.0, 100.0, 0.5]] + [[1.0, 1.0, 1.0]] * 300)
    boxes = "".join(f'<geom type="box" size="{x / 2} {y / 2} {z / 2}"/>' for x, y, z in edges)
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{boxes}</worldbody></mujoco>")
    items = list(range(model.ngeom))
    cell = geoms.coarse_cell_m(model, items, 0.1)
    assert len(shapes.surface(model, items, cell).faces) <= geoms.QUADS_MAX
    assert geoms.coarse_cell_m(model, items[1:20], 0.1) == pytest.approx(0.1)


# --- a body that is never in the image


def test_a_video_without_a_body_on_it_is_an_error(tmp_path: Path) -> None:
    source = make_video(tmp_path / "clip.mp4", 3)
    shown = clip(frames=3)
    away = replace(shown, qpos=shown.qpos + np.eye(shown.qpos.shape[1])[0] * 500.0)
    with pytest.raises(InputError, match="the body is outside the image in all frames"):
        overlay.write(tmp_path, away, source)
    assert not (tmp_path / "overlay.mp4").exists()
