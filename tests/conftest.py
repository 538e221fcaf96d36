"""What several test files share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

pytest_plugins = ["tests.support.runs"]

CHECKOUT = Path(__file__).resolve().parents[1]

# The same examples on every run, and no failure because a machine is busy.
settings.register_profile("simrecon", deadline=None, derandomize=True)
settings.load_profile("simrecon")


@pytest.fixture(scope="session", autouse=True)
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The working folder of all tests is an empty one, and stays so: none depends on what is there."""
    before, folder = Path.cwd(), tmp_path_factory.mktemp("elsewhere")
    os.chdir(folder)
    yield
    os.chdir(before)
    assert list(folder.iterdir()) == []


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of clips and references, which is no part of the repository."""
    folder = Path(os.environ.get("SIMRECON_DATA", CHECKOUT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no clips at {folder}; SIMRECON_DATA can name another folder")
    return folder


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
