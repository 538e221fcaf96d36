"""The page of a suite in Markdown: tables, checks, targets, failures; and its place in a longer page."""

from __future__ import annotations

from collections.abc import Sequence

from simrecon.bench import curves
from simrecon.bench.rows import Row
from simrecon.bench.schema import Suite
from simrecon.bench.tables import MISSING, table_lines
from simrecon.errors import InputError
from simrecon.system import extras


def markdown(suite: Suite, content: Row) -> str:
    """The Markdown of a suite.

    Args:
        suite: gives the tables.
        content: what `runner.run` returns.
    """
    runs = content["runs"]
    seeds = ", ".join(map(str, suite.seeds))
    lines = [
        f"# Suite `{suite.name}`",
        "",
        suite.purpose,
        "",
        f"Plan `{suite.plan}`, seed {seeds}. {_made_on(content)}",
    ]
    for table in suite.table:
        lines += ["", f"## {table.title}", ""]
        lines += [table.text.strip(), ""] if table.text else []
        lines += table_lines(suite, table, runs)
    if content.get("checks"):
        lines += ["", "## Formulas", "", *_checks(content["checks"])]
    if content["targets"]:
        lines += ["", "## Targets", "", *_targets(content["targets"])]
    if suite.curves:
        lines += ["", "## Forces over time", "", *_curves(suite, content.get("curves", []))]
    failed = [run for run in runs if run["status"] == "failed"]
    if failed:
        lines += ["", "## Failed", ""]
        lines += [
            f"- {run['clip']}, {run['variant']}, seed {run['seed']}: {run['message']}" for run in failed
        ]
    return "\n".join(lines) + "\n"


def replaced(text: str, name: str, section: str) -> str:
    """A page with the section of a suite put between its markers, which are added at the end if missing.

    Args:
        text: of the page.
        name: of the suite.
        section: Markdown of the suite; its headings go one level down.

    Raises:
        InputError: one marker without the other.
    """
    start, end = f"<!-- bench {name} -->", f"<!-- end of bench {name} -->"
    lower = "\n".join(f"#{line}" if line.startswith("#") else line for line in section.strip().splitlines())
    block = f"{start}\n{lower}\n{end}"
    if (text.count(start), text.count(end)) == (0, 0):
        return f"{text.rstrip()}\n\n{block}\n" if text.strip() else f"{block}\n"
    if (text.count(start), text.count(end)) != (1, 1) or text.index(start) > text.index(end):
        raise InputError(
            f"found the markers {start} and {end} not once each and in this order; valid: both, or none"
        )
    return text[: text.index(start)] + block + text[text.index(end) + len(end) :]


def _curves(suite: Suite, names: Sequence[str]) -> list[str]:
    if not names:
        return [f"Not drawn: {curves.NEEDS} need matplotlib, which {extras.how('plot')} installs."]
    return [f"![Forces over time, {name.removesuffix('.png')}]({suite.name}/{name})" for name in names]


def _targets(rows: Sequence[Row]) -> list[str]:
    lines = ["| target | must | goal | worst clip |", "|---|---|---|---|"]
    for target in rows:
        cells = [
            target["text"],
            _bounds(target, "must"),
            _bounds(target, "reach"),
            target.get("worst_clip", MISSING),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _checks(rows: Sequence[Row]) -> list[str]:
    lines = ["| what | measured | formula | error, % | must |", "|---|---|---|---|---|"]
    for check in rows:
        verdict = "**met**" if check["met"] else "**missed**"
        numbers = [f"{check[key]:.4g} {check['unit']}" for key in ("measured", "expected")]
        limit = f"{verdict} (≤ {check['within_pct']:g})"
        lines.append("| " + " | ".join([check["name"], *numbers, f"{check['error_pct']:.2f}", limit]) + " |")
    return lines


def _bounds(target: Row, level: str) -> str:
    if not target[level]:
        return MISSING
    parts = [
        f"{b['measure'].replace('_', ' ')} {b['shown'] or MISSING} ({b['limit']})" for b in target[level]
    ]
    verdict = {True: "**met**", False: "**missed**", None: "not measured"}[target[f"met_{level}"]]
    return f"{verdict}: {', or '.join(parts)}"


def _made_on(content: Row) -> str:
    machine, versions = content["machine"], content["versions"]
    listed = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
    memory = f", {machine['memory_GiB']} GiB" if machine.get("memory_GiB") else ""
    jobs = f"; {content['jobs']} runs at once" if content["jobs"] > 1 else ""
    return f"Made with {listed} on {machine['cores']} cores ({machine['processor']}{memory}){jobs}."
