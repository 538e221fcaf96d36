"""Shipped files are found in each layout, and a missing one is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrecon import resources
from simrecon.errors import SimreconError


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty stand-in for the package's folder."""
    path = tmp_path / "simrecon"
    path.mkdir()
    monkeypatch.setattr(resources, "_package_folder", lambda: path)
    return path


def write_plan(folder: Path, text: str) -> None:
    folder.mkdir(parents=True)
    (folder / "quick.toml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("name", ["models", "windows"])
def test_data_folders_are_there(name: str) -> None:
    assert list(resources.folder(name).rglob("*.toml"))


def test_folder_in_package_comes_first(package: Path) -> None:
    (package.parent / "setup.cfg").touch()
    write_plan(package / "windows", "place = 'package'")
    write_plan(package.parent / "windows", "place = 'checkout'")
    assert resources.toml("windows", "quick.toml") == {"place": "package"}


def test_folder_beside_package_in_checkout(package: Path) -> None:
    (package.parent / "setup.cfg").touch()
    write_plan(package.parent / "windows", "place = 'checkout'")
    assert resources.toml("windows", "quick.toml") == {"place": "checkout"}


def test_neighbour_of_installed_package_is_not_taken(package: Path) -> None:
    write_plan(package.parent / "windows", "place = 'another package'")
    with pytest.raises(SimreconError):
        resources.folder("windows")


def test_missing_folder_names_both_places(package: Path) -> None:
    with pytest.raises(SimreconError) as caught:
        resources.folder("windows")
    assert str(package / "windows") in str(caught.value)
    assert str(package.parent / "windows") in str(caught.value)


def test_missing_file_names_those_that_are_there(package: Path) -> None:
    write_plan(package / "windows", "")
    with pytest.raises(SimreconError, match=r"slow\.toml.*there: quick\.toml"):
        resources.toml("windows", "slow.toml")


def test_toml_in_subfolder(package: Path) -> None:
    write_plan(package / "models" / "body", "mass_kg = 70.0")
    assert resources.toml("models", "body", "quick.toml") == {"mass_kg": 70.0}


def test_broken_toml_names_the_file(package: Path) -> None:
    write_plan(package / "windows", "weights = [")
    with pytest.raises(SimreconError, match=r"quick\.toml is not valid TOML"):
        resources.toml("windows", "quick.toml")
