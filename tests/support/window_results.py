"""A solved window as the engine hands it on, for tests that need one without solving it."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.types import Array, Effort, Handover, Window, WindowResult, WindowStatus


def solved(window: Window, ctrl: Array, states: Array, **changes: Any) -> WindowResult:
    """One generation of one evaluation, with a handover of the last state; `changes` are other fields."""
    fields: dict[str, Any] = {
        "loss": 1.0,
        "loss_terms": {},
        "trace": np.ones(1),
        "steps": np.zeros(1, dtype=np.int64),
        "descent_steps": 0,
        "evaluations": 1,
        "seconds": 1.0,
        "stepping_s": 1.0,
        "status": WindowStatus.GENERATIONS,
        "effort": Effort(),
        "handover": Handover(states[-1], np.zeros((1, ctrl.shape[1]))),
    }
    return WindowResult(window=window, ctrl=ctrl, states=states, **{**fields, **changes})
