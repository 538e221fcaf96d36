"""Parsers of other projects crash, hang and grow in a process of their own, and cost a line."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from simrecon.errors import InputError
from simrecon.evidence.camera import files
from simrecon.io import foreign
from tools import CHECKOUT

PARSER = """
import os, sys
sys.path.append({checkout!r})
import numpy as np
from simrecon.io import foreign
from tools import CHECKOUT
from simrecon.io.foreign import __main__ as process
class Module:
    @staticmethod
    def parse(path):
        {body}
process.importlib.import_module = lambda name: Module if name.endswith(".storage") else __import__(name)
sys.exit(process.main("storage", sys.argv[2], int(sys.argv[3]), int(sys.argv[4])))
"""


def answer(body: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    """What comes of a parser with this body; quick limits."""
    script = tmp_path / "script.py"
    script.write_text(PARSER.format(checkout=str(CHECKOUT), body=body), encoding="utf-8")
    monkeypatch.setattr(foreign, "SECONDS", 1.0)
    monkeypatch.setattr(foreign, "WAIT", 3.0)
    really = subprocess.run

    def run(command: list[str], **more: Any) -> object:
        return really([sys.executable, "-P", str(script), *command[4:]], **more)

    monkeypatch.setattr(subprocess, "run", run)
    try:
        return foreign.parse("storage", b"a file")
    except foreign.DamageError as error:
        return str(error)


def test_arrays_come_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    body = "return {'a': np.arange(3.0), 'b': np.array(['ü', 'x']), 'c': np.zeros((0, 3), np.int8)}"
    found = answer(body, tmp_path, monkeypatch)
    assert isinstance(found, dict)
    assert found["a"].tolist() == [0.0, 1.0, 2.0]
    assert found["b"].tolist() == ["ü", "x"]
    assert found["c"].shape == (0, 3)


@pytest.mark.skipif(os.name == "nt", reason="this system has no such limits")
@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("os.kill(os.getpid(), 11)", "its parser failed"),
        ("os._exit(0)", "its parser failed"),
        ("while True: pass", "(its parser failed|more than 3 s)"),
        ("raise ValueError('no\\nframes in ' + path)", "no frames in the file"),
        ("return {'a': np.ones(1 << 28)}", "Unable to allocate"),
        ("open('out', 'w').write('x' * 99999)", "File too large"),
        ("return {'a': np.array([{}])}", "its parser failed"),
        ('sys.stdout.buffer.write(b\'{"a": ["<f8", [1]]}\\\n\'); os._exit(0)', "its parser failed"),
        ("__import__('time').sleep(60)", "more than 3 s"),
    ],
)
def test_whatever_becomes_of_it_is_a_line(
    body: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = time.perf_counter()
    assert re.search(said, str(answer(body, tmp_path, monkeypatch)))
    assert time.perf_counter() - began < 5.0


def test_only_known_parsers_run() -> None:
    with pytest.raises(ValueError, match="found 'os'; valid: storage, mesh"):
        foreign.parse("os", b"")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("%YAML:1.0\n---\nK: " + "[" * 100_000, "damaged OpenCV file"),
        ("%YAML:1.0\n---\nK: [1, 2]\n", r"camera_matrix: found \[1.0, 2.0\]"),
        (
            "%YAML:1.0\n---\nK: [500, 0, 320, 0, 500, 240, 0, 0, 1]\nimage_size: [-5, 4]\n",
            "image_size: found",
        ),
        (
            "%YAML:1.0\n---\nK: [1.0e9, 0, 320, 0, 500, 240, 0, 0, 1]\nimage_size: [640, 480]\n",
            r"focal lengths of 1e\+09",
        ),
        (
            "%YAML:1.0\n---\nK: [500, 0, 320, 0, 500, 240, 0, 0, 1]\nimage_size: [640, 480]\n"
            "rvec: [1, 2]\ntvec: [0, 0, 1]\n",
            "rvec: found 2 and 3 numbers",
        ),
    ],
)
def test_a_camera_file_of_any_form_is_a_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "camera.yml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said) as caught:
        files.read(path)
    assert "\n" not in str(caught.value)
