"""Plans: every shipped one loads; every slip in one is a clear line."""

from __future__ import annotations

import itertools
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from simrecon import plan as plans
from simrecon import planners, resources
from simrecon.errors import InputError

WINDOWS = resources.folder("windows")
DEFAULT = (WINDOWS / "default.toml").read_text(encoding="utf-8")


def test_the_shipped_plans() -> None:
    assert plans.names() == ("default", "flips", "overnight", "paper", "paper_xie", "quick")


@pytest.mark.parametrize("name", plans.names())
def test_a_plan_is_one_to_one_with_its_file(name: str) -> None:
    table = tomllib.loads((WINDOWS / f"{name}.toml").read_text(encoding="utf-8"))
    found = plans.to_dict(plans.read(name))
    assert found == table
    assert json.loads(json.dumps(found)) == table


@pytest.mark.parametrize("name", plans.names())
def test_every_number_has_a_reason_beside_it(name: str) -> None:
    lines = (WINDOWS / f"{name}.toml").read_text(encoding="utf-8").splitlines()
    for above, line in itertools.pairwise(lines):
        if re.match(r"\w+ = [\d\".]", line) and not line.startswith("purpose"):
            assert above.startswith("# "), line


def test_paper_has_the_settings_of_the_paper() -> None:
    paper = plans.read("paper")
    loss = paper.loss
    assert (loss.com_position, loss.com_velocity, loss.pose, loss.reprojection) == (15, 15, 0.5, 4)
    assert (loss.prior, loss.total_variation, loss.joint_limit, loss.landmark) == (1, 1, 1, 0)
    assert (paper.optimiser.population, paper.optimiser.generations) == (100, 2000)
    assert paper.simulation.timestep_max_s == 1 / 200
    assert paper.window.length_s == 1.0


def test_commit_is_what_the_next_window_does_not_share() -> None:
    window = replace(plans.read("default").window, length_s=0.5, overlap_s=0.125)
    assert window.commit_s == 0.375


def test_own_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(re.sub("population = .*", "population = 77", DEFAULT), encoding="utf-8")
    assert plans.read(path).optimiser.population == 77
    assert plans.read(str(path)) == plans.read(path)


def test_a_plan_knows_the_name_it_was_read_by(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(DEFAULT, encoding="utf-8")
    mine, default = plans.read(path), plans.read("default")
    assert (mine.name, default.name, plans.parse(DEFAULT).name) == (str(path), "default", "")
    assert mine == default
    assert "name" not in plans.to_dict(mine)
    with pytest.raises(InputError, match="unknown key 'name'"):
        plans.parse(f'name = "x"\n{DEFAULT}')


def test_some_values_replaced() -> None:
    default = plans.read("default")
    other = plans.overridden(default, {"window.length_s": 0.75, "kinematics.shape": False}, "here")
    window = replace(default.window, length_s=0.75)
    assert other == replace(default, window=window, kinematics=replace(default.kinematics, shape=False))
    assert other.name == "default"


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("window.lenght_s", 1, "unknown key 'window.lenght_s', did you mean 'window.length_s'?; valid: sim"),
        ("window", 1, "unknown key 'window'"),
        ("purpose", "x", "unknown key 'purpose'"),
        ("window.length_s", "1", "here: [window] length_s must be a number from 0.02 to 60, found '1'"),
        ("window.overlap_s", 50, "here: [window] overlap_s must be below length_s"),
    ],
)
def test_values_that_cannot_be_replaced(path: str, value: object, message: str) -> None:
    with pytest.raises(InputError) as caught:
        plans.overridden(plans.read("default"), {path: value}, "here")
    assert message in str(caught.value)


def test_a_whole_number_is_accepted_for_a_float() -> None:
    found = plans.parse(re.sub("bound_rad = .*", "bound_rad = 1", DEFAULT)).optimiser.bound_rad
    assert found == 1.0
    assert isinstance(found, float)


def test_a_weight_that_the_papers_lack_may_be_left_out_and_is_zero() -> None:
    text, count = re.subn(r"^(landmark|landmark_velocity|planted) = .*", "", DEFAULT, flags=re.M)
    assert count == 3
    loss = plans.parse(text).loss
    assert (loss.landmark, loss.landmark_velocity, loss.planted) == (0.0, 0.0, 0.0)
    assert loss.com_position == plans.read("default").loss.com_position


def test_the_section_of_a_planner_may_be_left_out() -> None:
    text, count = re.subn(r"^\[soft_contact\]\n(.*\n)*", "", DEFAULT, flags=re.M)
    assert count == 1
    assert plans.parse(text) == replace(plans.read("default"), name="")
    alone = f"{text}[soft_contact]\nunits = [0.2, 0.02]\n"
    assert plans.parse(alone).soft_contact.units == (0.2, 0.02)
    assert plans.parse(alone).soft_contact.evaluations == 50


@pytest.mark.parametrize(
    ("pattern", "new", "words"),
    [
        ("units = .*", "units = []", ("[soft_contact] units", "found none")),
        ("units = .*", "units = [0.1, 0.0]", ("[soft_contact] units", "0.0")),
        ("slip_mps = .*", "slip_mph = 1.0", ("[soft_contact]", "'slip_mph'", "did you mean 'slip_mps'")),
        (
            "sigma_rad =",
            "sigma_rda =",
            ("[optimiser]", "'sigma_rda'", "did you mean 'sigma_rad'", "bound_rad"),
        ),
        ("sigma_rad = .*", "", ("[optimiser]", "lacks", "'sigma_rad'")),
        (r"\[loss\]", "[losses]", ("'losses'", "did you mean 'loss'", "kinematics")),
        (r"\[simulation\]\n(.*\n)+?strength = .*", "simulation = 3", ("[simulation]", "table", "3")),
        ("purpose = .*", "", ("lacks", "'purpose'")),
        ("purpose = .*", "purpose = 1", ("purpose", "text", "1")),
        ("covariance = .*", 'covariance = "fulll"', ("covariance", "diagonal, low_rank, full", "'fulll'")),
        ("population = .*", "population = 40.0", ("population", "whole number", "40.0")),
        ("population = .*", "population = true", ("population", "whole number", "True")),
        ("population = .*", "population = 1", ("population", "from 4 to", "found 1")),
        ("sigma_rad = .*", "sigma_rad = true", ("sigma_rad", "a number", "True")),
        ("sigma_rad = .*", "sigma_rad = nan", ("sigma_rad", "nan")),
        ("tol_loss = .*", "tol_loss = inf", ("tol_loss", "at least 0", "inf")),
        ("tol_loss = .*", f"tol_loss = 1{'0' * 400}", ("tol_loss", "at least 0")),
        ("tol_loss = .*", "tol_loss = -1", ("tol_loss", "at least 0", "-1")),
        ("pose = .*", 'pose = "0.5"', ("[loss] pose", "a number", "'0.5'")),
        ("overlap_s = .*", "overlap_s = 0.6", ("overlap_s", "below length_s", "0.6")),
        ("knot_spacing_s = .*", "knot_spacing_s = 9", ("knot_spacing_s", "at most length_s", "9")),
        (r"\[window\]", "[window", ("not valid TOML",)),
    ],
)
def test_bad_plans_are_one_clear_line(pattern: str, new: str, words: tuple[str, ...]) -> None:
    text, count = re.subn(rf"^{pattern}", new, DEFAULT, flags=re.M)
    assert count == 1
    with pytest.raises(InputError) as caught:
        plans.parse(text, "p.toml")
    message = str(caught.value)
    assert message.startswith("p.toml:")
    assert "\n" not in message
    for word in words:
        assert word in message


def test_an_unknown_name_lists_the_plans() -> None:
    with pytest.raises(InputError) as caught:
        plans.read("defualt")
    assert "did you mean 'default'" in str(caught.value)
    for name in plans.names():
        assert name in str(caught.value)


def test_a_file_that_is_not_text(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot read the plan"):
        plans.read(path)


def test_a_plan_names_a_planner_that_there_is() -> None:
    assert planners.names() == plans.PLANNERS
    text = resources.folder("windows").joinpath("quick.toml").read_text(encoding="utf-8")
    with pytest.raises(
        InputError, match="planner must be one of none, soft_contact, centroidal, found 'foot'"
    ):
        plans.parse(text.replace('planner = "soft_contact"', 'planner = "foot"'))
    bare = plans.parse(text.replace('planner = "soft_contact"', ""))
    assert bare.planner == "none"  # as plans that know no such key always did
