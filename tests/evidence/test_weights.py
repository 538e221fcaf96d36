from __future__ import annotations

import gzip
import hashlib
import io
import os
import stat
import sys
import tarfile
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from simrecon import cli
from simrecon.errors import InputError, SimreconError
from simrecon.evidence.video import fetching, weights

CONTENT = {name: f"weights of {name}".encode() for name in ("detector", "heavy", "full", "lite")}


def table(**changed: bytes) -> tuple[weights.Weights, ...]:
    contents = CONTENT | changed
    return tuple(
        replace(one, sha256=(hashlib.sha256(contents[one.name]).hexdigest(),)) for one in weights.TABLE
    )


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, small weights, and no package client."""
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(weights, "TABLE", table())
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    return tmp_path / "cache" / "weights"


def packed(kind: str) -> bytes:
    """The package of a client, with the small weights."""
    buffer = io.BytesIO()
    if kind == "npm":
        with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
            for one in weights.TABLE:
                assert one.npm is not None
                info = tarfile.TarInfo(one.npm)
                info.size = len(CONTENT[one.name])
                archive.addfile(info, io.BytesIO(CONTENT[one.name]))
    else:
        with zipfile.ZipFile(buffer, "w") as archive:
            for one in weights.TABLE:
                if one.pip is not None:
                    archive.writestr(one.pip, CONTENT[one.name])
    return buffer.getvalue()


def runner(log: list[Sequence[str]], *, fails: tuple[str, ...] = ()) -> fetching.Runner:
    """Stands for the clients: leaves what they would download."""

    def run(command: Sequence[str], cwd: Path) -> None:
        kind = "npm" if command[0] == "npm" else "pip"
        log.append(command)
        if kind in fails:
            raise SimreconError(f"{kind} failed: offline")
        (cwd / ("pose.tgz" if kind == "npm" else "mediapipe.whl")).write_bytes(packed(kind))

    return run


def executable(folder: Path, name: str, script: str) -> None:
    path = folder / name
    path.write_text(f"#!{sys.executable}\n{script}")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_cache_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert weights.cache_folder() == tmp_path / "cache"
    monkeypatch.delenv("SIMRECON_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert weights.cache_folder() == tmp_path / "xdg" / "simrecon"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # to be ignored, says the XDG specification
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert weights.cache_folder() == tmp_path / "home" / ".cache" / "simrecon"


def test_missing_weights_name_the_one_command(cache: Path) -> None:
    with pytest.raises(InputError, match=r"\(heavy\) are not there; fetch them: simrecon models fetch$"):
        weights.find("heavy")
    with pytest.raises(InputError, match=r"\(lite\) are not there; fetch them: simrecon models fetch lite$"):
        weights.find("lite")
    assert not cache.exists()


def test_fetch_by_npm_itself(cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    package = tmp_path / "package.tgz"
    package.write_bytes(packed("npm"))
    executable(
        tmp_path / "bin",
        "npm",
        "import pathlib, shutil, sys\n"
        f"assert sys.argv[1:3] == ['pack', {fetching.NPM_PACKAGE!r}], sys.argv\n"
        "to = pathlib.Path(sys.argv[sys.argv.index('--pack-destination') + 1])\n"
        f"shutil.copy({str(package)!r}, to / 'pose.tgz')\n",
    )
    assert cli.main(["models", "fetch"]) == 0
    assert [line.split()[:4] for line in capsys.readouterr().out.splitlines()] == [
        [name, "fetched", "by", "npm"] for name in ("detector", "heavy", "full")
    ]
    assert (cache / "pose_landmark_heavy.tflite").read_bytes() == CONTENT["heavy"]
    assert weights.find("heavy") == (
        cache / "pose_landmark_heavy.tflite",
        hashlib.sha256(CONTENT["heavy"]).hexdigest(),
    )
    assert sorted(p.name for p in cache.iterdir()) == [
        "pose_detection.tflite", "pose_landmark_full.tflite", "pose_landmark_heavy.tflite",
    ]  # fmt: skip
    (tmp_path / "bin" / "npm").unlink()
    assert cli.main(["models", "fetch", "heavy", "full"]) == 0  # offline: all is there
    assert "there" in capsys.readouterr().out
    assert cli.main(["models", "list"]) == 0
    rows = [line.split()[:2] for line in capsys.readouterr().out.splitlines()]
    assert rows == [["detector", "there"], ["heavy", "there"], ["full", "there"], ["lite", "missing"]]


def test_a_client_that_fails_is_quoted(tmp_path: Path) -> None:
    executable(tmp_path / "bin", "npm", "import sys\nprint('npm error 404 no such package')\nsys.exit(7)\n")
    with pytest.raises(
        SimreconError, match=r"heavy: npm failed with status 7: npm error 404 no such package"
    ):
        fetching.fetch(["heavy"])


def test_without_npm_pip_brings_what_it_has(cache: Path) -> None:
    log: list[Sequence[str]] = []
    assert fetching.default() == ("full",)
    report = fetching.fetch(["detector", "full"], runner=runner(log))
    assert report == {"detector": "fetched by pip", "full": "fetched by pip"}
    (command,) = log
    assert command[:4] == (sys.executable, "-m", "pip", "download")
    assert {"--no-deps", "mediapipe==0.10.21"} <= set(command)
    assert weights.best() == "full"
    with pytest.raises(SimreconError, match="could not fetch heavy: npm is not there"):
        fetching.fetch(["heavy"], runner=runner(log))
    assert cache.is_dir()


def test_pip_steps_in_when_npm_fails(tmp_path: Path) -> None:
    executable(tmp_path / "bin", "npm", "")
    log: list[Sequence[str]] = []
    with pytest.raises(
        SimreconError, match=r"could not fetch heavy \(got detector, full\): npm failed: offline"
    ):
        fetching.fetch(["detector", "heavy", "full"], runner=runner(log, fails=("npm",)))
    assert weights.state(weights.entry("full")) == "there"


def test_a_download_with_another_hash_is_not_kept(monkeypatch: pytest.MonkeyPatch, cache: Path) -> None:
    monkeypatch.setattr(weights, "TABLE", table(full=b"what it should be"))
    with pytest.raises(SimreconError, match="full has another SHA-256 than it must have"):
        fetching.fetch(["full"], runner=runner([]))
    assert not (cache / "pose_landmark_full.tflite").exists()


def test_a_package_without_the_file(tmp_path: Path) -> None:
    def run(_command: Sequence[str], cwd: Path) -> None:
        with tarfile.open(cwd / "pose.tgz", "w:gz"):
            pass

    executable(tmp_path / "bin", "npm", "")
    with pytest.raises(SimreconError, match=r"found no package/pose_landmark_heavy.tflite in it"):
        fetching.fetch(["heavy"], runner=run)


@pytest.mark.parametrize(
    "content",
    [b"", b"\x1f\x8b\x08", gzip.compress(bytes(2000), mtime=0)[:-9], b"x" * 600],
    ids=["empty", "header", "cut", "text"],
)
def test_a_package_that_is_cut_off_is_one_line(tmp_path: Path, content: bytes) -> None:
    def run(_command: Sequence[str], cwd: Path) -> None:
        (cwd / "pose.tgz").write_bytes(content)

    executable(tmp_path / "bin", "npm", "")
    with pytest.raises(SimreconError, match=r"models: could not fetch heavy: "):
        fetching.fetch(["heavy"], runner=run)


def test_damaged_weights_are_refused_and_fetched_again(
    cache: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fetching.fetch(["full"], runner=runner([]))
    path = cache / "pose_landmark_full.tflite"
    path.write_bytes(CONTENT["full"][:-1] + b"!")
    os.utime(path, ns=(1, 1))
    with pytest.raises(InputError, match=r"SHA-256 says; fetch it again: simrecon models fetch$"):
        weights.find("full")
    assert cli.main(["models", "list"]) == 0
    assert "full     damaged" in capsys.readouterr().out
    assert fetching.fetch(["full"], runner=runner([])) == {"full": "fetched by pip"}
    assert path.read_bytes() == CONTENT["full"]


def test_unknown_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["models", "fetch", "huge"]) == 2
    assert "found huge; valid: heavy, full, lite" in capsys.readouterr().err
