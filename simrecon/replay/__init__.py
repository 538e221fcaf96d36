"""The final replay: one plain mj_step loop that reads every frame, and what the scene did to the body.

recording.record ─► trace.replay (every step) ─► frames ─► Motion, Audit
"""

from __future__ import annotations

from simrecon.replay.recording import FALLBACK, NO_STEP, SIMULATED, Audit, record
from simrecon.replay.trace import Gaps, gaps_of, mean_since

__all__ = ["FALLBACK", "NO_STEP", "SIMULATED", "Audit", "Gaps", "gaps_of", "mean_since", "record"]
