"""The options of a job by name, and how their values are read from a command line or a cell of a table."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from simrecon.errors import InputError
from simrecon.io import tables
from simrecon.io.values import members
from simrecon.job.options import Person, Reading
from simrecon.job.request import Job

_BELONG = {"camera": ("camera_name",), "keypoints": ("keypoints_person",)}
"""Options that say more of the value of another one."""
_INSTEAD = {
    "camera": ("fov_deg", "unknown_camera"),
    "fov_deg": ("camera", "unknown_camera"),
    "unknown_camera": ("camera", "fov_deg"),
}
"""Options that exclude each other."""


@dataclass(frozen=True)
class Option:
    """One option of a job.

    Attributes:
        key: name, type and rules of its field; the name is also its key in manifests.
        section: `reading`, `person`, or empty for the job's own.
    """

    key: tables.Key
    section: str

    @property
    def name(self) -> str:
        """Of the field."""
        return self.key.name

    @property
    def rules(self) -> Mapping[str, Any]:
        """`help`, `metavar`, `flag`, `file`, and what values are valid."""
        return self.key.rules

    @property
    def flag(self) -> str:
        """As it is written on a command line."""
        return str(self.rules.get("flag") or f"--{self.name.replace('_', '-')}")

    @property
    def is_switch(self) -> bool:
        """Whether it is there or not, and has no value."""
        return members(self.key.type) == (bool,)

    def parse(self, word: str) -> Any:
        """The value that a word stands for.

        Raises:
            InputError: it stands for none; the message begins with `must be`.
        """
        plain = re.sub(r"[xX×]", ",", word) if self.rules.get("metavar") == "WxH" else word
        try:
            return self._checked(lambda: tables.from_text(self.key, plain.strip(), ""))
        except InputError as error:  # the value that was read may not look like the word
            valid = str(error).split(", found ")[0]
            example = f", such as {self.rules['example']}" if self.rules.get("example") else ""
            raise InputError(f"{valid}{example}, found {word!r}") from error

    def check(self, value: Any) -> Any:
        """A value of TOML in the type of the option.

        Raises:
            InputError: it is of another type, or not valid; the message begins with `must be`.
        """
        return self._checked(lambda: tables.check(self.key, value, ""))

    def _checked(self, read: Any) -> Any:
        try:
            return read()
        except InputError as error:
            raise InputError(str(error).strip().removeprefix(f"{self.name} ")) from error


def options() -> Iterator[Option]:
    """All options of a job, in the order in which help shows them."""
    for section, owner in (("", Job), ("reading", Reading), ("person", Person)):
        for key in tables.keys(owner).values():
            if "help" in key.rules:
                yield Option(key, section)


def over(before: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Options by name with others put over them, which take the place of those that they exclude."""
    gone = _excluded(given)
    return {name: value for name, value in before.items() if name not in gone} | dict(given)


def defaults(names: Collection[str]) -> dict[str, Any]:
    """The options of these names, and those that belong to them, as they are where nobody gives them."""
    known = {option.name: option.key.default for option in options()}
    return {name: known[name] for name in {*names, *_belonging(names)}}


def with_options(job: Job, values: Mapping[str, Any]) -> Job:
    """The job with some of its options changed, by name.

    Options that they exclude no longer hold, nor what was said of the file that another one replaces.
    """
    values = {**defaults(_excluded(values) | _belonging(values)), **values}
    own: dict[str, dict[str, Any]] = {"": {}, "reading": {}, "person": {}}
    for option in options():
        if option.name in values:
            own[option.section][option.name] = values[option.name]
    return dataclasses.replace(
        job,
        reading=dataclasses.replace(job.reading, **own["reading"]),
        person=dataclasses.replace(job.person, **own["person"]),
        **own[""],
    )


def _excluded(given: Mapping[str, Any]) -> set[str]:
    """Names of the options that others exclude, and of those that belong to them."""
    names = {name for name, value in given.items() if value is not None and value is not False}
    excluded = {other for name in names for other in _INSTEAD.get(name, ())}
    return (excluded | _belonging(excluded)) - names


def _belonging(names: Iterable[str]) -> set[str]:
    return {other for name in names for other in _BELONG.get(name, ())}
