"""simrecon works from a wheel, editable and from a plain checkout; the README's commands are those of CI."""

from __future__ import annotations

import configparser
import hashlib
import json
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import simrecon

CHECKOUT = Path(__file__).resolve().parents[1]
DATA = ("models", "windows", "example")
TESTED_EXTRAS = ("batch", "mesh", "test", "video")
"""Extras of which the oldest versions are tested; `train` is for tools alone, and `dev` fixes its own."""
JUNK = shutil.ignore_patterns("__pycache__", "*.egg-info", ".*")
ENVIRONMENT = {
    **{key: value for key, value in os.environ.items() if not key.startswith("PYTHON")},
    "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    "PYTHONDONTWRITEBYTECODE": "1",
}
SHOW_FILES = f"""
import hashlib, json
import simrecon
from simrecon.resources import folder
files = {{
    f"{{name}}/{{path.relative_to(folder(name)).as_posix()}}": hashlib.sha256(path.read_bytes()).hexdigest()
    for name in {DATA!r} for path in folder(name).rglob("*") if path.is_file()
}}
print(json.dumps({{"package": simrecon.__file__, "files": files}}))
"""


def run(*command: str | Path, cwd: Path, **variables: str) -> str:
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env={**ENVIRONMENT, **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}: {done.stdout}"
    return done.stdout


def files_under(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what is packed, so that builds leave nothing in the checkout."""
    target = tmp_path_factory.mktemp("checkout")
    for name in ("simrecon", "models", "windows"):
        shutil.copytree(CHECKOUT / name, target / name, ignore=JUNK)
    for name in ("setup.cfg", "pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(CHECKOUT / name, target)
    return target


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All that is installed here except simrecon, as links."""
    target = tmp_path_factory.mktemp("libraries")
    for folder in map(Path, sys.path):
        if folder.name not in ("site-packages", "dist-packages"):
            continue
        for entry in folder.iterdir():
            link = target / entry.name
            if "simrecon" not in entry.name and not link.exists():
                link.symlink_to(entry)
    return target


@pytest.fixture
def python(tmp_path: Path, libraries: Path) -> Path:
    """The interpreter of a fresh environment with the libraries but without simrecon."""
    venv.create(tmp_path / "venv", symlinks=True)
    (site,) = (tmp_path / "venv").glob("lib/python*/site-packages")
    (site / "libraries.pth").write_text(f"{libraries}\n", encoding="utf-8")
    return tmp_path / "venv" / "bin" / "python"


@pytest.fixture(scope="module")
def pip() -> tuple[str, ...]:
    """The start of a pip command that needs no network."""
    try:
        found = version("setuptools")
    except PackageNotFoundError:
        found = "0"
    if int(found.split(".")[0]) < 77:
        pytest.skip(f"builds need setuptools>=77, found {found}: install the extra dev")
    return (sys.executable, "-m", "pip")


@pytest.fixture(scope="module")
def wheel(copy: Path, pip: tuple[str, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("wheel")
    source = target / "source"
    shutil.copytree(copy, source)
    log = run(*pip, "wheel", source, "-v", "--no-deps", "--no-build-isolation", "-w", target, cwd=target)
    assert "Warning" not in log
    (path,) = target.glob("simrecon-*.whl")
    return path


def check(python: Path, package: Path, copy: Path, cwd: Path, **variables: str) -> None:
    """`--version` runs and every shipped data file is found unchanged, from a folder of no meaning."""
    assert simrecon.__version__ in run(python, "-m", "simrecon", "--version", cwd=cwd, **variables)
    shown = json.loads(run(python, "-c", SHOW_FILES, cwd=cwd, **variables).splitlines()[-1])
    assert Path(shown["package"]).is_relative_to(package)
    assert {name.split("/")[0] for name in shown["files"]} == set(DATA)
    homes = {"models": copy, "windows": copy, "example": copy / "simrecon"}
    assert shown["files"] == {
        path.relative_to(home).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for name, home in homes.items()
        for path in files_under(home / name)
    }


def test_from_a_wheel(python: Path, pip: tuple[str, ...], wheel: Path, copy: Path, tmp_path: Path) -> None:
    run(*pip, "--python", python, "install", "--no-deps", wheel, cwd=tmp_path)
    check(python, tmp_path / "venv", copy, tmp_path)
    assert simrecon.__version__ in run(python.parent / "simrecon", "--version", cwd=tmp_path)


def test_editable(python: Path, pip: tuple[str, ...], copy: Path, tmp_path: Path) -> None:
    source = tmp_path / "source"
    shutil.copytree(copy, source)
    run(*pip, "--python", python, "install", "--no-deps", "--no-build-isolation", "-e", source, cwd=tmp_path)
    check(python, source, copy, tmp_path)
    assert simrecon.__version__ in run(python.parent / "simrecon", "--version", cwd=tmp_path)


def test_from_a_plain_checkout(python: Path, copy: Path, tmp_path: Path) -> None:
    check(python, copy, copy, tmp_path, PYTHONPATH=str(copy))


def test_wheel_holds_every_file(wheel: Path, copy: Path) -> None:
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    homes = {"simrecon": "", "models": "simrecon/", "windows": "simrecon/"}
    there = {
        prefix + path.relative_to(copy).as_posix()
        for name, prefix in homes.items()
        for path in files_under(copy / name)
    }
    assert packed == there, "list new folders in setup.cfg under packages, new suffixes under package_data"


def test_readme_commands_are_those_of_ci() -> None:
    readme = (CHECKOUT / "README.md").read_text(encoding="utf-8")
    install, *_, tests = commands("run")
    assert install == "python -m pip install '.[dev]'"
    assert tests == "python -m pytest -n 2"
    assert "&& python -m pip install .\n    simrecon demo " in readme
    assert f"{install} && python -m pytest" in readme


def commands(script: str) -> list[str]:
    """Commands of Python in a script of `.ci`."""
    lines = (CHECKOUT / ".ci" / script).read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line.startswith("python -m ")]


def test_lower_bounds_are_those_that_are_tested() -> None:
    config = configparser.ConfigParser()
    config.read(CHECKOUT / "setup.cfg", encoding="utf-8")
    extras = config["options.extras_require"]
    tested = [config["options"]["install_requires"], *(extras[name] for name in TESTED_EXTRAS)]
    requirements = [line for block in tested for line in block.split()]
    lines = (CHECKOUT / ".ci" / "lower-bounds.txt").read_text(encoding="utf-8").splitlines()
    constraints = [line for line in lines if line and not line.startswith("#")]
    assert sorted(constraints) == sorted(line.replace(">=", "==") for line in requirements)
    install, tests = commands("oldest")
    assert install.endswith(f"--constraint .ci/lower-bounds.txt '.[{','.join(TESTED_EXTRAS)}]'")
    assert tests.startswith("python -m pytest -n 2")
