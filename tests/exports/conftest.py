"""A finished result that the tests of all formats share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from simrecon import results
from simrecon.exports import view as views
from simrecon.exports.view import ResultView
from tests.support.runs import job_of


@pytest.fixture(scope="session")
def finished(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results") / "squat"
    results.write(job_of(folder), run)
    return folder


@pytest.fixture
def view(finished: Path) -> ResultView:
    return views.of(results.open_result(finished), views.Choices())
