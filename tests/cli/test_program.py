"""The program as a whole: its help, its words, and how it ends."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest

from simrecon import cli
from simrecon.batch import runner
from simrecon.batch.ahead import Settings
from simrecon.errors import InputError
from simrecon.results.folder import REPORT


def test_help_begins_with_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert cli.PURPOSE in " ".join(shown.split())
    assert "import simrecon" not in shown


@pytest.mark.parametrize("word", ["status", "report"])
def test_words_of_batch_have_their_own_help(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["batch", word, "--help"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"usage: simrecon batch {word} ")
    assert "--seed" not in shown
    assert cli.main(["batch", word]) == 2
    assert f"`simrecon batch {word} -h`" in capsys.readouterr().err
    assert cli.main(["batch", word, "-o", "out"]) == 2  # an input of that name
    assert f"{word}: found no such file" in capsys.readouterr().err


def test_a_batch_does_not_mix_with_a_single_result(tmp_path: Path) -> None:
    (tmp_path / REPORT).write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="result of a single run"):
        runner.run((), Settings(tmp_path))


def test_a_closed_pipe_ends_quietly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Closed:
        """Standard output that nobody reads any more."""

        def __init__(self) -> None:
            self.file = os.open(tmp_path / "out", os.O_CREAT | os.O_WRONLY)

        def write(self, _: str) -> Any:
            raise BrokenPipeError

        flush = fileno = lambda self, *_: self.file

    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", Closed())
        assert cli.main(["models", "list"]) == cli.EXIT_PIPE
    assert capsys.readouterr().err == ""
