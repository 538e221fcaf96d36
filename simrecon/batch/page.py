"""`index.html`: the morning's report, one file that opens anywhere."""

from __future__ import annotations

import base64
import html
import time
from pathlib import Path
from typing import Any
from urllib.parse import quote

from simrecon import resources
from simrecon.batch import status
from simrecon.batch.journal import Places
from simrecon.batch.status import Row, State
from simrecon.errors import printable
from simrecon.io import atomic
from simrecon.io.messages import counted
from simrecon.results.folder import PAGE, REPORT
from simrecon.results.verdict import LEVELS
from simrecon.system.progress import duration

TEMPLATE = "page.html"
COLUMNS = (
    ("clip", "Clip", "text"),
    ("frames", "Frames", ""),
    ("verdict", "Verdict", "text"),
    ("seconds", "Seconds good, doubtful, bad", "number"),
    ("video", "Video, s", "number"),
    ("loss", "Loss", "number"),
    ("px", "2D error, px", "number"),
    ("skate", "Foot skate, %", "number"),
    ("deep", "Penetration, mm", "number"),
    ("weight", "Ground force, % of weight", "number"),
    ("seconds", "Time, s", "number"),
    ("rate", "Time per second of video", "number"),
)
"""Key, title, and how a column is sorted."""
_RANKS = {
    "failed": 0, "fell": 1, "fallback": 2, "bad": 3, "doubtful": 4, "waiting": 5, "running": 6, "good": 7,
}  # fmt: skip


def write(places: Places) -> Path:
    """Write the report of a batch as it stands.

    Returns:
        The file.

    Raises:
        InputError: there is no batch. OSError: it can't be written.
    """
    state = status.read(places)
    atomic.write_text(places.page, render(places, state))
    return places.page


def render(places: Places, state: State) -> str:
    """The page as text."""
    template = (resources.folder("batch") / TEMPLATE).read_text(encoding="utf-8")
    head = "".join(
        f'<th data-kind="{kind}" data-key="{key}"{" tabindex=0" if kind else ""}>{_escaped(title)}</th>'
        for key, title, kind in COLUMNS
    )
    rows = "\n".join(_row(places, row) for row in state.rows.values())
    values = {
        "TITLE": _escaped(places.root.name),
        "SUMMARY": _summary(state),
        "HEAD": head,
        "ROWS": rows,
    }
    for key, value in values.items():
        template = template.replace(f"<!--{key}-->", value)
    return template


def _escaped(text: str) -> str:
    """Text for the page, whatever it holds."""
    return html.escape(printable(text))


def _summary(state: State) -> str:
    """Counts, a few words each."""
    verdicts = [_verdict(row)[0] for row in state.rows.values()]
    video = sum(row.video_s for row in state.of("done"))
    tiles = [
        (len(state.rows), "clips", ""),
        (verdicts.count("good"), "good", "good"),
        (verdicts.count("doubtful"), "doubtful", "doubtful"),
        (verdicts.count("bad"), "bad", "bad"),
        (verdicts.count("fallback"), "with fallback frames", "fallback"),
        (verdicts.count("fell"), "fell", "fell"),
        (verdicts.count("failed"), "failed", "failed"),
        (verdicts.count("waiting") + verdicts.count("running"), "not done", "waiting"),
    ]
    shown = "".join(
        f'<div class="tile {kind}"><b>{count}</b> {words}</div>' for count, words, kind in tiles if count
    )
    end = state.end or time.time()
    stamp = time.strftime("%Y-%m-%d %H:%M", time.localtime(end))
    summary = f"{stamp}, last run took {duration(end - state.begin)}, {video:.1f} s of video done"
    if state.reason:
        summary += f"; {state.reason}"
    return f'<div class="tiles">{shown}</div><p class="said">{_escaped(summary)}</p>'


def _verdict(row: Row) -> tuple[str, str]:
    """Kind (for colour and order) and words."""
    if row.state == "failed":
        return "failed", "failed"
    if row.state != "done" or row.figures is None:
        far = f", {row.progress}" if row.state == "running" else ""
        return ("running" if row.state == "running" else "waiting"), f"{row.state}{far}"
    if row.figures["fallback"]:
        return (
            "fallback",
            f"{row.figures['fallback']} of {counted(row.figures['frames'], 'frame')} on kinematic fallback",
        )
    if row.figures["fell"]:
        return "fell", "fell"
    quality = row.figures.get("quality", "good")  # records of earlier versions have none
    simulated = "planned, not simulated" if row.figures.get("planned") else "all simulated"
    return quality, simulated if quality == "good" else row.figures["verdict"]


def _row(places: Places, row: Row) -> str:
    kind, words = _verdict(row)
    figures = row.figures or {}
    metrics = figures.get("metrics", {})
    wall, video = figures.get("wall_s"), figures.get("video_s", row.video_s or None)
    cells = [
        (row.name, _links(places, row)),
        (None, _strip(places, row)),
        (_RANKS[kind], f'<span class="verdict {kind}">{_escaped(words)}</span>'),
        _seconds(figures.get("seconds")),
        *(
            (value, "–" if value is None else f"{value:.{digits}f}")
            for value, digits in (
                (video, 1),
                (figures.get("loss"), 1),
                (metrics.get("mpjpe_2d_px"), 1),
                (metrics.get("footskate_pct"), 1),
                (metrics.get("penetration_mean_mm"), 1),
                (metrics.get("mean_grf_pct_bw"), 0),
                (wall, 1),
                (wall / video if wall and video else None, 1),
            )
        ),
    ]
    shown = "".join(f"<td{_value(value)}>{inner}</td>" for value, inner in cells)
    return f'<tr class="{kind}">{shown}</tr>'


def _seconds(counts: Any) -> tuple[float | None, str]:
    """Share of the seconds that are good, to sort by, and how many are good, doubtful and bad."""
    if not isinstance(counts, dict) or not all(isinstance(count, int) for count in counts.values()):
        return None, "–"  # records of earlier versions have none
    levels = [counts.get(level, 0) for level in LEVELS]
    return levels[0] / max(sum(levels), 1), " / ".join(map(str, levels))


def _value(value: object) -> str:
    """The attribute that a cell is sorted by."""
    return "" if value is None else f' data-value="{_escaped(str(value))}"'


def _links(places: Places, row: Row) -> str:
    """The name, to the clip's report, and links to what else there is."""
    folder, name = places.result(row.name), _escaped(row.name)
    there: dict[str, Any] = {
        "overlay": next((f for f in ("overlay.mp4", "overlay.png") if (folder / f).is_file()), None),
        "scene": "scene.toml" if (folder / "scene.toml").is_file() else None,
    }
    links = [f'<a href="{quote(row.name)}/{file}">{word}</a>' for word, file in there.items() if file]
    if places.log(row.name).is_file():
        links.append(f'<a href=".batch/logs/{quote(row.name)}.log">log</a>')
    main = _report(places, row)
    title = f'<a class="name" href="{main}">{name}</a>' if main else name
    source, more = _escaped(row.input), " · ".join(links)
    return f'<span title="{source}">{title}</span><small>{more}</small>'


def _report(places: Places, row: Row) -> str | None:
    """Where the report of a clip is, as the index links to it: its page, or else its figures."""
    folder = places.result(row.name)
    main = next((file for file in (PAGE, REPORT) if (folder / file).is_file()), None)
    return None if main is None else f"{quote(row.name)}/{main}"


def _strip(places: Places, row: Row) -> str:
    if row.state == "failed":
        return f'<span class="message">{_escaped(row.message)}</span>'
    path = places.thumbnail(row.name)
    if row.state != "done" or not path.is_file():
        return ""
    data = base64.b64encode(path.read_bytes()).decode()
    image = f'<img alt="frames of {_escaped(row.name)}" src="data:image/jpeg;base64,{data}">'
    main = _report(places, row)
    return f'<a href="{main}">{image}</a>' if main else image
