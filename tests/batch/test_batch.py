"""`simrecon batch` end to end on a local cluster; what needs no dask is in the other files."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from simrecon import cli
from simrecon.batch import cluster, journal
from simrecon.cli.batch import until
from simrecon.errors import InputError

CHECKOUT = Path(__file__).resolve().parents[2]


@pytest.fixture
def dask() -> None:
    """Skips where the extra is not installed."""
    pytest.importorskip("distributed", reason="needs dask.distributed: install the extra batch")


def events(folder: Path, kind: str) -> list[dict[str, Any]]:
    return [event for event in journal.read_events(folder / "batch.jsonl") if event["event"] == kind]


@pytest.fixture(scope="module")
def night(inputs: Path, plan: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a batch of two clips and a broken one."""
    pytest.importorskip("distributed", reason="needs dask.distributed: install the extra batch")
    folder = tmp_path_factory.mktemp("night") / "out"
    assert cli.main(["batch", str(inputs), "-o", str(folder), "--plan", plan, "--jobs", "2"]) == 3
    return folder


def test_good_clips_are_results_and_a_broken_one_is_an_error(
    night: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two"):
        assert (night / name / "motion.npz").is_file()
    report = json.loads((night / "broken" / "report.json").read_text(encoding="utf-8"))
    assert report["error"]["kind"] == "input"
    assert "broken.npz" in report["error"]["message"]
    assert "failed" in (night / ".batch" / "logs" / "broken.log").read_text(encoding="utf-8")
    assert cli.main(["batch", "status", str(night)]) == 0
    shown = capsys.readouterr().out
    assert "3 clips: 2 done, 0 running, 0 waiting, 1 failed" in shown
    assert cli.main(["batch", "status", str(night), "--json"]) == 0
    state = json.loads(capsys.readouterr().out)
    assert {row["name"]: row["state"] for row in state["clips"]} == {
        "one": "done", "two": "done", "broken": "failed",
    }  # fmt: skip
    assert state["alive"] is False


def test_the_report_can_be_written_again(night: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = (night / "index.html").read_text(encoding="utf-8")
    (night / "index.html").unlink()
    assert cli.main(["batch", "report", str(night)]) == 0
    assert capsys.readouterr().out.strip() == str(night / "index.html")
    assert (night / "index.html").read_text(encoding="utf-8") == page


def test_again_it_does_only_what_is_missing_or_has_changed(
    night: Path, inputs: Path, plan: str, tmp_path: Path
) -> None:
    out, given = tmp_path / "out", tmp_path / "in"
    shutil.copytree(night, out)
    shutil.copytree(inputs, given)
    (given / "broken.npz").unlink()
    before = {name: (out / name / "motion.npz").stat().st_mtime_ns for name in ("one", "two")}
    shutil.copy(given / "one.npz", given / "broken.npz")  # somebody mended it
    shutil.copy(given / "one.npz", given / "two.npz")  # and changed another
    command = ["batch", str(given), "-o", str(out), "--plan", plan]
    assert cli.main(command) == 0
    assert events(out, "end")[-1] | {"kept": 1, "done": 2, "failed": 0} == events(out, "end")[-1]
    after = {name: (out / name / "motion.npz").stat().st_mtime_ns for name in ("one", "two")}
    assert after["one"] == before["one"]
    assert after["two"] != before["two"]
    same = [(out / name / "motion.npz").read_bytes() for name in ("one", "two", "broken")]
    assert same[0] == same[1] == same[2]
    assert cli.main([*command, "--force"]) == 0
    assert events(out, "end")[-1]["done"] == 3


@pytest.mark.usefixtures("dask")
def test_a_dry_run_says_what_it_costs_and_writes_nothing(
    inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["batch", str(inputs), "-o", str(out), "--plan", plan, "--dry-run"]
    assert cli.main([*command, "--json"]) == 3  # as the batch will end: one of its clips is bad
    said = json.loads(capsys.readouterr().out)
    assert not out.exists()
    assert list(said["failed"]) == ["broken"]
    assert said["video_s"] == pytest.approx(2 * 25 / 60, rel=0.02)
    assert said["seconds"][plan] > 0
    assert 0 < said["wall_s"] < 120
    assert said["size_bytes"] > 10_000


@pytest.mark.usefixtures("dask")
def test_a_dry_run_of_good_clips_ends_well_and_one_of_bad_clips_does_not(
    inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, status, said in (("one", 0, "1 to do"), ("broken", 3, "bad       broken: ")):
        command = ["batch", str(inputs / f"{name}.npz"), "-o", str(tmp_path / "out"), "--plan", plan]
        assert cli.main([*command, "--dry-run"]) == status
        assert said in capsys.readouterr().out
    assert not (tmp_path / "out").exists()


def start(inputs: Path, plan: str, out: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "simrecon", "batch", str(inputs), "-o", str(out), "--plan", plan, *more]
    return subprocess.Popen(
        command, cwd=CHECKOUT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def wait_for(out: Path, kind: str) -> dict[str, Any]:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        if (out / "batch.jsonl").is_file() and (found := events(out, kind)):
            return found[-1]
        time.sleep(0.02)
    raise AssertionError(f"no event {kind}")


def told(port: int) -> bool:
    """Whether a port gives a page of what runs to whoever asks."""
    for page in ("/info/main/workers.html", "/json/counts.json", "/metrics", "/health"):
        asked = http.client.HTTPConnection("127.0.0.1", port, timeout=2)
        with contextlib.closing(asked), contextlib.suppress(OSError, http.client.HTTPException):
            asked.request("GET", page)
            if asked.getresponse().status == 200:
                return True
    return False


@pytest.mark.usefixtures("dask")
def test_only_loopback_listens_and_a_second_batch_is_refused(
    inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    psutil = pytest.importorskip("psutil", reason="comes with dask.distributed")
    process = start(inputs, plan, tmp_path / "out")
    try:
        wait_for(tmp_path / "out", "started")
        assert cli.main(["batch", str(inputs), "-o", str(tmp_path / "out"), "--plan", plan]) == 2
        assert "another batch at work" in capsys.readouterr().err
        family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
        listening = {
            where.laddr for one in family for where in one.net_connections() if where.status == "LISTEN"
        }
        assert {where.ip for where in listening} == {"127.0.0.1"}
        assert not any(told(where.port) for where in listening)
    finally:
        process.send_signal(signal.SIGTERM)
        said = process.communicate(timeout=60)[0]
    assert process.returncode == 130
    assert "the same command goes on (interrupted)" in said


def test_a_killed_worker_costs_nothing_but_time(night: Path, inputs: Path, plan: str, tmp_path: Path) -> None:
    psutil = pytest.importorskip("psutil", reason="comes with dask.distributed")
    out = tmp_path / "out"
    process = start(inputs, plan, out, "--jobs", "1")
    wait_for(out, "window")
    (worker,) = [
        child for child in psutil.Process(process.pid).children() if "spawn_main" in " ".join(child.cmdline())
    ]
    os.kill(worker.pid, signal.SIGKILL)
    said = process.communicate(timeout=120)[0]
    assert process.returncode == 3, said
    assert len(events(out, "retry")) == 1
    assert any(event["window"] > 0 for event in events(out, "started"))
    for name in ("one", "two"):
        assert (out / name / "motion.npz").read_bytes() == (night / name / "motion.npz").read_bytes()


def test_a_killed_batch_goes_on(night: Path, inputs: Path, plan: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = start(inputs, plan, out, "--jobs", "1")
    wait_for(out, "window")
    process.kill()
    process.communicate(timeout=60)
    assert cli.main(["batch", str(inputs), "-o", str(out), "--plan", plan]) == 3
    assert any(event["window"] > 0 for event in events(out, "started"))
    for name in ("one", "two"):
        assert (out / name / "motion.npz").read_bytes() == (night / name / "motion.npz").read_bytes()


def test_a_running_cluster_does_the_same(
    night: Path, inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    distributed = pytest.importorskip("distributed", reason="needs dask.distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        command = ["batch", str(inputs), "-o", str(tmp_path / "out"), "--plan", plan]
        assert cli.main([*command, "--scheduler", cluster.scheduler_address]) == 3
    for name in ("one", "two"):
        there = (tmp_path / "out" / name / "motion.npz").read_bytes()
        assert there == (night / name / "motion.npz").read_bytes()
    capsys.readouterr()


@pytest.mark.usefixtures("dask")
def test_a_scheduler_that_is_not_there(
    inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("simrecon.batch.connection.CONNECT_S", 0.5)
    command = ["batch", str(inputs), "-o", str(tmp_path / "out"), "--plan", plan]
    assert cli.main([*command, "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "does not answer" in capsys.readouterr().err


def test_without_dask_it_says_what_to_install(
    inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert cli.main(["batch", str(inputs), "-o", str(tmp_path / "out"), "--plan", plan]) == 2
    said = capsys.readouterr().err
    install = "python -m pip install '.[batch]' in simrecon's source folder"
    assert said == f"simrecon: error: batch needs distributed: {install}\n"
    assert not (tmp_path / "out").exists()


def test_until_is_the_next_such_time() -> None:
    now = time.mktime((2026, 11, 22, 22, 30, 0, 0, 0, -1))
    assert until("23:15", now) - now == 45 * 60
    assert until("07:00", now) - now == 8.5 * 3600
    assert until("22:30", now) - now == 24 * 3600
    for text in ("7", "24:00", "07:60", "morning"):
        with pytest.raises(InputError, match="valid: a time such as 07:00"):
            until(text, now)


@pytest.mark.usefixtures("dask")
def test_it_ends_in_time_and_keeps_what_is_solved(
    inputs: Path, plan: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    out, slow = tmp_path / "out", tmp_path / "slow.toml"
    text = Path(plan).read_text(encoding="utf-8").replace("population = 12", "population = 60")
    slow.write_text(text.replace("generations = 12", "generations = 40"), encoding="utf-8")
    command = ["batch", str(inputs / "one.npz"), str(inputs / "two.npz"), "-o", str(out), "--plan", str(slow)]
    clock, late = time.time, threading.Event()
    far_s = 1e6
    monkeypatch.setattr("simrecon.cli.batch.until", lambda _text, now_s: now_s + far_s)
    monkeypatch.setattr("simrecon.batch.runner.time.time", lambda: clock() + far_s * late.is_set())

    def watcher() -> None:
        wait_for(out, "window")
        late.set()

    watch = threading.Thread(target=watcher)
    watch.start()
    status = cli.main([*command, "--until", "07:00", "--jobs", "1"])
    watch.join()
    assert status == 3
    assert "left      " in capsys.readouterr().out
    end = events(out, "end")[-1]
    assert (end["done"], end["left"]) == (0, 2)
    assert end["reason"].startswith("stopped at")
    assert list(out.glob(".batch/checkpoints/*/*/*/window_00000.npz"))


def test_freed_cores_go_to_the_clip_that_still_runs() -> None:
    """Two cores: one thread each for two clips, both for the last one, one each while others wait."""

    class Client:
        def __init__(self) -> None:
            self.orders: list[tuple[str, dict[str, int]]] = []

        def subscribe_topic(self, *_: object) -> None:
            """Nobody tells anything here."""

        def run(self, _function: object, threads: dict[str, int], _stop: bool, **how: Any) -> None:
            self.orders += [(worker, threads) for worker in how["workers"]]

    client = Client()
    crew = cluster.Crew(client, "topic", cores=2)
    a, b = {"worker": "A", "cores": 1}, {"worker": "B", "cores": 1}
    crew.share({"a": a}, waiting=3, jobs=2)
    crew.share({"a": a, "b": b}, waiting=3, jobs=2)
    crew.share({"b": b}, waiting=1, jobs=2)
    assert client.orders == [("A", {"a": 1}), ("B", {"b": 1})]
    crew.share({"b": b}, waiting=0, jobs=2)
    assert client.orders[2:] == [("B", {"b": 2})]
    of_its_own = cluster.Crew(Client(), "topic", cores=None)
    of_its_own.share({"a": {"worker": "A", "cores": 8}, "b": {"worker": "A", "cores": 8}}, waiting=0, jobs=9)
    assert of_its_own._client.orders == [("A", {"a": 4}), ("A", {"b": 4})]
