"""What no type says of a suite: names that must be there, keys that belong together."""

from __future__ import annotations

import inspect
from collections.abc import Iterable

from simrecon import plan as plans
from simrecon.bench.schema import BenchmarkClip, Suite
from simrecon.bench.statics import CHECKS
from simrecon.errors import InputError


def check(suite: Suite, path: str) -> None:
    """Check a suite whose values are all of their types and in range; `path` is named in messages.

    Raises:
        InputError: it contradicts itself, or names what is not there.
    """
    _check_names("clip", [clip.name for clip in suite.clip], path)
    _check_names("variant", [variant.name for variant in suite.variant], path)
    if not suite.seeds:
        raise InputError(f"{path}: seeds: found none; valid: whole numbers from 0 on")
    for clip in suite.clip:
        _check_clip(clip, f"{path}: clip {clip.name}")
    _check_plans(suite, path)
    _check_formulas(suite, path)
    _check_clips_named(suite, path)
    for name, asked in (("picture", suite.picture), ("curves", suite.curves)):
        if asked and suite.half != "both":
            raise InputError(f"{path}: {name}: found with half = {suite.half!r}; valid: with both halves")


def _check_names(kind: str, names: list[str], path: str) -> None:
    if not names or len(set(names)) < len(names):
        raise InputError(f"{path}: {kind}: found names {', '.join(names) or 'none'}; valid: each once")
    if bad := [name for name in names if "/" in name or name.startswith(".")]:
        raise InputError(f"{path}: {kind}: found the name {bad[0]!r}; valid: one that a folder can have")


def _check_clip(clip: BenchmarkClip, where: str) -> None:
    if (clip.trial is None) == (clip.evidence is None or clip.truth is None):
        raise InputError(f"{where}: found neither or both; valid: evidence and truth, or trial")
    if clip.place is not None and (clip.place.kind == "platform") == (clip.place.height_m is None):
        raise InputError(f"{where}: place: height_m; valid: with a platform, and there only")


def _check_plans(suite: Suite, path: str) -> None:
    """What a variant replaces is there in the plan of every clip."""
    bases = [plans.read(name) for name in {suite.plan, *(clip.plan or suite.plan for clip in suite.clip)}]
    for variant in suite.variant:
        for base in bases:
            plans.overridden(base, variant.plan, f"{path}: variant {variant.name}")


def _check_formulas(suite: Suite, path: str) -> None:
    for entry in suite.check:
        valid = tuple(inspect.signature(CHECKS[entry.formula]).parameters)
        if set(entry.settings) != set(valid):
            names = ", ".join(entry.settings) or "none"
            raise InputError(
                f"{path}: check {entry.name}: settings: found {names}; valid: {', '.join(valid)}"
            )


def _check_clips_named(suite: Suite, path: str) -> None:
    """Clips of tables, targets and pictures are clips of the suite."""
    for table in suite.table:
        _check_known(suite, table.clips, f"{path}: table {table.title}: clips")
    for target in suite.target:
        _check_known(suite, target.clips, f"{path}: target {target.text}: clips")
        if target.against_clip is not None:
            _check_known(suite, [target.against_clip], f"{path}: target {target.text}: against_clip")
    for picture in suite.picture:
        _check_known(suite, [picture.clip], f"{path}: picture: clip")


def _check_known(suite: Suite, names: Iterable[str], where: str) -> None:
    valid = [clip.name for clip in suite.clip]
    for name in names:
        if name not in valid:
            raise InputError(f"{where}: found {name!r}; valid: {', '.join(valid)}")
