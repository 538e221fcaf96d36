"""Every tool is part of the package, can be imported, and says how it is run."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

import tools

FOLDER = Path(tools.__file__).parent
MODULES = sorted(path for path in FOLDER.rglob("*.py") if path.name != "__init__.py")
LIBRARIES = {
    "references", "mocap_poses", "prior_data", "prior_model", "prior_score", "layered", "rooms", "levelled",
    "contact_model", "contact_motions", "contact_paper", "contact_views", "browser", "seated",
    "contact_grounded",
    "synthesis_corpus", "synthesis_views", "synthesis_data", "synthesis_model", "synthesis_training",
    "synthesis_scores", "synthesis_simulated", "synthesis_page", "synthesis_numbers", "synthesis_targets",
    "future_distances", "flips",
}  # fmt: skip
"""Modules that the programs share."""
EXTRAS = {"anny", "dask_jobqueue", "fast_simplification", "grimp", "sklearn", "torch", "websockets", "zuko"}
"""Packages that only some of the programs need."""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(FOLDER).as_posix())
def test_a_tool_imports_and_says_how_it_is_run(path: Path) -> None:
    name = f"tools.{'.'.join(path.relative_to(FOLDER).with_suffix('').parts)}"
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in EXTRAS:
            raise
        pytest.skip(f"needs {error.name}")
    assert module.__doc__
    if path.stem in LIBRARIES:
        assert not hasattr(module, "main")
    else:
        assert callable(module.main)
        assert f"python -m {name}" in module.__doc__


def test_every_folder_is_a_package() -> None:
    folders = {path.parent for path in MODULES}
    assert all((folder / "__init__.py").is_file() for folder in folders)
    assert {folder.name for folder in folders} == {"bench", "make", "ops", "study", "train"}
