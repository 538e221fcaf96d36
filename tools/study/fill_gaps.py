"""What a pose prior is worth in the kinematic fit: the lower body hidden for half a second at a time.

usage: python -m tools.study.fill_gaps DATA [--clips walk kick …] [--try none gaussian:0.002 flow:0.01 …]

DATA holds evidence/ and truth/ (synthetic clips). Hips are seen; knees, ankles, heels and toes are not, in
the image and in the 3D estimate, in the second half of every second. Printed: mean distance in mm of the
hidden joints from the truth, both relative to the pelvis, over the hidden frames, and over the frames that
are not hidden.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simrecon import evidence, kinematics, plan
from simrecon.types import Array, Evidence, Scene

HIDDEN = ("knee", "ankle", "heel", "toe", "foot", "hallux")
CLIPS = ("walk", "kick", "jump", "punch", "dance_a", "getup_faceup")


def main() -> None:
    """Fit every clip with every prior."""
    parser = argparse.ArgumentParser(description="Gap filling with pose priors.")
    parser.add_argument("data", type=Path)
    parser.add_argument("--clips", nargs="+", default=CLIPS)
    parser.add_argument(
        "--try", dest="priors", nargs="+", default=["none", "gaussian:0.002", "flow:0.002", "flow:0.01"]
    )
    parser.add_argument("--evaluations", type=int, default=800)
    options = parser.parse_args()
    base = replace(plan.read("default").kinematics, evaluations=options.evaluations)
    total: dict[str, list[tuple[float, float]]] = {}
    for name in options.clips:
        whole = evidence.resample(evidence.read(options.data / "evidence" / f"synth_{name}.npz"))[0]
        gap = np.arange(len(whole.times_s)) * (whole.times_s[1] - whole.times_s[0]) % 1.0 >= 0.5
        for entry in options.priors:
            model, _, weight = entry.partition(":")
            settings = replace(
                base, prior=float(weight or 0), prior_model="gaussian" if model == "none" else model
            )
            errors = distances(hidden(whole, gap), options.data / "truth" / f"synth_{name}.npz", settings)
            means_mm = 1e3 * float(errors[gap].mean()), 1e3 * float(errors[~gap].mean())
            total.setdefault(entry, []).append(means_mm)
            print(f"{name:14} {entry:16} {means_mm[0]:6.1f} in gaps, {means_mm[1]:6.1f} outside", flush=True)
    none = np.mean([inside for inside, _ in total[options.priors[0]]])
    for entry, rows in total.items():
        mean = np.mean(rows, axis=0)
        print(f"all {entry:27} {mean[0]:6.1f} in gaps, {mean[1]:5.1f} outside, x {mean[0] / none:.3f}")


def hidden(whole: Evidence, gap: NDArray[np.bool_]) -> Evidence:
    """The evidence without the lower body in these frames."""
    pixels, scores, joints = whole.keypoints_px.copy(), whole.scores.copy(), whole.joints_m.copy()
    for names, arrays in ((whole.keypoint_names, (pixels, scores)), (whole.joint_names, (joints,))):
        columns = np.array([i for i, name in enumerate(names) if name.endswith(HIDDEN)], int)
        for array in arrays:
            array[np.ix_(gap, columns)] = 0.0 if array is scores else np.nan
    return replace(whole, keypoints_px=pixels, scores=scores, joints_m=joints)


def distances(seen: Evidence, truth: Path, settings: plan.Kinematics) -> Array:
    """Distances (T, H) of the hidden joints from the truth relative to the middle of the hips, m."""
    fit = kinematics.fit(seen, Scene(), settings)
    points = dict(
        zip(
            fit.body.skeleton.point_names,
            np.swapaxes(kinematics.configurations(fit.body, fit.qpos)[1], 0, 1),
            strict=True,
        )
    )
    with np.load(truth, allow_pickle=False) as data:
        there = dict(
            zip([str(name) for name in data["joint_names"]], np.swapaxes(data["joints_m"], 0, 1), strict=True)
        )
    parts = [f"{side}_{joint}" for side in ("left", "right") for joint in ("knee", "ankle")]
    middle = [(at["left_hip"] + at["right_hip"]) / 2 for at in (points, there)]
    return np.stack(
        [np.linalg.norm(points[p] - middle[0] - there[p] + middle[1], axis=-1) for p in parts], axis=1
    )


if __name__ == "__main__":
    main()
