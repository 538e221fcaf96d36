"""How closely the kinematic fit follows motion capture, clip by clip.

usage: python -m tools.study.mocap --data DATA [--seconds S] [--every N] [--page docs/studies/mocap.md]

All BVH, the marker trials, and the recorded motions that the clips `synth_*` were made from. Of each: the
mean distance of the fit's joints from the file's (MPJPE-G) over all joints but the neck, which rigs put
anywhere between the collar bones and the skull, the joint that is farthest off in the mean, and by how much
the path of the hips is longer or shorter.
"""

from __future__ import annotations

import argparse
import tarfile
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.body import names
from simrecon.errors import InputError
from simrecon.evidence import from_arrays, resample
from simrecon.types import Array, Evidence, KinematicFit, Scene

RATE_HZ = 30.0
LEFT_OUT = ("neck",)
BEGIN, END = "<!-- table: written by tools/study/mocap.py -->\n", "<!-- end of table -->"
HEAD = (
    "| clip | frames | MPJPE-G, mm | farthest joint, mm | path of the hips, % | stature, m |",
    "|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Followed:
    """How closely a clip was followed: a line of the table, the mean error, and the path's excess in %."""

    line: str
    mean_mm: float
    path_pct: float


def main() -> None:
    """Print a table, and write it into a page between its marks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=8.0, help="of each clip, from its begin")
    parser.add_argument("--every", type=int, default=1, help="only one clip of so many")
    parser.add_argument("--page", type=Path, help="a page with the marks between which the table goes")
    options = parser.parse_args()
    lines = []
    for line in table(options.data, options.seconds, options.every):
        print(line, flush=True)
        lines.append(line)
    if options.page:
        page = options.page.read_text(encoding="utf-8")
        before, after = page.split(BEGIN)[0], page.split(END)[1]
        options.page.write_text("\n".join([before + BEGIN, *lines, "", END]) + after, encoding="utf-8")


def table(data: Path, seconds: float, every: int) -> Iterator[str]:
    """Lines of the table, and the summary below it, as they are known."""
    yield from HEAD
    done = []
    with tempfile.TemporaryDirectory() as folder:
        for clip, seen in list(clips(data, Path(folder)))[::every]:
            if isinstance(seen, InputError):
                yield f"| {clip} | refused: {seen} |"
                continue
            cut = shortened(seen, seconds)
            done.append(row(clip, cut, kinematics.fit(cut, Scene(), plans.read("default").kinematics)))
            yield done[-1].line
    means, paths = [each.mean_mm for each in done], [abs(each.path_pct) for each in done]
    yield ""
    yield (
        f"The first {seconds:g} s of {len(done)} clips: mean {np.mean(means):.1f} mm, worst clip "
        f"{np.max(means):.1f} mm; path of the hips within {np.max(paths):.1f} %."
    )


def clips(data: Path, folder: Path) -> Iterator[tuple[str, Evidence | InputError]]:
    """All motion capture by name; what is refused as the error."""
    with tarfile.open(data / "mocap" / "cmu_asf_amc_bvh.tar.xz") as archive:
        archive.extractall(folder, filter="data")
    files = [*(data / "mocap" / "mass_bvh").glob("*.bvh"), *folder.rglob("*.bvh")]
    files += [path for path in (data / "grf" / "opencap_subject4").glob("*.trc") if "static" not in path.name]
    for path in sorted(files, key=lambda path: (path.suffix, path.name)):
        try:
            yield path.name, readers.read(path)
        except InputError as error:
            yield path.name, error
    for path in sorted((data / "truth").glob("synth_*.npz")):
        yield path.stem, recorded(path)


def recorded(path: Path) -> Evidence:
    """The recorded motion behind a clip `synth_*` as motion capture."""
    with np.load(path) as truth:
        return from_arrays(
            truth["times_s"],
            joint_names=[str(name) for name in truth["joint_names"]],
            joints_m=truth["joints_m"],
            trust="mocap",
        )


def shortened(seen: Evidence, seconds: float) -> Evidence:
    """The first seconds of evidence, at most 30 frames in each."""
    step = max(round(1 / (RATE_HZ * float(np.median(np.diff(seen.times_s))))), 1)
    rows = np.flatnonzero(seen.times_s - seen.times_s[0] <= seconds)[::step]
    cut = replace(
        seen,
        times_s=seen.times_s[rows],
        joints_m=seen.joints_m[rows],
        keypoints_px=seen.keypoints_px[rows],
        scores=seen.scores[rows],
    )
    return resample(cut)[0]


def row(clip: str, seen: Evidence, fit: KinematicFit) -> Followed:
    """How closely a fit follows the joints of a clip."""
    marks = kinematics.configurations(fit.body, fit.qpos)[1]  # (T, M, 3)
    off = {
        name: 1e3 * float(np.nanmean(np.linalg.norm(marks[:, point] - seen.joints_m[:, k], axis=-1)))
        for k, (name, point) in enumerate(zip(seen.joint_names, names.resolve(seen.joint_names), strict=True))
        if point != names.IGNORED and name not in LEFT_OUT and np.isfinite(seen.joints_m[:, k]).any()
    }
    worst = max(off, key=lambda name: off[name])
    hips = [fit.body.skeleton.point_names.index(f"{side}_hip") for side in ("left", "right")]
    theirs = [seen.joint_names.index(f"{side}_hip") for side in ("left", "right")]
    ours_m, path_m = path(marks[:, hips].mean(axis=1)), path(seen.joints_m[:, theirs].mean(axis=1))
    longer = 100 * (ours_m / path_m - 1)
    mean = float(np.mean(list(off.values())))
    cells = f"{len(marks)} | {mean:.1f} | {worst} {off[worst]:.0f} | {longer:+.1f} | {fit.body.height_m:.2f}"
    return Followed(f"| {clip} | {cells} |", mean, longer)


def path(places_m: Array) -> float:
    """Length of the way through places (T, 3), smoothed over five frames: trembling does not count."""
    known = places_m[np.isfinite(places_m).all(axis=1)]
    smooth = np.stack([np.convolve(axis, np.full(5, 0.2), "valid") for axis in known.T], axis=1)
    return float(np.linalg.norm(np.diff(smooth, axis=0), axis=1).sum())


if __name__ == "__main__":
    main()
