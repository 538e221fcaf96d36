"""How a batch stands, from its events on disk: at any time, from any terminal."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from simrecon.batch import journal, records
from simrecon.batch.journal import Event, Places
from simrecon.errors import printable
from simrecon.io.messages import counted
from simrecon.system.progress import duration

ORDER = ("running", "waiting", "failed", "done")


@dataclass
class Row:
    """A clip: `state` is one of `ORDER`; figures of finished ones, window and loss of running ones.

    Before its first window a running one is at a `stage`, of which a `part` is done.
    """

    name: str
    input: str = ""
    plan: str = ""
    state: str = "waiting"
    kept: bool = False
    video_s: float = 0.0
    window: int = 0
    furthest: int = 0
    windows: int = 0
    loss: float | None = None
    message: str = ""
    stage: str = ""
    part: float = 0.0
    figures: dict[str, Any] | None = None

    @property
    def progress(self) -> str:
        """How far a running clip is, in words."""
        if self.stage:
            return self.stage + (f", {self.part:.0%}" if self.part else "")
        return f"window {self.window} of {self.windows}"


@dataclass
class State:
    """Of a batch.

    Attributes:
        rows: by name, in the order given.
        begin: when its last run began; end: when it ended, None while it runs or if it was killed.
        alive: whether a process holds the folder.
        reason: why it ended early.
        left_s: time left, None where that can't be said yet.
    """

    rows: dict[str, Row] = field(default_factory=dict)
    begin: float = 0.0
    end: float | None = None
    alive: bool = False
    reason: str = ""
    left_s: float | None = None

    def of(self, state: str) -> list[Row]:
        """The clips of a state."""
        return [row for row in self.rows.values() if row.state == state]


def read(places: Places, now: float | None = None) -> State:
    """The state of the batch in a folder.

    Raises:
        InputError: there is none.
    """
    state = State()
    gained: dict[str, int] = {}
    for event in journal.read_events(places.events):
        _apply(state, gained, event)
    state.alive = journal.holder(places) is not None
    for row in state.rows.values():
        if row.state == "running" and not state.alive:
            row.state = "waiting"
        if row.state == "done":
            found = records.read(places, row.name)
            row.figures = None if found is None else dict(found.figures)
    state.left_s = _left(state, gained, time.time() if now is None else now)
    return state


def _apply(state: State, gained: dict[str, int], event: Event) -> None:
    kind, name = event["event"], event.get("clip")
    if kind == "begin":
        state.rows.clear()
        gained.clear()
        state.begin, state.end, state.reason = event["time"], None, ""
    elif kind == "end":
        state.end, state.reason = event["time"], event.get("reason", "")
    elif kind == "clip" and name is not None:
        row = Row(name, event.get("input", ""), event.get("plan", ""))
        row.video_s, row.windows = event.get("video_s", 0.0), event.get("windows", 0)
        row.kept = event.get("state") == "kept"
        row.state = "done" if row.kept else "waiting"
        state.rows[name] = row
    elif name in state.rows:
        row = state.rows[name]
        row.state = {
            "stage": "running", "started": "running", "window": "running", "done": "done", "failed": "failed",
            "retry": "waiting", "stopped": "waiting",
        }.get(kind, row.state)  # fmt: skip
        row.window, row.windows = event.get("window", row.window), event.get("windows", row.windows)
        row.stage, row.part = event.get("stage", ""), event.get("part", 0.0)
        row.loss, row.message = event.get("loss", row.loss), event.get("message", row.message)
        if kind == "window" and row.window > row.furthest:  # after a fall windows are done again
            gained[name] = gained.get(name, 0) + 1
        row.furthest = max(row.furthest, row.window)


def _left(state: State, gained: dict[str, int], now: float) -> float | None:
    """Seconds left: video still to do over the video per second that this run did so far."""
    if not state.alive:
        return None
    rows = [row for row in state.rows.values() if row.windows]
    each = {row.name: row.video_s / row.windows for row in rows}
    did = sum(each[name] * count for name, count in gained.items() if name in each)
    rest = sum(
        row.video_s - each[row.name] * row.window for row in rows if row.state in ("running", "waiting")
    )
    if rest <= 0:
        return 0.0
    return rest * (now - state.begin) / did if did > 0 else None


def text(state: State, folder: str, now: float | None = None) -> str:
    """For people."""
    rows, left = state.rows, state.left_s
    count = {kind: len(state.of(kind)) for kind in ORDER}
    moment = time.time() if now is None else now
    if state.alive:
        head = f"running for {duration(moment - state.begin)}"
        if left is not None:
            head += f", {duration(left)} left (until {time.strftime('%H:%M', time.localtime(moment + left))})"
    elif state.end is None:
        head = "was killed; the same command goes on where it stopped"
    else:
        head = f"ended {time.strftime('%Y-%m-%d %H:%M', time.localtime(state.end))}"
        head += f": {state.reason}" if state.reason else ""
    lines = [
        f"{folder}: {head}",
        f"{counted(len(rows), 'clip')}: {count['done']} done, {count['running']} running, "
        f"{count['waiting']} waiting, {count['failed']} failed",
    ]
    for row in state.of("running"):
        loss = f", loss {row.loss:.1f}" if row.loss is not None else ""
        lines.append(f"running  {row.name}  {row.progress}{loss}")
    lines += [f"failed   {row.name}  {row.message}" for row in state.of("failed")]
    for row in state.of("done"):
        verdict = row.figures["verdict"] if row.figures else "done"
        if verdict not in ("all simulated", "all planned"):
            lines.append(f"done     {row.name}  {verdict}")
    return "\n".join(map(printable, lines))


def table(state: State) -> dict[str, Any]:
    """For programs."""
    return {
        "alive": state.alive,
        "begin": state.begin,
        "end": state.end,
        "reason": state.reason,
        "left_s": state.left_s,
        "clips": [vars(row) for row in state.rows.values()],
    }
