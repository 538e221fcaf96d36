"""Suites by name or path; what one holds is in `simrecon.bench.schema`."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from simrecon import plan as plans
from simrecon import resources
from simrecon.bench import checks
from simrecon.bench.schema import Suite
from simrecon.errors import InputError, printable
from simrecon.io import tables
from simrecon.io.messages import hint


def names() -> tuple[str, ...]:
    """Names of the suites that ship with simrecon, sorted."""
    return tuple(sorted(path.stem for path in _shipped().glob("*.toml")))


def read(name_or_path: str | Path) -> Suite:
    """Read a suite that ships, by name, or the user's own, by path.

    Raises:
        InputError: there is no such suite, or it has an unknown, missing or impossible value.
    """
    name, shipped = str(name_or_path), names()
    path = _shipped() / f"{name}.toml" if name in shipped else Path(name)
    if not path.is_file():
        valid = ", ".join(shipped)
        raise InputError(
            f"there is no suite {name!r}{hint(name, shipped)}; valid: {valid}, or a path of a TOML file"
        )
    suite = tables.read(Suite, path, "suite")
    checks.check(suite, str(path))
    return dataclasses.replace(suite, name=printable(path.stem), folder=path.parent)


def with_plan(suite: Suite, name: str) -> Suite:
    """A suite with another plan, also where a clip has its own.

    Raises:
        InputError: there is no such plan, or a variant replaces what it has not.
    """
    clips = tuple(dataclasses.replace(clip, plan=None) for clip in suite.clip)
    changed = dataclasses.replace(suite, plan=name, clip=clips)
    base = plans.read(name)
    for variant in suite.variant:
        plans.overridden(base, variant.plan, f"{suite.name}: variant {variant.name}")
    return changed


def _shipped() -> Path:
    return resources.folder("bench/suites")
