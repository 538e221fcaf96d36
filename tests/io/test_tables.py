"""TOML ↔ dataclasses: what is written comes back, and every slip is one clear line."""

from __future__ import annotations

import dataclasses
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon.errors import InputError
from simrecon.io import tables, toml


@dataclass(frozen=True)
class Leg:
    name: str = tables.text()
    length_m: float = tables.number(0.1, 2.0)
    spans_s: tuple[float, ...] = ()


@dataclass(frozen=True)
class Person:
    mass_kg: float
    at_px: tuple[float, float] | None = None
    legs: tuple[Leg, ...] = ()


@dataclass(frozen=True)
class Task:
    input: Path = tables.option(help="the file", metavar="FILE")
    person: Person = tables.option()
    legs: tuple[Leg, ...] = ()
    seed: int = tables.number(0, 2**63 - 1, default=0)
    exact: bool = False
    method: Literal["fast", "slow"] = "fast"
    plan: str = tables.option("default", choices=lambda: ("default", "quick"))
    stiffness: float | Literal["fit"] | None = tables.number(100.0, 1e7, default=None)
    weight: float = tables.option(1.0, above=0.0, high=5.0)
    turn: int | None = tables.option(None, numbers=(90, 180, 270))
    drop: tuple[str, ...] = tables.choice("joints", "camera", default=())
    settings: dict[str, float] = tables.option({})
    anything: dict[str, Any] = tables.option({})
    note: str | None = None
    name: str = tables.not_in_file("unnamed")


LEAST = 'input = "a.npz"\n[person]\nmass_kg = 70\n'
FULL = Task(
    Path("clips/a b.npz"),
    Person(70.5, (1.0, 2.5), (Leg("left", 0.9, (0.1, 0.2)),)),
    (Leg("l", 1.0), Leg('r "quoted" \\', 1.1)),
    seed=2**63 - 1,
    exact=True,
    method="slow",
    plan="quick",
    stiffness="fit",
    weight=0.1 + 0.2,
    turn=180,
    drop=("camera",),
    settings={"a.b": 1e-7, "c": 5e-324},
    anything={"loss.prior": 0.0, "inner": {"list": [1, "x", True]}},
    note="two\nlines\tand \x7f",
)


def test_least() -> None:
    task = tables.parse(Task, LEAST, "t.toml")
    assert task == Task(Path("a.npz"), Person(70.0))
    assert isinstance(task.person.mass_kg, float)
    assert tables.to_table(task) == {
        "input": "a.npz", "person": {"mass_kg": 70.0, "legs": []}, "legs": [], "seed": 0, "exact": False,
        "method": "fast", "plan": "default", "weight": 1.0, "drop": [], "settings": {}, "anything": {},
    }  # fmt: skip


@pytest.mark.parametrize("task", [FULL, Task(Path("a"), Person(1.0))])
def test_what_is_written_comes_back(task: Task, tmp_path: Path) -> None:
    text = tables.dumps(task)
    assert tables.parse(Task, text, "t.toml") == task
    assert tables.build(Task, tables.to_table(task), "x") == task
    assert tomllib.loads(text) == tables.to_table(task)
    (tmp_path / "t.toml").write_text(text, encoding="utf-8", newline="")
    assert tables.read(Task, tmp_path / "t.toml") == task


def test_what_is_not_in_the_file_is_neither_written_nor_read() -> None:
    assert "unnamed" not in tables.dumps(FULL)
    with pytest.raises(InputError, match="unknown key 'name'"):
        tables.parse(Task, f'name = "x"\n{LEAST}', "t.toml")


def test_a_table_of_python_may_hold_values_of_the_dataclass() -> None:
    table = {
        "input": Path("a"),
        "person": {"mass_kg": 1, "at_px": (1, 2), "legs": ()},
        "note": None,
        "drop": ("camera",),
    }
    assert tables.build(Task, table, "x") == Task(Path("a"), Person(1.0, (1.0, 2.0)), drop=("camera",))


finite = st.floats(-1e12, 1e12)
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


@given(finite, st.dictionaries(words, st.one_of(finite, words, st.booleans(), st.lists(finite))), words)
def test_any_number_and_text_comes_back(mass_kg: float, anything: dict[str, Any], note: str) -> None:
    task = Task(Path("a"), Person(mass_kg), anything=anything, note=note)
    back = tables.parse(Task, tables.dumps(task), "t.toml")
    assert back == task
    assert back.person.mass_kg.hex() == mass_kg.hex()


@given(st.recursive(st.one_of(finite, words), lambda inner: st.dictionaries(words, inner) | st.lists(inner)))
def test_tables_in_any_order_come_back(value: Any) -> None:
    table = {"first": value, "second": 1, "third": [{"a": value, "b": 2}, {}]}
    assert tomllib.loads(toml.dumps(table)) == table


def slips() -> list[tuple[str, str, str]]:
    """Text of LEAST, its replacement, and the message."""
    leg = '[[legs]]\nname = "left"\nlength_m = 1\n'
    return [
        ("input", "inputs", "unknown key 'inputs', did you mean 'input'?; valid: input, person, legs, seed"),
        (LEAST, 'input = "a"', "lacks the key 'person'; needed: input, person"),
        ("mass_kg = 70", "", "[person] lacks the key 'mass_kg'; needed: mass_kg"),
        ("mass_kg", "mass", "[person] unknown key 'mass', did you mean 'mass_kg'?; valid: mass_kg,"),
        (LEAST, 'input = "a"\nperson = 3', "[person] must be a table, found 3"),
        ('"a.npz"', '""', "input must be a path in quotes, found ''"),
        ('"a.npz"', '"a\\u0000"', "input must be a path in quotes, found 'a\\x00'"),
        ("70", '"70"', "[person] mass_kg must be a number, found '70'"),
        ("70", "nan", "[person] mass_kg must be a number, found nan"),
        ("70", "inf", "[person] mass_kg must be a number, found inf"),
        ("70", "true", "[person] mass_kg must be a number, found True"),
        ("[person]", "seed = 1.0\n[person]", "seed must be a whole number from 0 to 9.22337e+18, found 1.0"),
        ("[person]", "seed = -1\n[person]", "seed must be a whole number from 0 to 9.22337e+18, found -1"),
        ("[person]", "exact = 1\n[person]", "exact must be true or false, found 1"),
        (
            "[person]",
            'method = "fats"\n[person]',
            "method must be one of fast, slow, found 'fats', did you mean 'fast'?",
        ),
        ("[person]", 'plan = "no"\n[person]', "plan must be one of default, quick, found 'no'"),
        (
            "[person]",
            'stiffness = "fot"\n[person]',
            "stiffness must be a number from 100 to 1e+07 or \"fit\", found 'fot', did you mean 'fit'?",
        ),
        ("[person]", "weight = 0\n[person]", "weight must be a number above 0 and at most 5, found 0"),
        ("[person]", 'drop = "x"\n[person]', "drop must be a list, each one of joints, camera, found 'x'"),
        ("[person]", 'drop = ["x"]\n[person]', "must be a list, each one of joints, camera, found ['x']"),
        ("[person]", 'note = ["x"]\n[person]', "note must be text in quotes, found ['x']"),
        ("[person]", "[settings]\na = true\n[person]", "settings must be a table, each value a number"),
        ("[person]\n", "[person]\nat_px = [1]\n", "at_px must be a list of two numbers, found [1]"),
        (LEAST, f"{LEAST}[legs]", "legs must be a list of tables, found {}"),
        (LEAST, f"{LEAST}{leg}{leg}long = 1", "[[legs]] 2 (left): unknown key 'long'"),
        (LEAST, LEAST + leg.replace("1", "3"), "[[legs]] 1 (left): length_m must be a number from 0.1 to 2"),
        (LEAST, LEAST + leg.replace("left", " "), "[[legs]] 1 ( ): name must be text in quotes, found ' '"),
        (LEAST, f"{LEAST}legs = [3]", "[[person.legs]] 1: must be a table, found 3"),
        (LEAST, "a = " + "[" * 5000 + "]" * 5000, "not valid TOML"),
        (LEAST, "[person", "not valid TOML"),
        ("70", "1" * 5000, "not valid TOML"),
    ]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), slips())
def test_slips_are_one_clear_line(old: str, new: str, message: str) -> None:
    assert old in LEAST
    with pytest.raises(InputError) as caught:
        tables.parse(Task, LEAST.replace(old, new), "t.toml")
    assert str(caught.value).startswith("t.toml: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.toml: cannot read the task: No such file"):
        tables.read(Task, tmp_path / "none.toml", "task")
    (tmp_path / "a.toml").write_bytes(b"\xff")
    with pytest.raises(InputError, match=r"a.toml: cannot read the task"):
        tables.read(Task, tmp_path / "a.toml", "task")


def test_keys_tell_a_command_line_all_it_needs() -> None:
    keys = tables.keys(Task)
    assert list(keys)[:3] == ["input", "person", "legs"]
    assert "name" not in keys
    assert (keys["input"].needed, keys["input"].type, keys["input"].default) == (
        True,
        Path,
        dataclasses.MISSING,
    )
    assert (keys["input"].rules["help"], keys["input"].rules["metavar"]) == ("the file", "FILE")
    assert (keys["seed"].needed, keys["seed"].default, keys["seed"].rules["low"]) == (False, 0, 0)
    assert keys["plan"].choices == ("default", "quick")
    assert keys["method"].choices == ("fast", "slow")
    assert keys["stiffness"].choices == ("fit",)
    assert keys["settings"].default == {}


def test_a_default_table_is_not_shared() -> None:
    assert Task(Path("a"), Person(1.0)).settings is not Task(Path("a"), Person(1.0)).settings


@pytest.mark.parametrize(
    ("name", "word", "value"),
    [
        ("seed", "12", 12),
        ("weight", "1.5", 1.5),
        ("exact", "true", True),
        ("turn", "270", 270),
        ("drop", "camera, joints", ("camera", "joints")),
        ("stiffness", "fit", "fit"),
        ("stiffness", "2e4", 2e4),
        ("note", "7", "7"),
        ("input", "x.npz", Path("x.npz")),
    ],
)
def test_values_from_words(name: str, word: str, value: Any) -> None:
    assert tables.from_text(tables.keys(Task)[name], word, "here:") == value


@pytest.mark.parametrize(
    ("name", "word", "message"),
    [
        ("seed", "1.5", "here: seed must be a whole number from 0 to 9.22337e+18, found '1.5'"),
        ("seed", "9" * 5000, "here: seed must be a whole number"),
        ("weight", "inf", "here: weight must be a number above 0 and at most 5, found inf"),
        ("turn", "45", "here: turn must be 90, 180 or 270, found 45"),
        ("turn", "left", "here: turn must be 90, 180 or 270, found 'left'"),
        ("exact", "yes", "here: exact must be true or false, found 'yes'"),
    ],
)
def test_words_that_are_no_value(name: str, word: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        tables.from_text(tables.keys(Task)[name], word, "here:")
    assert str(caught.value).startswith(message)
