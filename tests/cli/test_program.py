"""The program as a whole: its help, its words, and how it ends."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from simrecon import cli, plan
from simrecon.batch import runner
from simrecon.batch.ahead import Settings
from simrecon.cli import commands, completion
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


HELP = """
import sys
from simrecon import cli
cli.main({words})
heavy = {{"numpy", "scipy", "mujoco", "cv2", "trimesh", "nlopt"}}
assert not heavy & set(sys.modules), heavy & set(sys.modules)
"""


RUN = """
import sys
import simrecon.cli.run
few_need = {"trimesh", "PIL", "scipy.optimize", "scipy.signal", "scipy.spatial", "scipy.stats"}
assert not few_need & set(sys.modules), few_need & set(sys.modules)
"""


def test_a_run_begins_without_what_few_of_them_need() -> None:
    subprocess.run([sys.executable, "-c", RUN], check=True, capture_output=True)


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["rnu"], []])
def test_help_comes_without_the_libraries_of_the_commands(words: list[str]) -> None:
    subprocess.run([sys.executable, "-c", HELP.format(words=words)], check=True, capture_output=True)


def test_help_lists_what_the_commands_say_of_themselves(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    subparsers = cli._parser()._subparsers._group_actions[0]  # type: ignore[union-attr]
    assert list(subparsers.choices or ()) == list(commands.COMMANDS)
    for choice in subparsers._choices_actions:  # type: ignore[union-attr]
        assert f"{choice.dest} {choice.help}" in shown


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["rnu", "x"], "invalid choice: 'rnu', did you mean 'run'?; valid: demo, run, "),
        (["run", "x", "--scen", "y"], "unknown option --scen, did you mean '--scene'?; `simrecon run -h`"),
        (["run", "x", "--plam=quick"], "unknown option --plam, did you mean '--plan'?"),
        (["batch", "status", "out", "--jason"], "unknown option --jason, did you mean '--json'?"),
        (["scene", "sugest", "x"], "invalid choice: 'sugest', did you mean 'suggest'?; valid: new, add, "),
        (["run", "x", "--qqqqqq"], "unknown option --qqqqqq; `simrecon run -h` shows what is valid"),
    ],
)
def test_a_misspelt_word_is_answered_with_the_nearest(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 2
    assert message in capsys.readouterr().err


def completed(*words: str) -> list[str]:
    """What bash offers for the last of some words."""
    line = " ".join(f"'{word}'" for word in ("simrecon", *words))
    ask = f"COMP_WORDS=({line}); COMP_CWORD={len(words)}; _simrecon; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("there is no bash")
    text = completion.script("bash") + ask
    done = subprocess.run([bash, "--norc", "-c", text], check=True, capture_output=True, text=True)
    return done.stdout.split()


def test_bash_completes_commands_options_and_words() -> None:
    assert completed("re") == ["rerun", "retarget", "report"]
    assert completed("run", "clip.npz", "--pla") == ["--plan", "--planner"]
    assert completed("run", "clip.npz", "--plan", "") == list(plan.names())
    assert completed("run", "--up", "-") == ["-x", "-y", "-z"]
    assert completed("scene", "su") == ["suggest"]
    assert {"status", "report"} <= set(completed("batch", ""))
    assert completed("batch", "status", "--js") == ["--json"]
    assert completed("completion", "z") == []


@pytest.mark.parametrize("shell", completion.SHELLS)
def test_scripts_name_every_command(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["completion", shell]) == 0
    shown = capsys.readouterr().out
    assert all(re.search(rf"\b{name}\b", shown) for name in commands.COMMANDS)
    assert "scene" in shown


def test_mujoco_starts_no_process_that_looks_for_a_screen() -> None:
    """Which would print a traceback of its own where the command is interrupted meanwhile."""
    script = (
        "import sys\n"
        "started = []\n"
        "hear = lambda event, said: started.append(said[1]) if event == 'subprocess.Popen' else None\n"
        "sys.addaudithook(hear)\n"
        "from simrecon.cli import main\n"
        "main(['run', 'nowhere.npz', '-o', 'out'])\n"
        "assert 'mujoco' in sys.modules and not started, started\n"
    )
    environment = {key: value for key, value in os.environ.items() if key != "MUJOCO_GL"}
    command = [sys.executable, "-c", script]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
