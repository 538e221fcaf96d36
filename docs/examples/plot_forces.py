"""Read a result and plot the vertical forces under the feet.

Usage: python plot_forces.py [OUT] (makes a result there first; needs matplotlib)
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import simrecon
from simrecon import resources

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
example = resources.folder("example")  # a person who walks on a beam
beam, plan = simrecon.read_scene(example / "beam.toml"), simrecon.read_plan("quick")
simrecon.run(simrecon.Job(str(example / "beam.npz"), str(out / "beam"), scene=beam, plan=plan))

result = simrecon.open_result(out / "beam")
motion, weight_N = result.motion, 9.81 * result.report["person"]["mass_kg"]
figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
for foot in ("left_foot", "right_foot"):
    force_N = motion.contact_force_N[:, motion.contact_body.index(foot), 2]
    axes.plot(motion.times_s, 100 * force_N / weight_N, label=foot.replace("_", " "))
axes.plot(motion.times_s, 100 * motion.grf_N[:, 2] / weight_N, "k", lw=0.7, label="all contacts")
axes.set(xlabel="time, s", ylabel="vertical force, % of body weight")
axes.legend()
figure.savefig(out / "forces.png", dpi=120)
print(f"written {out / 'forces.png'}")
