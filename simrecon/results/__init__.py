"""The result folder: the final replay, what is written, and what is read back."""

from __future__ import annotations

from simrecon.results.folder import check_writable, read, write
from simrecon.results.motion import FALLBACK, SIMULATED, Audit, record

__all__ = ["FALLBACK", "SIMULATED", "Audit", "check_writable", "read", "record", "write"]
