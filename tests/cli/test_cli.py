"""The command line end to end, on the first third of a second of the example."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import simrecon
from simrecon import cli, evidence, metrics, replay, resources, results
from simrecon.engines.sampling.sampler import Sampler
from simrecon.evaluation import scores
from simrecon.evidence import sides
from simrecon.job import Job
from simrecon.job import inputs as inputs_of_jobs
from simrecon.metrics.definitions import DEFINITIONS
from simrecon.results import folder
from simrecon.sim.quiet import unwarned
from simrecon.types import Evidence, Window, WindowResult, WindowStatus
from tests.support import plan_text

EXAMPLE = resources.folder("example")
FRAMES = 20
FAST = {
    "population": 6, "generations": 2, "length_s": 0.2, "overlap_s": 0.1, "evaluations": 40,
    "timestep_max_s": 0.017,
}  # fmt: skip


def first_frames(given: Evidence, count: int) -> Evidence:
    return replace(evidence.cut(given, slice(count)), part=None)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `clip.npz` and `plan.toml`."""
    folder = tmp_path_factory.mktemp("inputs")
    evidence.write(folder / "clip.npz", first_frames(evidence.read(EXAMPLE / "beam.npz"), FRAMES))
    (folder / "plan.toml").write_text(plan_text.quick(FAST), encoding="utf-8")
    return folder


def arguments(inputs: Path, out: Path, *more: str) -> list[str]:
    plan, scene = str(inputs / "plan.toml"), str(EXAMPLE / "beam.toml")
    return ["run", str(inputs / "clip.npz"), "-o", str(out), "--plan", plan, "--scene", scene, *more]


@pytest.fixture(scope="module")
def result(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished result."""
    out = tmp_path_factory.mktemp("out") / "result"
    assert cli.main(arguments(inputs, out, "--threads", "1")) == 0
    return out


def said(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / results.folder.REPORT).read_text(encoding="utf-8"))
    return found


def test_run_writes_a_result_and_says_what(
    inputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, video = tmp_path / "new" / "result", str(EXAMPLE / "beam.mp4")
    person = ("--height-m", "1.75", "--mass-kg", "70")
    assert cli.main(arguments(inputs, out, "--video", video, "--seed", "3", *person)) == 0
    shown = capsys.readouterr()
    files = sorted(path.name for path in out.iterdir())
    assert files == [
        "job.toml", "model.xml", "motion.npz", "overlay.mp4", "report.html", "report.json", "scene.toml",
    ]  # fmt: skip
    assert json.loads((out / "report.json").read_text())["page"] is None
    lines = dict(line.split(maxsplit=1) for line in shown.out.splitlines())
    assert lines["person"] == "1.75 m, as given; 70 kg, as given"
    assert lines["lens"].startswith("36° across the image, as given by the input; camera 1.")
    assert lines["floor"] == "at 0.00 m, as given"
    assert re.fullmatch(
        r"body and landmarks are \d+ px apart on average, .* % of the person's .*", lines["image"]
    )
    assert re.fullmatch(r"the simulation is \d+ mm from the kinematic fit on average", lines["motion"])
    assert lines["verdict"] in ("good", "doubtful", "bad")
    assert lines["frames"] == f"{FRAMES} of {FRAMES} simulated"
    assert re.fullmatch(r"[\d.]+, mean of the windows", lines["loss"])
    assert re.fullmatch(r"[\d.]+ s, [\d.]+ s per second of video", lines["time"])
    assert lines["written"] == f"{out}: {', '.join(files)}"
    stages = [line.split("  ")[0] for line in shown.err.splitlines()]
    assert stages == ["kinematic fit 100%", "simulation 100%"]
    found = said(out)
    assert (found["seed"], found["plan_name"]) == (3, str(inputs / "plan.toml"))
    assert found["input"]["name"] == str(inputs / "clip.npz")
    assert (found["person"]["height_m"], found["person"]["mass_kg"]) == (1.75, 70)


def test_sides_that_were_mixed_up_are_said(
    inputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = evidence.read(inputs / "clip.npz")
    joints, index = given.joints_m.copy(), sides.pairs(given.joint_names, "legs")
    joints[8:11, index.ravel()] = given.joints_m[8:11, index[:, ::-1].ravel()]
    (tmp_path / "plan.toml").write_bytes((inputs / "plan.toml").read_bytes())
    evidence.write(tmp_path / "clip.npz", replace(given, joints_m=joints))
    assert cli.main(arguments(tmp_path, tmp_path / "out")) == 0
    lines = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert lines["sides"] == "left and right were mixed up, and exchanged: legs 3D in frames 8-10"
    assert said(tmp_path / "out")["input"]["exchanged"] == {"legs 3D": [8, 9, 10]}


def test_a_part_of_a_clip_is_drawn_and_scored_where_it_is(
    inputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, video = tmp_path / "part", str(EXAMPLE / "beam.mp4")
    words = arguments(inputs, out, "--video", video, "--from", "0.5", "--to", "0.9", "--every", "2")
    words[1] = str(EXAMPLE / "beam.npz")
    assert cli.main(words) == 0
    lines = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert lines["part"] == "0.50 to 0.90 s: frames 30 to 54 of 100, one of 2"
    part = {"from_s": 0.5, "to_s": 0.9, "first_frame": 30, "every": 2, "source_frames": 100}
    assert said(out)["input"]["part"] == pytest.approx(part)
    motion = results.read_motion(out)
    np.testing.assert_allclose(motion.times_s, np.arange(30, 55, 2) / 60)
    assert "from_s = 0.5" in (out / "job.toml").read_text()
    joints = motion.joints_m.copy()
    np.savez(
        tmp_path / "truth.npz",
        schema="simrecon.truth/1",
        times_s=motion.times_s,
        joint_names=np.array(motion.joint_names),
        joints_m=joints,
    )
    for more in ([], ["--from", "0.6", "--to", "0.8"]):
        assert cli.main(["eval", str(out), str(tmp_path / "truth.npz"), "--json", *more]) == 0
        scored = json.loads(capsys.readouterr().out)
        assert "mpjpe_g_mm" in json.dumps(scored)


def test_the_result_replays_in_plain_mujoco(result: Path) -> None:
    motion = results.read_motion(result)
    model = mujoco.MjModel.from_xml_path(str(result / "model.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, motion.state0, mujoco.mjtState.mjSTATE_INTEGRATION)
    qpos = [data.qpos.copy()]
    for ctrl in motion.ctrl:
        data.ctrl[:] = ctrl
        mujoco.mj_step(model, data)
        qpos.append(data.qpos.copy())
    np.testing.assert_array_equal(motion.qpos, np.array(qpos)[motion.frame_step])


def test_two_threads_make_the_same_bits(inputs: Path, result: Path, tmp_path: Path) -> None:
    assert cli.main(arguments(inputs, tmp_path / "b", "--threads", "2")) == 0
    assert (tmp_path / "b" / "motion.npz").read_bytes() == (result / "motion.npz").read_bytes()


def failing_from_the_second_window(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = Sampler.solve

    def failing(self: Sampler, window: Window, *rest: Any) -> WindowResult:
        found = solve(self, window, *rest)
        return replace(found, status=WindowStatus.FAILED) if window.index else found

    monkeypatch.setattr(Sampler, "solve", failing)


def test_fallback_is_said_and_exits_with_3(
    inputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    failing_from_the_second_window(monkeypatch)
    assert cli.main(arguments(inputs, tmp_path / "out")) == 3
    fallback = int((results.read_motion(tmp_path / "out").status == replay.FALLBACK).sum())
    assert 0 < fallback < FRAMES
    expected = f"{FRAMES - fallback} of {FRAMES} simulated, {fallback} on kinematic fallback"
    shown = capsys.readouterr().out
    assert expected in shown
    times = results.read_motion(tmp_path / "out").times_s
    assert f"gaps     {times[-fallback]:.2f} to {times[-1]:.2f} s: fell" in shown
    assert re.search(r"verdict +bad\n +\d+ frames of 20 are not simulated, .*: check scene and height", shown)


def raising(error: BaseException) -> Callable[..., WindowResult]:
    def solve(*_: Any) -> WindowResult:
        raise error

    return solve


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (KeyboardInterrupt(), 130, "simrecon: interrupted, nothing was written"),
        (ValueError("two\nlines"), 1, "simrecon: error: ValueError: two lines; --debug shows where"),
    ],
)
def test_a_stopped_run_is_one_line_and_leaves_nothing(
    inputs: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    status: int,
    line: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Sampler, "solve", raising(error))
    assert cli.main(arguments(inputs, tmp_path / "out")) == status
    shown = capsys.readouterr()
    assert shown.out == ""
    progress, *rest = shown.err.splitlines()
    assert progress.startswith("kinematic fit 100%")
    assert rest == [line]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("place", [0, -1])
def test_debug_adds_the_traceback(place: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["run", "nowhere.npz", "-o", str(tmp_path / "out")]
    given.insert(place if place == 0 else len(given), "--debug")
    assert cli.main(given) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert lines[-1].startswith("simrecon: error: nowhere.npz: ")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_bar_on_a_terminal(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr("simrecon.system.progress._TERMINAL_INTERVAL_S", 0.0)
    assert cli.main(arguments(inputs, tmp_path / "out")) == 0
    simulation = terminal.getvalue().split("\n")[1]
    assert re.search(r"\r.*█░.* simulation +\d\d%  [\d.]+ s left", simulation)
    assert re.search(r"simulation 100%  done in [\d.]+ s$", simulation)


def test_an_error_on_a_terminal_has_a_line_of_its_own(
    inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr(Sampler, "solve", raising(KeyboardInterrupt()))
    assert cli.main(arguments(inputs, tmp_path / "out")) == 130
    assert terminal.getvalue().splitlines()[-1] == "simrecon: interrupted, nothing was written"


def test_the_simulators_own_warnings_are_off_only_meanwhile(capfd: pytest.CaptureFixture[str]) -> None:
    before = mujoco.get_mju_user_warning()
    with unwarned():
        mujoco.get_mju_user_warning()("unstable")
    assert mujoco.get_mju_user_warning() is before
    assert capfd.readouterr() == ("", "")


def test_names_in_any_case(inputs: Path, tmp_path: Path) -> None:
    given = evidence.read(inputs / "clip.npz")
    other = {"left_hip": "LHip", "right_hip": "RHip", "nose": "Nose"}
    renamed = tuple(other.get(name, name) for name in given.keypoint_names)
    evidence.write(tmp_path / "clip.npz", replace(given, keypoint_names=renamed))
    seen = inputs_of_jobs.observe(Job(str(tmp_path / "clip.npz"), "out"))
    assert seen.keypoint_names == renamed


def write_truth(path: Path, folder: Path, shift_m: float) -> None:
    motion = results.read_motion(folder)
    np.savez(
        path,
        schema=metrics.TRUTH_SCHEMA,
        times_s=motion.times_s,
        joint_names=motion.joint_names,
        joints_m=motion.joints_m + np.array([shift_m, 0, 0]),
    )


def test_eval_prints_every_score_with_its_definition(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_truth(tmp_path / "truth.npz", result, 0.05)
    motion = results.read_motion(result)
    world = Evidence(
        times_s=motion.times_s,
        keypoint_names=(),
        keypoints_px=np.empty((FRAMES, 0, 2)),
        scores=np.empty((FRAMES, 0)),
        joint_names=motion.joint_names,
        joints_m=motion.joints_m + np.array([0.03, 0, 0]),
        joints_frame="world",
    )
    evidence.write(tmp_path / "world.npz", world)
    given = ["eval", str(result), str(tmp_path / "truth.npz"), str(tmp_path / "world.npz")]
    assert cli.main(given) == 0
    shown = capsys.readouterr().out
    assert shown.splitlines()[0].split() == ["result", "kinematic", "plan", "input", "reference", "[result]"]
    (row,) = re.findall(r"^mpjpe_g_mm +(\S+) +\S+ +\S+ +(\S+) +- +(\[.*\])  (.*)$", shown, flags=re.M)
    assert row == ("50", "20", "[50, 50]", DEFINITIONS["mpjpe_g_mm"])
    assert "seed 0" in shown.splitlines()[-1]
    options = [*given[:3], "--input", given[3], "-o", str(tmp_path / "scores.json"), "--json"]
    assert cli.main(options) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["result"]["mpjpe_g_mm"] == pytest.approx(50)
    assert found["result"]["mpjpe_mm"] == pytest.approx(0, abs=1e-9)
    assert found["input"]["mpjpe_g_mm"] == pytest.approx(20)
    assert found["intervals"]["result"]["mpjpe_g_mm"] == pytest.approx([50, 50])
    assert json.loads((tmp_path / "scores.json").read_text()) == found
    own = said(result)["metrics"]
    for ours, theirs in (
        ("footskate_gartner_pct", "footskate_pct"),
        ("float_gartner_pct", "float_pct"),
        ("penetration_mean_mm", "penetration_mean_mm"),
        ("penetration_max_mm", "penetration_max_mm"),
        ("grf_vertical_mean_pct", "mean_grf_pct_bw"),
        ("mpjpe_2d_px", "mpjpe_2d_px"),
    ):
        assert found["result"][ours] == pytest.approx(own[theirs]), ours
    assert cli.main([*given, "--input", given[3]]) == 2
    assert "valid: one" in capsys.readouterr().err
    assert cli.main([*given, "--fps", "15", "--json"]) == 0
    assert "read as simrecon evidence: 15 Hz as given" in capsys.readouterr().err
    assert cli.main([*given[:3], "--fps", "15"]) == 2
    assert "--fps: found no EVIDENCE" in capsys.readouterr().err


def test_evidence_outside_the_world_has_scores_of_poses_only(
    inputs: Path, result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_truth(tmp_path / "truth.npz", result, 0.0)
    given = ["eval", str(result), str(tmp_path / "truth.npz"), str(inputs / "clip.npz")]
    assert cli.main(given) == 0
    shown = capsys.readouterr().out.splitlines()[0].split()
    assert shown == ["result", "kinematic", "plan", "input", "reference", "[result]"]


def test_every_score_has_a_definition(result: Path, tmp_path: Path) -> None:
    write_truth(tmp_path / "truth.npz", result, 0.01)
    with np.load(tmp_path / "truth.npz") as truth:
        frames = len(truth["times_s"])
        plates = {f"grf_{side}_N": np.ones((frames, 3)) for side in ("left", "right")}
        plates |= {f"cop_{side}_m": np.zeros((frames, 3)) for side in ("left", "right")}
        np.savez(tmp_path / "plates.npz", allow_pickle=False, **truth, **plates, mass_kg=60.0)
    table = scores.score(result, tmp_path / "plates.npz")
    shown = {name for name in table.values["result"] if not name.startswith("f1_")}
    assert shown <= set(DEFINITIONS)
    assert {"plate_vertical_mae_pct", "grf_vertical_mae_pct_bw", "covered", "residual_mean_pct"} <= shown
    assert said(result)["schema"] == folder.SCHEMA


def test_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"simrecon {simrecon.__version__}\n"
    for command in ("demo", "run", "eval", "bench"):
        assert cli.main(["-h"]) == 0
        assert command in capsys.readouterr().out
        assert cli.main([command, "-h"]) == 0
        assert f"usage: simrecon {command}" in capsys.readouterr().out


@pytest.mark.slow
def test_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    assert cli.main(["demo", "-o", str(out)]) == 0
    assert "100 of 100 simulated" in capsys.readouterr().out
    assert (out / "overlay.mp4").stat().st_size > 100_000
    found = said(out)
    assert found["audit"]["replay_exact"]
    assert found["audit"]["max_root_actuator_force_N"] == 0
    assert found["audit"]["max_applied_force_N"] == 0
    assert found["metrics"]["mpjpe_2d_px"] < 60
    np.testing.assert_array_less(0.5, results.read_motion(out).com_m[:, 2])
