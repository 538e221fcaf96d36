"""The local workers of a batch."""

from types import SimpleNamespace
from typing import Any

import pytest

from simrecon.batch import connection

config = pytest.importorskip("dask.config", reason="the extra `batch` is not installed")


def test_workers_keep_what_their_allocator_holds() -> None:
    seen: dict[str, Any] = {}

    def start(**_settings: Any) -> str:
        seen.update(config.get("distributed.nanny.pre-spawn-environ"))
        return "cluster"

    before = config.get("distributed.nanny.pre-spawn-environ", None)
    assert connection._local(SimpleNamespace(LocalCluster=start), 2, 0) == "cluster"
    assert seen == {"OMP_NUM_THREADS": 1, "OPENBLAS_NUM_THREADS": 1, "MKL_NUM_THREADS": 1}
    assert config.get("distributed.nanny.pre-spawn-environ", None) == before
