"""Trackers by name."""

from __future__ import annotations

import pytest

from simrecon import engines
from simrecon.engines.sampling.sampler import Sampler
from simrecon.errors import InputError
from tests.engines.conftest import Makers


@pytest.mark.parametrize("name", engines.ENGINES)
def test_every_name_is_a_tracker_of_the_problem(make: type[Makers], name: str) -> None:
    problem = make.clip(make.settings())
    tracker = engines.make(name, problem, 1)
    assert tracker.problem is problem
    assert callable(tracker.solve)
    assert callable(tracker.prepare)


def test_sampling_is_the_one_that_ships(make: type[Makers]) -> None:
    assert engines.names() == ("sampling", "none")
    assert isinstance(engines.make("sampling", make.clip(make.settings()), 1), Sampler)


def test_an_unknown_name_lists_the_valid_ones(make: type[Makers]) -> None:
    with pytest.raises(InputError, match=r"'samplign'.*valid: sampling"):
        engines.make("samplign", make.clip(make.settings()))


def test_the_engine_that_simulates_nothing_is_no_tracker(make: type[Makers]) -> None:
    engines.check(engines.NOTHING)
    assert [name for name in engines.names() if not engines.simulates(name)] == [engines.NOTHING]
    with pytest.raises(InputError, match="the engine 'none' simulates nothing; valid: sampling"):
        engines.make(engines.NOTHING, make.clip(make.settings()))
