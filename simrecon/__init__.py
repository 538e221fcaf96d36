"""Reconstruct physically simulated human motion from what one camera saw.

    import simrecon

    result = simrecon.run(simrecon.Job(input="clip.npz", output="out/clip"))
    print(result.motion.grf_N.max())

What is listed in `__all__` is public (docs/api.md); each is imported when it is first used.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from simrecon.calls import rerun, retarget, suggest
    from simrecon.contact.wishes import read as read_contacts
    from simrecon.evaluation.scores import score as evaluate
    from simrecon.evidence import from_arrays as evidence_from_arrays
    from simrecon.evidence import read as read_evidence
    from simrecon.evidence import write as write_evidence
    from simrecon.exports import export
    from simrecon.exports.picture import write as picture
    from simrecon.futures import Synthesis, synthesize
    from simrecon.job import Job, Person, Reading
    from simrecon.observer import Observer
    from simrecon.people import run_people
    from simrecon.pipeline import Reconstruction, Setup, reconstruct
    from simrecon.plan import read as read_plan
    from simrecon.results import Result, open_result
    from simrecon.running import run
    from simrecon.scene import read as read_scene
    from simrecon.types import Camera, Evidence, Lens, Motion, Scene

__all__ = [
    "Camera",
    "Evidence",
    "Job",
    "Lens",
    "Motion",
    "Observer",
    "Person",
    "Reading",
    "Reconstruction",
    "Result",
    "Scene",
    "Setup",
    "Synthesis",
    "__version__",
    "evaluate",
    "evidence_from_arrays",
    "export",
    "open_result",
    "picture",
    "read_contacts",
    "read_evidence",
    "read_plan",
    "read_scene",
    "reconstruct",
    "rerun",
    "retarget",
    "run",
    "run_people",
    "suggest",
    "synthesize",
    "write_evidence",
]

_PLACES = {
    "Camera": "types",
    "Evidence": "types",
    "Job": "job",
    "Lens": "types",
    "Motion": "types",
    "Observer": "observer",
    "Person": "job",
    "Reading": "job",
    "Reconstruction": "pipeline",
    "Result": "results",
    "Scene": "types",
    "Setup": "pipeline",
    "Synthesis": "futures",
    "evaluate": "evaluation.scores:score",
    "evidence_from_arrays": "evidence:from_arrays",
    "export": "exports",
    "open_result": "results",
    "picture": "exports.picture:write",
    "read_contacts": "contact.wishes:read",
    "read_evidence": "evidence:read",
    "read_plan": "plan:read",
    "read_scene": "scene:read",
    "reconstruct": "pipeline",
    "rerun": "calls",
    "retarget": "calls",
    "run": "running",
    "run_people": "people",
    "suggest": "calls",
    "synthesize": "futures",
    "write_evidence": "evidence:write",
}
"""Module of each public name, and its name there if it has another one."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _PLACES:
        raise AttributeError(f"module 'simrecon' has no attribute {name!r}")
    module, _, inside = _PLACES[name].partition(":")
    value = getattr(importlib.import_module(f"simrecon.{module}"), inside or name)
    if (results := sys.modules.get("simrecon.results.view")) is not None:
        results.Result.to_html = staticmethod(_html)
    globals()[name] = value
    return value


def _html(result: Result) -> str:
    """What a notebook shows of a result."""
    shown: str = importlib.import_module("simrecon.viewer.notebook").frame(result)
    return shown


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
