"""What the tests of this folder share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from simrecon.system import blas


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    """Linear algebra on one thread, as whoever asks for windows has it: its own threads spin on few cores."""
    with blas.one_thread():
        yield
