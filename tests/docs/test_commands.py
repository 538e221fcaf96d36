"""Every command line of README and docs runs as it stands, on small inputs; or it is said why not.

What is put in its place: a small plan where none is named or a large one is, files made here under the names
of the page, and `REPLACED`. The pose network is a stand-in that finds rectangles.
"""

from __future__ import annotations

import re
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from simrecon import cli, evidence, resources, results
from simrecon.cli import options
from simrecon.errors import InputError
from simrecon.evidence import cutting
from simrecon.evidence.keypoints import layouts
from simrecon.evidence.video import detection, weights
from simrecon.metrics.truth import TRUTH_SCHEMA
from tests.docs import commands
from tests.docs.commands import Command
from tests.evidence import test_keypoints as keypoints
from tests.evidence import test_smpl as smpl
from tests.support import foreign_files as foreign
from tests.support import people, plan_text, smpl_layout, video_files
from tests.support.c3d_file import c3d

NOT_RUN = {
    r"python3? -m (venv|pip)\b": "makes an environment, with packages from a network",
    r"(\.|source) ": "enters an environment",
    r"python -m pytest$": "is what runs this",
    r"python -m webbrowser ": "opens a browser",
    r"simrecon models fetch$": "fetches weights from a network",
    r"simrecon export .* --to usd$": "needs an extra",
    r"simrecon batch .* --scheduler ": "needs a cluster",
    r"python -m tools\.bench\.(tracking|long_video) ": "needs the weights of the network, and videos",
    r"python -m tools\.ops\.slurm_batch ": "needs Slurm",
    r"simrecon bench [a-z_]+ --data (DIR|CLIPS) ": "takes hours, on clips of one's own",
    r"simrecon studio ": "needs an extra, and serves until it is stopped",
    r"python -m tools\.(study|train)\.synthesis corpus": "needs an extra, and a corpus that takes a night",
    r"simrecon run --job job\.toml ": "repeats a job that the studio saved",
    r"python -m tools\.(study|make|train)\.[a-z_]+ --data DATA ": "takes an hour, on clips of one's own",
    r"python -m (tools\.bench\.(chaos|power|full)_|tools\.ops\.guided_|tests\.support)": "takes minutes",
}
"""Commands that cannot run here, by pattern, and why."""
REPLACED = {"--betas=…": "--betas=0.5", "/shared/night": "out/night"}
"""What stands for something else in a page."""
LEAST = {"population": "8", "generations": "2", "evaluations": "10"}
"""What of the plan `quick` is less here."""
PLANNED = ("run", "rerun", "batch", "demo", "synthesize")
"""Commands that take a plan, and get a small one."""


def reason(command: Command) -> str | None:
    """Why a command cannot run; None: it can."""
    return next((why for pattern, why in NOT_RUN.items() if re.match(pattern, command.text)), None)


def words(command: Command) -> list[str]:
    """The arguments that are run."""
    text = command.text
    for old, new in REPLACED.items():
        text = text.replace(old, new)
    found = shlex.split(text)[1:]
    if found[0] in PLANNED and "--job" not in found:
        at = found.index("--plan") if "--plan" in found else len(found)
        found[at : at + 2] = ["--plan", "tiny.toml"]
    return found


ALL = commands.all_of_them()
RUN = [command for command in ALL if reason(command) is None]


def test_pages_have_commands_and_each_is_run_or_excused() -> None:
    assert len(RUN) > 25
    assert {command.text.split()[0] for command in RUN} == {"simrecon"}
    unused = [pattern for pattern in NOT_RUN if not any(re.match(pattern, c.text) for c in ALL)]
    assert unused == []


@pytest.mark.parametrize("command", RUN, ids=lambda command: f"{command.page}:{command.line}")
def test_a_command_has_options_that_there_are(command: Command) -> None:
    cli._parser().parse_args(options.joined(words(command)))


def test_an_unknown_command_fails() -> None:
    new = Command("README.md", 1, "simrecon dance clip.npz")
    assert reason(new) is None
    with pytest.raises(InputError):
        cli._parser().parse_args(options.joined(words(new)))


# --- small files under the names of the pages


def _clip(folder: Path) -> None:
    """The first 1.3 s of the example at 15 Hz, its reference, and a scene."""
    source = evidence.read(resources.folder("example") / "beam.npz")
    seen = cutting.cut(source, slice(0, 80, 4))
    evidence.write(folder / "clip.npz", replace(seen, part=None))
    (folder / "contacts.toml").write_text('schema = "simrecon.contacts/1"\n[left_heel]\nmode = "grounded"\n')
    (folder / "room.toml").write_text("[ground]\nfriction = 0.9\n")
    (folder / "edited.toml").write_text("[ground]\nfriction = 0.8\n")
    (folder / "clips").mkdir()
    shutil.copyfile(folder / "clip.npz", folder / "clips" / "clip.npz")


def _video(folder: Path) -> None:
    """Seven seconds of a rectangle, and its lens."""
    images = [
        cv2.resize(video_files.scene([(60 + t / 4, 70, 80, video_files.RED)], (135, 240)), (270, 480))
        for t in range(105)
    ]
    video_files.write(folder / "clip.mp4", images, 15.0)
    lens = "image_size_px = [270, 480]\nmatrix_px = [[415.0, 0, 135], [0, 415.0, 240], [0, 0, 1]]\n"
    (folder / "calibration.toml").write_text(lens)


def _mocap(folder: Path) -> None:
    labels, places = foreign.markers(frames=60)
    (folder / "trial.trc").write_text(foreign.trc(labels, 1000 * places[:20]))
    (folder / "walk.trc").write_text(foreign.trc(labels, 1000 * places))
    (folder / "trial.c3d").write_bytes(c3d(labels, 1000 * places[:20]))
    (folder / "walk.bvh").write_text(foreign.bvh()[0])


def _networks(folder: Path) -> None:
    smpl.wham(folder)
    smpl.gvhmr(folder)
    keypoints.alphapose(folder, 17).rename(folder / "vitpose.json")
    names = layouts.layout("openpose_25")
    points = people.seen(people.named(people.walking(12), names), at_px=(135.0, 440.0))
    (folder / "openpose_json").mkdir()
    for t in range(12):
        person = {"pose_keypoints_2d": np.c_[points[t], np.full(25, 0.9)].ravel().tolist()}
        foreign.save_json(folder / "openpose_json" / f"clip_{t:012d}_keypoints.json", {"people": [person]})


def _truth(folder: Path) -> None:
    """What the result in `out/clip` did, as the reference."""
    motion = results.read_motion(folder / "out" / "clip")
    np.savez(
        folder / "truth.npz",
        schema=TRUTH_SCHEMA,
        times_s=motion.times_s,
        joint_names=np.array(motion.joint_names),
        joints_m=motion.joints_m,
    )


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all files that the pages name, and a result in `out/clip`."""
    folder = tmp_path_factory.mktemp("prepared")
    (folder / "tiny.toml").write_text(plan_text.quick(LEAST))
    np.savez(folder / "SMPL_NEUTRAL.npz", **smpl_layout.arrays())
    for make in (_clip, _video, _mocap, _networks):
        make(folder)
    made = ["run", str(folder / "clip.npz"), "-o", str(folder / "out" / "clip")]
    assert cli.main([*made, "--plan", str(folder / "tiny.toml"), "--threads", "1"]) in ENDED
    shutil.copytree(folder / "out" / "clip", folder / "out" / "demo")
    _truth(folder)
    return folder


ENDED = (0, 3)
"""Exit statuses of what ran: also where the small plan loses the person."""


@pytest.mark.slow
@pytest.mark.parametrize("command", RUN, ids=lambda command: f"{command.page}:{command.line}")
def test_a_command_runs(
    command: Command,
    prepared: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    if " -o out " in f"{command.text} ":
        shutil.rmtree(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SIMRECON_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(weights, "find", lambda name: (Path(name), f"hash of {name}"))
    monkeypatch.setattr(detection, "Networks", lambda *_: video_files.Rectangles())
    status = cli.main(words(command))
    assert status in ENDED, capsys.readouterr().err
