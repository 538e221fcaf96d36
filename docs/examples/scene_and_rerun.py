"""A person stands on a hard floor, then again on a softer one, from the finished motion on.

Usage: python scene_and_rerun.py [OUT]
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import simrecon

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
out.mkdir(parents=True, exist_ok=True)

# sideways place and height of the joints, m, the same for half a second
places = {"hip": (0.09, 0.93), "knee": (0.09, 0.50), "ankle": (0.09, 0.09), "shoulder": (0.17, 1.40)}
names = [f"{side}_{joint}" for joint in places for side in ("left", "right")]
stance = np.array([(0.0, sign * y, z) for y, z in places.values() for sign in (1, -1)])  # (K, 3)
still = simrecon.evidence_from_arrays(
    np.arange(16) / 30, joint_names=names, joints_m=np.tile(stance, (16, 1, 1)), height_m=1.7
)
simrecon.write_evidence(out / "still.npz", still)
quick = simrecon.read_plan("quick")
hard = simrecon.run(simrecon.Job(str(out / "still.npz"), str(out / "hard"), plan=quick))

# the job of a result holds all that it was made with; only what is named here changes
floor = replace(hard.scene.ground, stiffness_Npm=20_000.0, damping_Nspm=400.0)
job = replace(
    hard.job,
    output=str(out / "soft"),
    scene=replace(hard.scene, ground=floor),
    start=str(hard.folder / "motion.npz"),
)
soft = simrecon.run(job)
for name, result in (("hard", hard), ("soft", soft)):
    print(f"{name} floor: the feet go in by {result.report['metrics']['penetration_max_mm']:.0f} mm")
