"""The final replay: one plain mj_step loop that reads every frame, and what the scene did to the body.

recording.record ─► trace.replay (every step) ─► frames ─► Motion, Audit
unsimulated.plan: the motion of a plan, where nothing is simulated
bands.banded: the motion with 90 % bands of pose and force
"""

from __future__ import annotations

from simrecon.replay.bands import banded
from simrecon.replay.recording import Audit, record
from simrecon.replay.trace import Gaps, gaps_of, mean_since
from simrecon.replay.unsimulated import plan
from simrecon.types.motion import FALLBACK, NO_STEP, PLANNED, SIMULATED

__all__ = [
    "FALLBACK",
    "NO_STEP",
    "PLANNED",
    "SIMULATED",
    "Audit",
    "Gaps",
    "banded",
    "gaps_of",
    "mean_since",
    "plan",
    "record",
]
