"""Make evidence from arrays, as a pose network gives them, and reconstruct it.

Usage: python evidence_from_arrays.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np

import simrecon

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
out.mkdir(parents=True, exist_ok=True)

# a person of 1.7 m who stands for a second and sways: sideways place and height of the joints, m
places = {"hip": (0.09, 0.93), "knee": (0.09, 0.50), "ankle": (0.09, 0.09), "shoulder": (0.17, 1.40)}
places |= {"elbow": (0.22, 1.12), "wrist": (0.24, 0.87)}
names = [f"{side}_{joint}" for joint in places for side in ("left", "right")]
stance = np.array([(0.0, sign * y, z) for y, z in places.values() for sign in (1, -1)])  # (K, 3)

times_s = np.arange(31) / 30
lean_m = 0.03 * np.sin(2 * np.pi * times_s)
joints_m = np.tile(stance, (len(times_s), 1, 1))  # (T, K, 3)
joints_m[:, :, 0] += lean_m[:, None] * stance[:, 2] / 1.4

evidence = simrecon.evidence_from_arrays(
    times_s, joint_names=names, joints_m=joints_m, joints_frame="world", height_m=1.7
)
simrecon.write_evidence(out / "sway.npz", evidence)
job = simrecon.Job(str(out / "sway.npz"), str(out / "sway"), plan=simrecon.read_plan("quick"))
result = simrecon.run(job)
print(f"the centre of mass sways by {1e3 * np.ptp(result.motion.com_m[:, 0]):.0f} mm")
