"""TOML of strangers: what Python's reader would choke on, and what could not be shown, is one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from simrecon import job, plan, scene
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.evidence.camera import files as cameras
from simrecon.io import toml
from simrecon.io.messages import shown
from tests.support.plan_text import quick

HUGE = "0x" + "F" * 5000
DEEP = ".a" * 3000
BOMBS = {
    "dots": f"x{DEEP} = 1",
    "spaced": "x" + " . a" * 100_000 + " = 1",
    "quoted": "x" + '."a\\"."' * 100 + " = 1",
    "literal": "x" + ".'a'" * 3000 + " = 1",
    "header": f"[x{DEEP}]",
    "array of tables": f"[[x{DEEP}]]",
    "inline": f"x = {{a{DEEP} = 1}}",
    "in lists": f"x = {'[' * 70}{']' * 70}",
    "deeper and deeper": "[x" + ".a" * 60 + "]\ny" + ".a" * 60 + " = 1",
    "recursion": "x = " + "[" * 5000,
}


@pytest.mark.parametrize("kind", BOMBS)
def test_what_is_nested_too_deeply_is_one_line(kind: str) -> None:
    with pytest.raises(InputError, match=r"^here: not valid TOML: (a key of|nested) (more than 64|too)"):
        toml.loads(BOMBS[kind], "here")


@pytest.mark.parametrize(
    "text",
    ['x = "' + "\\n." * 500 + '"', "x = [" + "1.5, " * 500 + "]", "#" + "a." * 30 + "\nx = 1", "a.b.c.d = 1"],
)
def test_what_is_flat_is_read(text: str) -> None:
    assert toml.loads(text, "here")


def test_a_number_of_thousands_of_digits_is_one_line() -> None:
    with pytest.raises(InputError, match=r"^here: not valid TOML: a whole number of thousands of digits$"):
        toml.loads(f"x = [[{{y = {HUGE}}}]]", "here")
    assert toml.loads(f"x = {10**400}", "here") == {"x": 10**400}


def test_a_file_that_is_too_large_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(b"#" * (toml.MAX_BYTES + 1))
    with pytest.raises(InputError, match=r"a\.toml: cannot read the file: .*more than"):
        toml.load(path)


@pytest.mark.parametrize("value", [HUGE, "{b" + DEEP + " = 1}"])
@pytest.mark.parametrize("reader", ["scene", "plan", "job", "contacts", "camera"])
def test_every_reader_says_so(tmp_path: Path, reader: str, value: str) -> None:
    texts = {
        "scene": f"[ground]\nfriction = {value}\n",
        "plan": quick({"planner": value}),
        "job": f'schema = "simrecon.job/1"\ninput = {value}\n',
        "contacts": f"schema = {value}\n",
        "camera": f"focal_px = {value}\n",
    }
    path = tmp_path / "a.toml"
    path.write_text(texts[reader], encoding="utf-8")
    readers: dict[str, Any] = {
        "scene": scene.read, "plan": plan.read, "job": job.read, "contacts": wishes.read,
        "camera": cameras.read,
    }  # fmt: skip
    with pytest.raises(InputError, match=r"a\.toml"):
        readers[reader](path)


def test_paths_that_can_be_none_are_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    for line in ('input = "a\\u0000b"', 'input = "a"\n[scene]\nfolder = "a\\u0000b"'):
        path.write_text(f'schema = "simrecon.job/1"\noutput = "o"\n{line}\n', encoding="utf-8")
        with pytest.raises(InputError, match=r"a\.toml: .*found.*'a\\x00b'"):
            job.read(path)


def test_values_that_cannot_be_shown_are_named() -> None:
    assert shown(1 << 20_000) == "int too large to show"
    deep: Any = []
    for _ in range(5000):
        deep = [deep]
    assert shown(deep) == "list too large to show"


def test_more_intervals_than_can_be_meant_are_one_line(tmp_path: Path) -> None:
    path = tmp_path / "contacts.toml"
    spans = ", ".join(f"[{i}, {i}.5]" for i in range(wishes.INTERVALS_MAX + 1))
    path.write_text(f'schema = "{wishes.SCHEMA}"\n[left_toe]\ntouch = [{spans}]\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"\[left_toe\] found 10001 intervals; valid: at most 10000"):
        wishes.read(path)


def test_a_planner_has_few_rounds() -> None:
    for rounds, found in (("[]", "none"), (f"[{'0.1, ' * 21}]", "21")):
        with pytest.raises(InputError, match=rf"\[soft_contact\] units: found {found}; valid: one number"):
            plan.parse(quick({"units": rounds}))
