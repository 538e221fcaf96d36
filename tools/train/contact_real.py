"""Contacts of heels and toes on real videos, by our network, by the rules of the fit, and by speed.

usage: python -m tools.train.contact_real --data DIR [CLIP …]

The truth is that of motion capture, or of four cameras: a joint within 5 cm of the height at which it rests,
and slower than 0.6 m/s (Rempe 2020, section 3.2). No file of ours holds force plates beside a video. The
speeds below which heels and toes touch by the two rules of speed are those that are right most often on the
same clips, which no rule can know: the rules are better here than they are.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from simrecon import body as bodies
from simrecon import contact
from simrecon import evidence as readers
from simrecon.contact import Cues, rules
from simrecon.contact.cues import rows_of
from simrecon.evidence import resample
from simrecon.geometry import camera as cameras
from simrecon.kinematics import world
from simrecon.kinematics.observe import by_point
from simrecon.metrics.truth import canonical
from simrecon.types import Array, Evidence, Flags
from tools.train.contact_motions import HEURISTIC_MPS
from tools.train.contact_paper import best_threshold
from tools.train.contacts import scored

CLIPS = {
    "opencap_walk_ts_blazepose": "opencap_walk_ts",
    "opencap_STS_blazepose": "opencap_STS",
    "pose2sim_beam_cam01": "pose2sim_beam",
    "pose2sim_beam_cam03": "pose2sim_beam",
}
FEET = ("left_heel", "right_heel", "left_toe", "right_toe")
NEAR_M = 0.05


def main() -> None:
    """Print accuracy, precision, recall and F1 of each clip, and of all."""
    parser = argparse.ArgumentParser(description="Contacts on real videos.")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("clips", nargs="*", default=list(CLIPS))
    options = parser.parse_args()
    pooled: dict[str, list[tuple[Flags, Flags]]] = {}
    speeds: dict[str, list[tuple[Array, Flags]]] = {}
    for clip in options.clips:
        evidence, _ = resample(readers.read(options.data / "evidence" / f"{clip}.npz"))
        truth = touches(options.data / "truth" / f"{CLIPS[clip]}.npz", evidence.times_s)
        for name, found in predictions(evidence).items():
            pooled.setdefault(name, []).append((found, truth))
            print(f"{clip:28} {name:12}", *(f"{k} {v:.3f}" for k, v in scored(found, truth).items()))
        for name, speed in velocities(cues(evidence)).items():
            speeds.setdefault(name, []).append((speed, truth))
    for name, known in speeds.items():
        limit = best_threshold(*(np.concatenate(part) for part in zip(*known, strict=True)))
        pooled[name] = [(speed < limit, truth) for speed, truth in known]
        for clip, (found, truth) in zip(options.clips, pooled[name], strict=True):
            print(f"{clip:28} {name:12}", *(f"{k} {v:.3f}" for k, v in scored(found, truth).items()))
    for name, pairs in pooled.items():
        found, truth = (np.concatenate(part) for part in zip(*pairs, strict=True))
        print(f"{'all':28} {name:12}", *(f"{k} {v:.3f}" for k, v in scored(found, truth).items()))


def touches(path: Path, times_s: Array) -> Flags:
    """Where heels and toes of a reference touch, at other times, (T, 4)."""
    with np.load(path, allow_pickle=False) as kept:
        names, own_s, joints = (
            canonical([str(n) for n in kept["joint_names"]]),
            kept["times_s"],
            kept["joints_m"],
        )
    points = joints[:, [names.index(name) for name in FEET]].astype(np.float64)
    step = np.linalg.norm(np.diff(points, axis=0), axis=-1) / np.diff(own_s)[:, None]
    speed = np.concatenate((step[:1], step))
    rest = np.array([rules.rest_height_m(points[:, k, 2]) for k in range(len(FEET))])
    flags = (points[..., 2] < rest + NEAR_M) & (speed < HEURISTIC_MPS)
    return np.asarray(flags[np.abs(times_s[:, None] - own_s).argmin(axis=1)])


def predictions(evidence: Evidence) -> dict[str, Flags]:
    """Labels (T, 4) by each method."""
    seen = cues(evidence)
    known = {}
    for source in contact.SOURCES:
        labels = contact.label(seen, source)
        known[source] = np.stack([labels.of(part) for part in FEET], axis=1) > 0.5
    known["always"] = np.ones_like(known["rules"])
    return known


def velocities(seen: Cues) -> dict[str, Array]:
    """Speeds (T, 4) of heels and toes: in the image, leg lengths a second, and of the 3D estimate, m/s."""
    rows, ends = rows_of(FEET), rows_of(("left_hip", "right_hip", "left_ankle", "right_ankle"))
    leg = np.linalg.norm(seen.rays[ends[:2]] - seen.rays[ends[2:]], axis=-1)
    places = {"2D velocity": seen.rays[rows] / np.median(leg), "3D velocity": seen.joints_m[rows]}
    steps = {name: np.linalg.norm(np.diff(own, axis=1), axis=-1) for name, own in places.items()}
    return {n: np.concatenate((s[:, :1], s), axis=1).T / seen.interval_s for n, s in steps.items()}


def cues(evidence: Evidence) -> Cues:
    """What the fit makes its labels of."""
    skeleton, camera = bodies.template(), world.provisional(evidence)
    points = by_point(evidence, skeleton)
    joints = points.joints_m
    if evidence.joints_frame != "world":
        joints = world.in_world(camera, joints)
    rays = np.zeros_like(points.pixels)
    if camera is not None:
        rays = np.nan_to_num(cameras.undistort(camera.lens, points.pixels))
    interval = float(evidence.times_s[1] - evidence.times_s[0])
    in_world = evidence.joints_frame == "world"
    return Cues(interval, camera, rays, points.scores, joints, points.known, in_world)


if __name__ == "__main__":
    main()
