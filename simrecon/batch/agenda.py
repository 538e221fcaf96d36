"""The clips of a batch that wait and those that run, and how much of their video is done."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from simrecon.batch.clips import Clip
from simrecon.batch.journal import Event


@dataclass
class QueuedClip:
    """A clip that waits or runs."""

    clip: Clip
    facts: dict[str, Any]
    attempts: int = 0
    window: int = 0
    reached: int = 0
    started: Event | None = None
    future: Any = None


@dataclass
class Agenda:
    """What there is to do.

    Attributes:
        waiting: the next one first.
        running: by future.
        video_s: seconds of video of all that there was to do; video_done_s: of what is done.
    """

    waiting: list[QueuedClip] = field(default_factory=list)
    running: dict[Any, QueuedClip] = field(default_factory=dict)
    video_s: float = 0.0
    video_done_s: float = 0.0

    def add(self, task: QueuedClip) -> None:
        """One more to do."""
        self.waiting.append(task)
        self.video_s += task.facts["video_s"]

    def sort(self) -> None:
        """The longest first, so that none is left alone at the end."""
        self.waiting.sort(key=lambda task: (-task.facts["video_s"], task.clip.name))

    def running_clip(self, name: str) -> QueuedClip | None:
        """The task of a clip that runs."""
        return next((task for task in self.running.values() if task.clip.name == name), None)

    def started(self) -> dict[str, Event]:
        """What the workers said when they began, by clip that runs."""
        return {task.clip.name: task.started for task in self.running.values() if task.started}

    def left(self) -> list[str]:
        """Names of the clips that run or wait."""
        return [task.clip.name for task in (*self.running.values(), *self.waiting)]

    def reached_s(self) -> float:
        """Seconds of video that are done, those of finished windows of running clips included."""
        part: float = sum(
            task.facts["video_s"] * task.window / max(task.facts["windows"], 1)
            for task in self.running.values()
        )
        return self.video_done_s + part
