"""The options of a job on the command line: the same for all commands that simulate."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import pytest

from simrecon import cli
from simrecon import plan as plans
from simrecon.batch import manifest
from simrecon.cli import options
from simrecon.errors import InputError
from simrecon.job import Job, Person, Reading, text

OF_RUN_ALONE = {"--job", "--forget", "-o"}
"""Options of `run` that say where a single result goes, and from where and how the job is read."""


def flags(command: str) -> dict[str, argparse.Action]:
    """The options of a command by flag."""
    actions = cli._parser()._subparsers._group_actions[0].choices[command]._actions  # type: ignore[union-attr,index]
    return {flag: action for action in actions for flag in action.option_strings}


@pytest.mark.parametrize("command", ["rerun", "batch", "demo"])
def test_every_option_of_run_is_one_of_the_other_commands(command: str) -> None:
    ours, theirs = flags("run"), flags(command)
    assert set(ours) - OF_RUN_ALONE <= set(theirs)
    for flag in set(ours) - OF_RUN_ALONE - {"-h", "--help"}:
        assert (ours[flag].choices, ours[flag].dest) == (theirs[flag].choices, theirs[flag].dest), flag


def test_every_option_is_a_key_of_manifests() -> None:
    assert {option.name for option in text.options()} <= set(manifest.KEYS)
    assert {"plan", "scene", "planner", "engine"} <= set(manifest.KEYS)


WORDS = {
    "--fps": ("25", "fps", 25.0),
    "--size": ("1920x1080", "size_px", (1920, 1080)),
    "--person-at": ("640,360.5", "person_at_px", (640.0, 360.5)),
    "--betas": ("0.5,-1e-2", "betas", (0.5, -0.01)),
    "--ignore": ("joints", "ignore", ("joints",)),
    "--up": ("-y", "up", "-y"),
    "--unit": ("0.0564", "unit", 0.0564),
    "--joints": (
        "left_knee=Bone 12,left_ankle=Bone 13",
        "joints",
        ("left_knee=Bone 12", "left_ankle=Bone 13"),
    ),
    "--seed": ("12", "seed", 12),
    "--fov": ("40", "fov_deg", 40.0),
}


@pytest.mark.parametrize("flag", WORDS)
def test_words_become_values(flag: str) -> None:
    word, name, value = WORDS[flag]
    parsed = cli._parser().parse_args(["run", "clip.npz", "-o", "out", f"{flag}={word}"])
    job = options.apply(parsed, Job("clip.npz", "out"))
    owners: tuple[Any, ...] = (job, job.reading, job.person)
    (owner,) = (owner for owner in owners if hasattr(owner, name))
    assert getattr(owner, name) == value


@pytest.mark.parametrize(
    "words",
    [
        ["--fps", "fast"], ["--fps", "1e9"], ["--size", "1920"], ["--size", "0x5"], ["--person-at", "7"],
        ["--seed", "-1"], ["--seed", "1.5"], ["--betas", "nan"], ["--ignore", "camera"], ["--up", "w"],
        ["--unit", "furlong"], ["--unit", "-1"], ["--unit", "nan"],
    ],
)  # fmt: skip
def test_impossible_words_are_one_line_that_says_what_is_valid(words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        cli._parser().parse_args(["run", "clip.npz", "-o", "out", *words])
    assert words[0] in str(caught.value)
    assert "must be" in str(caught.value) or "choose from" in str(caught.value)


def test_what_is_not_given_stays() -> None:
    before = Job(
        "clip.npz",
        "out",
        reading=Reading(fps=25.0, up="y"),
        person=Person(betas=(1.0,)),
        plan=plans.read("flips"),
        seed=3,
    )
    parsed = cli._parser().parse_args(["rerun", "out", "--up", "z", "--height-m", "1.8"])
    after = options.apply(parsed, before)
    assert after.reading == Reading(fps=25.0, up="z")
    assert after.person == Person(betas=(1.0,), height_m=1.8)
    assert (after.plan, after.seed) == (before.plan, 3)


FILMED = Reading(camera="lens.toml", camera_name="left", size_px=(640, 480), ignore=("joints",))
BLIND = Reading(unknown_camera=True, keypoints="points.json", keypoints_person="2")


@pytest.mark.parametrize(
    ("before", "words", "after"),
    [
        (FILMED, ["--fov", "50"], Reading(fov_deg=50.0, size_px=(640, 480), ignore=("joints",))),
        (FILMED, ["--camera", "b.toml"], replace(FILMED, camera="b.toml", camera_name=None)),
        (FILMED, ["--unknown-camera", "--forget", "ignore,size"], Reading(unknown_camera=True)),
        (FILMED, ["--forget", "camera,size_px"], Reading(ignore=("joints",))),
        (FILMED, ["--forget", "ignore", "--ignore", "keypoints"], replace(FILMED, ignore=("keypoints",))),
        (BLIND, ["--fov", "50"], replace(BLIND, unknown_camera=False, fov_deg=50.0)),
        (BLIND, ["--keypoints", "b.json"], Reading(unknown_camera=True, keypoints="b.json")),
        (BLIND, ["--forget", "keypoints,unknown-camera"], Reading()),
    ],
)
@pytest.mark.parametrize("command", [["rerun", "out"], ["run", "--job", "job.toml"]])
def test_what_is_newly_given_replaces_what_excludes_it(
    before: Reading, words: list[str], after: Reading, command: list[str]
) -> None:
    parsed = cli._parser().parse_args([*command, *words])
    job = options.apply(parsed, Job("clip.npz", "out", reading=before, detected="kept.npz"))
    assert job.reading == after
    assert (job.detected is None) == (words[:2] != ["--forget", "ignore"])


def test_options_that_are_newly_given_both_are_refused_later() -> None:
    parsed = cli._parser().parse_args(["rerun", "out", "--fov", "50", "--camera", "lens.toml"])
    reading = options.apply(parsed, Job("clip.npz", "out")).reading
    assert (reading.fov_deg, reading.camera) == (50.0, "lens.toml")


def test_only_options_of_an_earlier_job_are_forgotten(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["rerun", "out", "--forget", "ignor"]) == 2
    assert "found 'ignor', did you mean 'ignore'?; valid: " in capsys.readouterr().err
    assert cli.main(["run", "clip.npz", "-o", "out", "--forget", "ignore"]) == 2
    assert "--forget: found no --job" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [(["--up", "-y"], "up", "-y"), (["--betas", "-1,2"], "betas", (-1.0, 2.0)), (["--up", "y"], "up", "y")],
)
def test_a_value_may_begin_with_a_dash(words: list[str], name: str, value: Any) -> None:
    parsed = cli._parser().parse_args(options.joined(["run", "clip.npz", "-o", "out", *words]))
    assert getattr(parsed, name) == value
    with pytest.raises(InputError, match="--up"):
        cli._parser().parse_args(options.joined(["run", "clip.npz", "--up", "-o", "out"]))


def test_what_a_command_recalls_is_as_before() -> None:
    again, moved = flags("rerun"), flags("retarget")
    for flag in ("--plan", "--scene", "--planner", "--seed", "--video", "--fps", "--up"):
        assert str(again[flag].help).endswith(" [as before]"), flag
    assert str(moved["--scene"].help).endswith(" [as before]")
    assert str(moved["--seed"].help).endswith(" [0]")
    assert str(flags("run")["--seed"].help).endswith(" [0]")
