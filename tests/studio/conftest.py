"""A result of the squat, whose evidence is there, and a cache of the tests' own."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from simrecon import evidence, results
from simrecon.job import Job
from simrecon.pipeline import Reconstruction
from simrecon.results import Result
from simrecon.studio.tab import Tab
from tests.support import browser, plan_text
from tests.support.browser import Page
from tests.support.runs import job_of

FAST = {"population": 8, "generations": 2, "length_s": 0.2, "overlap_s": 0.1, "evaluations": 10}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where studios keep what is unsaved."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("SIMRECON_CACHE", str(folder))
    return folder


@pytest.fixture
def clip_file(run: Reconstruction, tmp_path: Path) -> Path:
    """The evidence of the squat."""
    path = tmp_path / "squat.npz"
    evidence.write(path, replace(run.evidence, sha256=""))
    return path


@pytest.fixture
def squat(run: Reconstruction, tmp_path: Path, clip_file: Path) -> Result:
    """The result of the squat."""
    return results.write(job_of(tmp_path / "squat", input=str(clip_file)), run)


@pytest.fixture
def open_tab() -> Iterator[Callable[..., Tab]]:
    """Opens tabs, which are closed after the test."""
    tabs: list[Tab] = []

    def opened(path: Path, base: Result | Job) -> Tab:
        tabs.append(Tab(path, base))
        return tabs[-1]

    yield opened
    for one in tabs:
        one.close()
        if one.run is not None:
            one.run.wait(60)


@pytest.fixture
def tab(squat: Result, open_tab: Callable[..., Tab]) -> Tab:
    """The result, opened."""
    return open_tab(squat.folder, squat)


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    """A plan that takes a second."""
    path = tmp_path / "fast.toml"
    path.write_text(plan_text.quick(FAST), encoding="utf-8")
    return path


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Page]:
    """A browser."""
    with browser.page(tmp_path / "profile") as shown:
        yield shown


@pytest.fixture
def shots(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Where pictures go: `SIMRECON_SHOTS` keeps them."""
    folder = Path(os.environ.get("SIMRECON_SHOTS", tmp_path)) / str(request.node.name)
    folder.mkdir(parents=True, exist_ok=True)
    return folder
