"""Videos of any name are written and read, and a name is nothing but one."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import numpy as np
import pytest

from simrecon.drawing import video
from simrecon.errors import InputError
from simrecon.evidence.video import opening
from simrecon.viewer import stills

ODD = os.fsdecode(b"caf\xe9 \x1b[31m")


def test_a_name_that_is_no_text_is_written_and_read(tmp_path: Path) -> None:
    """OpenCV ends the process over one."""
    place = tmp_path / ODD
    place.mkdir()
    images = [np.full((32, 48, 3), 40 * i, np.uint8) for i in range(4)]
    for name in (stills.VIDEO, f"{ODD}.mp4"):
        video.write_video(place / name, images, 25.0)
        capture = opening.open_video(place / name)
        assert [capture.grab() for _ in range(5)] == [True] * 4 + [False]
        capture.release()
    assert len(stills.make(place, np.arange(4))) == 4
    assert sorted(path.name for path in place.iterdir()) == [f"{ODD}.mp4", stills.VIDEO]


def test_a_name_that_looks_like_an_address_is_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        listening.settimeout(0.1)
        name = Path(f"tcp:127.0.0.1:{listening.getsockname()[1]}")
        name.write_bytes(b"no video")
        with pytest.raises(InputError, match="cannot be opened as a video"):
            opening.open_video(name)
        with pytest.raises(TimeoutError):
            listening.accept()


def test_a_name_reaches_the_terminal_with_escapes(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "red\x1b[31m.mp4"
    path.write_bytes(b"\0\0\0\x20ftypavif\0\0\0\0avifmif1miafMA1B")
    with pytest.raises(InputError, match=r"red\\x1b\[31m\.mp4: found a file that cannot be opened"):
        opening.open_video(path)
    assert "\x1b" not in "".join(capfd.readouterr())
