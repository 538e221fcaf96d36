"""The result folder: replay from the files alone, all or nothing, and one line for what can't be used."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import plan as plans
from simrecon import replay, results
from simrecon import scene as scenes
from simrecon.cli import summary
from simrecon.drawing import overlay
from simrecon.errors import InputError, SimreconError
from simrecon.io import atomic
from simrecon.results import folder as folders
from simrecon.results import report as reports
from simrecon.types import Scene
from tests.support.runs import job_of


@pytest.fixture(scope="session")
def written(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results") / "below" / "squat"
    results.write(job_of(folder), run)
    return folder


def report(folder: Path) -> Any:
    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} is not JSON")

    return json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_plain_loop_replays_every_frame_to_the_last_bit_from_the_files_alone(written: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(written / "model.xml"))
    data = mujoco.MjData(model)
    with np.load(written / "motion.npz", allow_pickle=False) as motion:
        arrays = dict(motion)
    mujoco.mj_setState(model, data, arrays["state0"], mujoco.mjtState.mjSTATE_INTEGRATION)
    states = [(data.qpos.copy(), data.qvel.copy())]
    for ctrl in arrays["ctrl"]:
        data.ctrl[:] = ctrl
        mujoco.mj_step(model, data)
        states.append((data.qpos.copy(), data.qvel.copy()))
    assert len(arrays["frame_step"]) == 9
    assert arrays["frame_step"][-1] == len(arrays["ctrl"])
    for frame, step in enumerate(arrays["frame_step"]):
        assert (arrays["qpos"][frame] == states[step][0]).all()
        assert (arrays["qvel"][frame] == states[step][1]).all()


def test_what_is_read_is_what_was_written(written: Path, run: Any) -> None:
    motion = results.read_motion(written)
    for item in dataclasses.fields(motion):
        found, given = getattr(motion, item.name), getattr(run.motion, item.name)
        if isinstance(given, np.ndarray):
            assert np.array_equal(found, given, equal_nan=given.dtype.kind == "f"), item.name
            assert found.dtype == given.dtype, item.name
        else:
            assert found == given


def test_files(written: Path, run: Any) -> None:
    assert names(written) == [
        "job.toml",
        "model.xml",
        "motion.npz",
        "overlay.png",
        "report.json",
        "scene.toml",
    ]
    assert names(written.parent) == ["squat"]
    assert (written / "model.xml").read_text(encoding="utf-8") == run.problem.mjcf
    assert scenes.read(written / "scene.toml") == Scene()


def test_same_run_same_motion_file(written: Path, run: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "again"), run)
    first, second = ((place / "motion.npz").read_bytes() for place in (written, tmp_path / "again"))
    assert hashlib.sha256(first).digest() == hashlib.sha256(second).digest()


def test_nothing_simulated_is_written_and_read_too(run: Any, tmp_path: Path) -> None:
    motion, audit = replay.record(run.problem, run.fit, (), run.motion.times_s, np.delete(np.arange(10), 4))
    nothing = replace(run, windows=(), motion=motion, audit=audit)
    said = results.write(job_of(tmp_path / "out"), nothing).report
    assert results.read_motion(tmp_path / "out").ctrl.shape == (0, run.problem.model.nu)
    assert said["frames"]["fallback_frames"] == list(range(1, 9))
    assert (said["frames"]["simulated"], said["frames"]["fallback"]) == (1, 8)
    assert said["totals"]["stepping_share"] is None
    assert said["metrics"]["footskate_pct"] is None


# --- report


def test_report_says_where_it_came_from(written: Path, run: Any) -> None:
    said = report(written)
    assert said["schema"] == "simrecon.result/1"
    trusted = said["input"].pop("trust")
    nothing: dict[str, Any] = {"reading": None, "part": None, "exchanged": {}}
    assert said["input"] == {"name": "squat.npz", "sha256": "0" * 64, **nothing}
    assert (trusted["source"], trusted["metric"]) == ("world", False)
    assert (said["plan_name"], said["seed"], said["threads"]) == ("quick", 3, 1)
    assert said["plan"] == plans.to_dict(run.problem.plan)
    assert set(said["versions"]) == {"simrecon", "python", "mujoco", "numpy", "scipy", "nlopt", "opencv"}
    assert said["versions"]["mujoco"] == mujoco.__version__
    assert all(said["versions"].values())


def test_report_has_every_window_and_their_sums(written: Path, run: Any) -> None:
    said = report(written)
    windows, totals = said["windows"], said["totals"]
    assert len(windows) == totals["windows"] == len(run.windows) >= 2
    assert windows[0]["start_s"] == 0
    assert all(a["commit_s"] == b["start_s"] for a, b in itertools.pairwise(windows))
    assert windows[-1]["commit_s"] == pytest.approx(0.3)
    for window in windows:
        assert window["loss"] == pytest.approx(sum(window["loss_terms"].values()))
        assert window["evaluations"] > 8 * window["generations"] + window["descent_steps"]
        assert window["status"] == "all generations used"
        assert 0 < window["stepping_s"] < window["seconds"]
    assert totals["rollouts"] == sum(window["evaluations"] for window in windows)
    assert totals["steps"] > totals["rollouts"]
    assert 0 < totals["stepping_share"] < 1
    assert set(totals["seconds"]) == {"kinematics", "simulation", "record", "overlay"}
    assert totals["wall_s"] == pytest.approx(sum(totals["seconds"].values()))
    assert totals["seconds_per_second"] == pytest.approx(totals["wall_s"] / 0.3)


def test_report_describes_person_fit_and_audit(written: Path, run: Any) -> None:
    said = report(written)
    assert said["person"]["mass_kg"] == 70.0
    assert said["person"]["lengths_m"] == bodies.measure_template(run.fit.body.skeleton)
    assert (said["person"]["betas"], said["person"]["shape_space"]) == ([], "")
    assert said["kinematics"]["iterations"] == run.fit.iterations > 0
    assert said["kinematics"]["loss_terms"] == run.fit.loss
    assert said["kinematics"]["reprojection_median_px"] == np.nanmedian(run.fit.reprojection_px)
    assert said["audit"] == dataclasses.asdict(run.audit)
    assert said["audit"]["replay_exact"] is True
    assert said["audit"]["max_root_actuator_force_N"] == said["audit"]["max_applied_force_N"] == 0


def test_report_has_what_a_skin_is_made_of(run: Any, tmp_path: Path) -> None:
    body = bodies.build(betas=np.array([1.0, -0.5]), mass_kg=70.0)
    shaped = replace(run, fit=replace(run.fit, body=body))
    person = reports.make(job_of(tmp_path), shaped, run.seconds)["person"]
    assert person["betas"] == [1.0, -0.5] + [0.0] * 8
    assert person["shape_space"] == "simrecon"


def test_report_scores_what_needs_no_reference(written: Path, run: Any) -> None:
    scores = report(written)["metrics"]
    assert set(scores) == {
        "footskate_pct",
        "float_pct",
        "penetration_mean_mm",
        "penetration_max_mm",
        "mean_grf_pct_bw",
        "mpjpe_2d_px",
    }
    weight = 70 * 9.81
    assert scores["mean_grf_pct_bw"] == pytest.approx(100 * run.motion.grf_N[:, 2].mean() / weight)
    # the simulation stays near the fit, and that near the landmarks (600 px at 4 m: 1 px = 6.7 mm)
    assert 0.1 < scores["mpjpe_2d_px"] < 15


def test_report_lists_frames_out_of_view_by_the_evidence_s_own_index(run: Any, tmp_path: Path) -> None:
    unseen = np.zeros(10, dtype=bool)
    unseen[[2, 4, 6]] = True  # the clip has no frame 4, so that frame 6 is its fifth from 0
    said = results.write(
        job_of(tmp_path / "out"), replace(run, fit=replace(run.fit, interpolated=unseen))
    ).report
    assert said["frames"]["interpolated_frames"] == [2, 5]
    assert said["frames"]["interpolated"] == 2
    assert (said["frames"]["count"], said["frames"]["simulated"]) == (9, 9)


def test_report_has_no_number_for_what_is_not_known(run: Any, tmp_path: Path) -> None:
    blind = replace(
        run.evidence,
        keypoint_names=(),
        keypoints_px=np.empty((9, 0, 2)),
        scores=np.empty((9, 0)),
        camera=None,
    )
    fit = replace(run.fit, camera=None, reprojection_px=np.empty((10, 0)), loss={"limit": np.nan})
    results.write(job_of(tmp_path / "out"), replace(run, evidence=blind, fit=fit))
    said = report(tmp_path / "out")
    assert said["metrics"]["mpjpe_2d_px"] is None
    assert said["kinematics"]["reprojection_median_px"] is None
    assert said["kinematics"]["loss_terms"] == {"limit": None}


# --- all or nothing


def test_a_picture_that_fails_costs_a_line(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(folder: Path, *_: object) -> Path:
        (folder / "overlay.mp4").write_bytes(b"half of it")
        raise MemoryError

    monkeypatch.setattr(overlay, "write", fail)
    results.write(job_of(tmp_path / "out"), run)
    assert names(tmp_path / "out") == ["job.toml", "model.xml", "motion.npz", "report.json", "scene.toml"]
    assert report(tmp_path / "out")["overlay"] == "MemoryError"


def test_the_motion_is_there_before_anything_is_drawn(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever ends the process while it draws: the result is in its place by then, and says so."""

    def killed(folder: Path, *_: object) -> Path:
        assert folder == tmp_path / "out"
        assert results.read_motion(folder).qpos.shape == run.motion.qpos.shape
        assert "the run ended while it was drawn" in report(folder)["overlay"]
        (folder / "overlay.mp4").write_bytes(b"half of it")
        raise KeyboardInterrupt

    monkeypatch.setattr(overlay, "write", killed)
    with pytest.raises(KeyboardInterrupt, match="out is whole but for its picture"):
        results.write(job_of(tmp_path / "out"), run)
    kept = results.open_result(tmp_path / "out")
    assert kept.report["frames"]["count"] == len(run.motion.times_s)
    assert names(tmp_path / "out") == ["job.toml", "model.xml", "motion.npz", "report.json", "scene.toml"]


def test_failure_leaves_nothing(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> Any:
        raise InputError("no such thing")

    monkeypatch.setattr(scenes, "dumps", fail)
    with pytest.raises(InputError, match="no such thing"):
        results.write(job_of(tmp_path / "new" / "out"), run)
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ValueError("odd"), "ValueError: odd; the motion is kept in"),
        (SimreconError("no such thing"), "out: no such thing; the motion is kept in"),
        (OSError(28, "No space left on device"), "No space left on device.*; the result is kept in"),
    ],
)
def test_a_motion_whose_last_file_fails_is_kept(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, message: str
) -> None:
    def fail(*_: object) -> Any:
        raise error

    monkeypatch.setattr(reports, "make", fail)
    with pytest.raises(SimreconError, match=message) as caught:
        results.write(job_of(tmp_path / "out"), run)
    kept = Path(str(caught.value).rsplit(" is kept in ", 1)[1])
    assert results.read_motion(kept).times_s.tolist() == run.motion.times_s.tolist()
    assert (kept / "model.xml").is_file()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("error", [ValueError("odd"), SimreconError("no"), OSError(28, "No space left")])
def test_a_motion_that_is_kept_elsewhere_leaves_nothing(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(*_: object) -> Any:
        raise error

    for module, name in ((reports, "make"), (Path, "rename")):  # without its report, and but for its place
        with monkeypatch.context() as patch:
            patch.setattr(module, name, fail)
            with pytest.raises(Exception, match=str(error.args[-1])) as caught:
                results.write(job_of(tmp_path / "new" / "out"), run, keep=False)
        assert " is kept in " not in str(caught.value)
        assert names(tmp_path) == []


def test_an_interrupted_write_leaves_nothing(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(reports, "make", stop)
    with pytest.raises(KeyboardInterrupt):
        results.write(job_of(tmp_path / "out"), run)
    assert names(tmp_path) == []


def test_landmarks_that_cannot_be_kept_cost_a_line(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    landmarks = tmp_path / "found.npz"
    landmarks.write_bytes(b"landmarks")
    write_bytes = atomic.write_bytes

    def fail(path: Any, content: bytes, **how: Any) -> None:
        if str(path).endswith(".evidence.npz"):
            raise OSError(13, "Permission denied")
        write_bytes(path, content, **how)

    monkeypatch.setattr(atomic, "write_bytes", fail)
    out = tmp_path / "out"
    written = results.write(job_of(out, detected=str(landmarks)), run, landmarks=landmarks)
    assert written.report["landmarks"] == f"{out}.evidence.npz: Permission denied"
    assert written.job.detected is None
    assert "could not be kept" in summary.of(written)


def test_a_result_that_only_lacks_its_place_is_kept(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    results.write(job_of(out), run)
    before = (out / "report.json").read_bytes()
    rename = Path.rename

    def fail(path: Path, target: Path) -> Path:
        if path.suffix == ".partial":
            raise OSError(28, "No space left on device")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", fail)
    with pytest.raises(InputError, match=r"out: cannot be written \(No space left on device\)") as caught:
        results.write(job_of(out), run)
    assert (out / "report.json").read_bytes() == before
    kept = Path(str(caught.value).rsplit("the result is kept in ", 1)[1])
    assert results.read_motion(kept).times_s.tolist() == run.motion.times_s.tolist()


def test_earlier_result_is_replaced(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    results.write(job_of(out), run)
    (out / "overlay.mp4").write_bytes(b"of a run with a video")
    results.write(job_of(out, seed=4), run)
    assert report(out)["seed"] == 4
    assert "overlay.mp4" not in names(out)
    assert names(tmp_path) == ["out"]


def test_through_a_link_the_folder_behind_it_is_written(run: Any, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    results.write(job_of(tmp_path / "link"), run)
    assert (tmp_path / "link").is_symlink()
    assert "motion.npz" in names(tmp_path / "real")


def foreign_file(folder: Path) -> None:
    (folder / "thesis.tex").write_text("years of work", encoding="utf-8")


def foreign_report(folder: Path) -> None:
    (folder / "report.json").write_text('{"schema": "other/1"}', encoding="utf-8")


def no_json(folder: Path) -> None:
    (folder / "report.json").write_bytes(b"\xff\xfe{")


def only_a_model(folder: Path) -> None:
    (folder / "model.xml").write_text("<mujoco/>", encoding="utf-8")


@pytest.mark.parametrize("put", [foreign_file, foreign_report, no_json, only_a_model])
def test_a_folder_of_other_things_is_refused(put: Callable[[Path], None], run: Any, tmp_path: Path) -> None:
    put(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for use in (results.check_writable, lambda out: results.write(job_of(out), run)):
        with pytest.raises(InputError, match="valid: a new or empty folder, or an earlier result") as caught:
            use(tmp_path)
        assert "\n" not in str(caught.value)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_result_to_which_something_was_added_is_refused(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    results.write(job_of(out), run)
    (out / "notes.txt").write_text("look at frame 5", encoding="utf-8")
    with pytest.raises(InputError, match=r"notes\.txt"):
        results.check_writable(out)


def test_check_leaves_nothing_behind(tmp_path: Path) -> None:
    results.check_writable(tmp_path / "a" / "b")
    assert names(tmp_path) == []
    (tmp_path / "empty").mkdir()
    results.check_writable(tmp_path / "empty")
    assert names(tmp_path) == ["empty"]


def test_a_file_in_the_way_is_refused(tmp_path: Path) -> None:
    (tmp_path / "clip.npz").write_bytes(b"")
    with pytest.raises(InputError, match="found a file"):
        results.check_writable(tmp_path / "clip.npz")
    with pytest.raises(InputError, match="cannot be written"):
        results.check_writable(tmp_path / "clip.npz" / "out")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a file system that nobody can write to")
def test_a_place_without_permission_is_refused() -> None:
    with pytest.raises(InputError, match=r"^/proc/out: cannot be written \("):
        results.check_writable("/proc/out")


def test_a_mount_point_is_refused() -> None:
    with pytest.raises(InputError, match="mount point"):
        results.check_writable("/")


# --- reading


def changed(folder: Path, tmp_path: Path, **arrays: Any) -> Path:
    """A copy of the motion with other arrays, or without those that are None."""
    with np.load(folder / "motion.npz", allow_pickle=False) as motion:
        content = {**motion, **arrays}
    np.savez(tmp_path / "motion.npz", **{key: value for key, value in content.items() if value is not None})
    return tmp_path


@pytest.mark.parametrize(
    ("key", "change", "match"),
    [
        ("schema", lambda _: np.array("simrecon.result/9"), r"schema: found 'simrecon.result/9'; valid: '"),
        ("qpos", lambda _: None, r"qpos: found no such key"),
        ("qpos", lambda x: x[:-1], r"qpos: found shape"),
        ("qvel", lambda x: x * np.nan, r"qvel: found \d+ NaN"),
        ("ctrl", lambda x: x[:, :-1], r"ctrl: found shape"),
        (
            "times_s",
            lambda x: x[::-1],
            r"times_s: found [\d.]+ then [\d.]+ at frame 1; valid: increasing times",
        ),
        ("frame_step", lambda x: x + 1000, r"frame_step: found 1000 to \d+; valid: whole numbers from -1 to"),
        ("frame_step", lambda x: x - 1, r"frame_step: found steps that do not fit the status"),
        ("status", lambda x: x + 3, r"status: found 3 to 3; valid: whole numbers from 0 to 2"),
        ("status", lambda x: x + 2, r"frame_step: found steps that do not fit the status"),
        ("joints_m", lambda x: x[:, 1:], r"joints_m: found shape"),
        ("contact_body", lambda x: x[:-1], r"contact_force_N: found shape"),
    ],
)
def test_damaged_motion_is_one_clear_line(
    written: Path, tmp_path: Path, key: str, change: Callable[[Any], Any], match: str
) -> None:
    with np.load(written / "motion.npz", allow_pickle=False) as motion:
        value = change(motion[key])
    with pytest.raises(InputError, match=r"motion\.npz: " + match) as caught:
        results.read_motion(changed(written, tmp_path, **{key: value}))
    assert "\n" not in str(caught.value)


def test_no_result_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: found no such folder"):
        results.read_motion(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"motion\.npz: cannot be read"):
        results.read_motion(tmp_path)


# --- an independent check


def test_independent_evaluation_agrees(written: Path, run: Any, shared_data: Path, tmp_path: Path) -> None:
    script = shared_data.parent / "tools" / "evaluate.py"
    if not script.is_file():
        pytest.skip(f"no {script}")
    seen = run.evidence
    truth = tmp_path / "truth.npz"
    np.savez(truth, times_s=seen.times_s, joint_names=np.array(seen.joint_names), joints_m=seen.joints_m)
    done = subprocess.run(
        [sys.executable, str(script), str(written), str(truth)], capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    replay = found["replay"]
    assert replay["max_qpos_error"] == 0
    assert replay["max_force_on_root_from_actuators"] == 0
    assert replay["frames"] == 9
    assert replay["root_is_free"]
    assert replay["penetration_mean_mm"] == pytest.approx(run.audit.floor_penetration_mean_mm, abs=0.006)
    assert replay["penetration_max_mm"] == pytest.approx(run.audit.floor_penetration_max_mm, abs=0.006)
    assert found["result"]["mpjpe_g_mm"] < 100


def test_every_file_may_be_replaced(written: Path) -> None:
    assert set(names(written)) < set(folders.FILES)
