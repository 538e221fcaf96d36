"""Options that contradict an input or have no meaning for it: refused, or done; never ignored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, resources
from simrecon.errors import InputError
from simrecon.evidence import Options, applicable, formats
from simrecon.evidence.content import open_content
from simrecon.job import Job, Reading, inputs
from simrecon.types import Evidence
from tests.evidence import test_formats as samples

CLIP = resources.folder("example") / "beam.npz"


def observed(**reading: Any) -> Evidence:
    return inputs.observe(Job(str(CLIP), "out", reading=Reading(**reading)))


def test_every_format_says_what_it_takes() -> None:
    assert set(applicable.TAKES) == set(formats.names())


@pytest.mark.parametrize("make", [samples.network, samples.landmarks, samples.bvh])
def test_a_reader_looks_at_what_its_format_takes_and_at_nothing_else(make: Any, tmp_path: Path) -> None:
    seen: set[str] = set()

    class Watched(Options):
        def __getattribute__(self, name: str) -> Any:
            seen.add(name)
            return super().__getattribute__(name)

    content = open_content(make(tmp_path))
    (reader,) = (one for one in formats.READERS if one.matches(content))
    reader.read(content, Watched(fps=30.0))
    turned = {"turn_deg"}  # by `formats.read`, for all readers alike
    assert seen & set(applicable.FLAGS) == set(applicable.TAKES[reader.name]) - turned


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        ({"person": "nobody"}, ("--person: found 'nobody'", "format evidence", "wham")),
        ({"unit": "ft"}, ("--unit: found 'ft'", "bvh, trc, c3d")),
        ({"up": "-y"}, ("--up: found '-y'",)),
        ({"frame": "camera"}, ("--frame: found 'camera'",)),
        ({"model": "lite"}, ("--model: found 'lite'", "it is for video")),
        ({"person_at_px": (3.0, 4.0)}, ("--person-at", "it is for video")),
        ({"size_px": (640, 480)}, ("--size", "--fov")),
        ({"size_px": (640, 480), "fov_deg": 20.0}, ("--size: found 640x480", "1080x1920")),
        ({"keypoints_person": "2"}, ("--keypoints-person", "--keypoints FILE")),
    ],
)
def test_what_says_nothing_of_evidence_is_refused(reading: dict[str, Any], words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as error:
        observed(**reading)
    for word in words:
        assert word in str(error.value)


def test_a_frame_rate_retimes_evidence() -> None:
    before, after = observed(), observed(fps=15.0)
    np.testing.assert_allclose(after.times_s, np.arange(len(before.times_s)) / 15, atol=1e-9)
    np.testing.assert_array_equal(after.joints_m, before.joints_m)
    assert "15 Hz as given" in after.reading


def test_a_field_of_view_replaces_the_lens_of_evidence_and_leaves_its_place() -> None:
    before, after = observed().camera, observed(fov_deg=20.0)
    assert before is not None
    assert after.camera is not None
    focal = after.camera.lens.matrix_px[0, 0]
    np.testing.assert_allclose(focal, 540 / np.tan(np.deg2rad(10)))
    np.testing.assert_array_equal(np.asarray(after.camera.path), np.asarray(before.path))
    assert "lens: --fov 20" in after.reading


def test_a_camera_file_replaces_the_lens_of_evidence(tmp_path: Path) -> None:
    file = tmp_path / "lens.toml"
    file.write_text(
        "image_size_px = [1080, 1920]\nfocal_px = 900\ncentre_px = [540, 960]\n", encoding="utf-8"
    )
    after = observed(camera=str(file)).camera
    assert after is not None
    assert after.lens.matrix_px[0, 0] == 900
    with pytest.raises(InputError, match="--up"):  # the file does not say where the camera stands
        observed(camera=str(file), up="y")


def test_options_of_a_video_are_not_for_two_files_that_are_none(tmp_path: Path) -> None:
    first, second = samples.network(tmp_path), samples.landmarks(tmp_path)
    with pytest.raises(InputError, match="--model: found 'lite'"):
        evidence.read(first, Options(fps=30.0, model="lite"), keypoints=second)
    with pytest.raises(InputError, match="--keypoints-person: found '1'"):
        evidence.read(first, Options(fps=30.0), keypoints=CLIP, keypoints_person="1")
