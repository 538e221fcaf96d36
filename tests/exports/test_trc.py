"""A result as TRC, read back by simrecon's own reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon import exports, results
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import trc


def test_trc_is_read_back_in_the_same_world(finished: Path, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("trc",), tmp_path)
    table = trc.parse(Content(path, "text"))
    labels, times_s, places = table.labels, table.times_s, table.places
    assert table.notes == ()
    motion = results.read_motion(finished)
    assert table.unit == "m"
    kept = np.delete(np.arange(10), 4)  # the frame that was dropped is in the file
    np.testing.assert_allclose(times_s[kept], motion.times_s - motion.times_s[0], atol=1e-6)
    z_up = np.stack((places[..., 0], -places[..., 2], places[..., 1]), axis=-1)
    shared = [name for name in motion.joint_names if name in labels]
    assert len(shared) >= 16
    for name in shared:
        ours = motion.joints_m[:, motion.joint_names.index(name)]
        np.testing.assert_allclose(z_up[kept, labels.index(name)], ours, atol=1e-5, err_msg=name)


def test_the_header_states_what_follows(finished: Path, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("trc",), tmp_path)
    lines = path.read_text(encoding="ascii").splitlines()
    stated = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    assert stated["NumFrames"] == str(len(lines) - 5)
    assert float(stated["DataRate"]) == pytest.approx(30.0)
    assert len(lines[5].split("\t")) == 2 + 3 * int(stated["NumMarkers"])
