"""Chosen frames of a result as a PNG."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from simrecon import cli, results
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.exports import picture
from tests.support.runs import job_of


@pytest.fixture
def folder(run: Any, tmp_path: Path) -> Path:
    results.write(job_of(tmp_path / "out"), run)
    return tmp_path / "out"


def test_frames_by_time_and_by_what_happens(run: Any) -> None:
    motion = run.motion
    assert picture.frame(motion, "0.1") == int(np.abs(motion.times_s - 0.1).argmin())
    assert picture.frame(motion, "lowest") == motion.com_m[:, 2].argmin()
    assert picture.frame(motion, "highest") == motion.com_m[:, 2].argmax()
    assert picture.frame(motion, "hardest") == 1 + np.linalg.norm(motion.grf_N, axis=1)[1:].argmax()
    for word in ("9", "-1", "soon", "nan"):
        with pytest.raises(InputError, match=r"valid: seconds from 0 to 0\.3, lowest"):
            picture.frame(motion, word)


def test_the_first_instant_is_no_frame_of_forces(run: Any) -> None:
    force = run.motion.contact_force_N.copy()
    force[0] = 1e4
    slammed = replace(run.motion, contact_force_N=force, grf_N=force.sum(axis=1))
    assert picture.frame(slammed, "hardest") > 0
    drawn = overlay.Animation.of(run.problem.model, slammed).contact_force_N
    assert drawn is not None
    assert not drawn[0].any()
    np.testing.assert_array_equal(drawn[1:], force[1:])


def test_the_command_draws_forces(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["picture", str(folder), "--at", "0.1", "hardest"]) == 0
    time, hard = (picture.frame(results.read_motion(folder), word) for word in ("0.1", "hardest"))
    assert f"frames    {time} (at 0.1 s), {hard} (hardest); " in (shown := capsys.readouterr().out)
    target = folder.with_suffix(".png")
    assert str(target) in shown
    image = cv2.imread(str(target))
    assert image is not None
    yellow = (image[..., 0] < 90) & (image[..., 1] > 200) & (image[..., 2] > 200)  # the arrows
    assert yellow.sum() > 100
    assert image.shape[1] > 1.5 * picture.TILE_PX  # two frames side by side


def test_bad_requests(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["picture", str(folder), "-o", "a.jpg"]) == 2
    assert "ends in .png" in capsys.readouterr().err
    assert cli.main(["picture", str(folder.parent / "none")]) == 2
    assert cli.main(["picture", str(folder), "--at", "soon"]) == 2
    assert "valid: seconds from" in capsys.readouterr().err
