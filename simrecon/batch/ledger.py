"""What is noted of the clips of a batch: in its journal, in how it ended, and in words to the user."""

from __future__ import annotations

import contextlib
import os
import platform
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from simrecon.batch import failures, journal, page
from simrecon.batch.ahead import Settings
from simrecon.batch.clips import Clip
from simrecon.batch.journal import Journal, Places
from simrecon.io import provenance

Say = Callable[[str], None]


@dataclass
class Outcome:
    """How a batch ended: names of clips, messages of those that failed, why it ended early if it did."""

    done: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)
    fallback: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    left: list[str] = field(default_factory=list)
    reason: str = ""


class Ledger:
    """Writes down what happens; decides nothing."""

    def __init__(self, places: Places, book: Journal, say: Say) -> None:
        self.outcome, self.book, self.say = Outcome(), book, say
        self._places = places

    def begin(self, run_id: str, settings: Settings, clips: int) -> None:
        """The first event."""
        self.book.append(
            "begin",
            schema=journal.SCHEMA,
            run=run_id,
            pid=os.getpid(),
            host=platform.node(),
            versions=provenance.versions(),
            settings=_plain(settings),
            clips=clips,
        )

    def waits(self, clip: Clip, facts: dict[str, Any]) -> None:
        """A clip is to be done."""
        self.book.append("clip", state="waiting", **_about(clip, facts))

    def kept(self, clip: Clip, facts: dict[str, Any], figures: Mapping[str, Any]) -> None:
        """A clip was done before."""
        self.book.append("clip", state="kept", **_about(clip, facts))
        self.outcome.kept.append(clip.name)
        if figures["fallback"]:
            self.outcome.fallback.append(clip.name)

    def done(self, clip: Clip, figures: dict[str, Any]) -> None:
        """A clip has its result."""
        self.book.append("done", clip=clip.name, figures=figures)
        self.outcome.done.append(clip.name)
        if figures["fallback"]:
            self.outcome.fallback.append(clip.name)
        self.say(f"{clip.name}: {figures['verdict']}, {figures['wall_s']:.1f} s")

    def again(self, clip: Clip, answer: dict[str, Any], attempts: int) -> None:
        """A clip failed and is tried once more."""
        self.book.append("retry", clip=clip.name, message=answer["message"], attempt=attempts)
        self.say(f"{clip.name}: tried again: {answer['message']}")

    def failed(self, clip: Clip, answer: dict[str, Any], attempts: int) -> None:
        """A clip failed for good."""
        self.outcome.failed[clip.name] = answer["message"]
        self.book.append(
            "failed", clip=clip.name, cause=answer["kind"], message=answer["message"], attempts=attempts
        )
        self.say(f"{clip.name}: failed: {answer['message']}")
        failures.write(self._places, clip, answer)

    def close(self) -> None:
        """The last event and the report; a full disk may take both, and must not hide why the batch ended."""
        outcome = self.outcome
        with contextlib.suppress(OSError):
            self.book.append(
                "end",
                done=len(outcome.done),
                kept=len(outcome.kept),
                failed=len(outcome.failed),
                left=len(outcome.left),
                reason=outcome.reason,
            )
            page.write(self._places)


def _about(clip: Clip, facts: dict[str, Any]) -> dict[str, Any]:
    known = ("video_s", "windows", "key") if "key" in facts else ()
    about = {"clip": clip.name, "input": clip.input, "plan": clip.plan}
    return about | {key: facts[key] for key in known}


def _plain(settings: Settings) -> dict[str, Any]:
    return {key: str(value) if isinstance(value, Path) else value for key, value in asdict(settings).items()}
