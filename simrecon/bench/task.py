"""The runs of a suite: one of each clip, variant and seed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simrecon.bench.schema import BenchmarkClip, Suite, Variant


@dataclass(frozen=True)
class BenchmarkTask:
    """What to run, and where.

    Attributes:
        suite: it is part of; clip, variant, seed: of it.
        data: folder of the clips.
        output: folder of the suite's runs.
        threads: of the simulator, 0 for one per core.
        evaluator: an independent script that is run as `evaluator RESULT TRUTH EVIDENCE`, or None.
    """

    suite: Suite
    clip: BenchmarkClip
    variant: Variant
    seed: int
    data: Path
    output: Path
    threads: int = 0
    evaluator: Path | None = None

    @property
    def plan(self) -> str:
        """Name of the plan: the clip's, or the suite's."""
        return self.clip.plan or self.suite.plan

    @property
    def folder(self) -> Path:
        """Of this run."""
        return (
            self.output / "runs" / self.clip.name / self.variant.name.replace(" ", "_") / f"seed{self.seed}"
        )


def tasks(suite: Suite, data: Path, output: Path, evaluator: Path | None = None) -> list[BenchmarkTask]:
    """All runs of a suite, seeds last."""
    return [
        BenchmarkTask(suite, clip, variant, seed, data, output, evaluator=evaluator)
        for clip in suite.clip
        for variant in suite.variant
        for seed in suite.seeds
    ]
