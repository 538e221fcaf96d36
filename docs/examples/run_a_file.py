"""Reconstruct a clip from a file, and say how it went.

Usage: python run_a_file.py [OUT]
"""

import sys
from pathlib import Path

import simrecon
from simrecon import resources

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
example = resources.folder("example")  # a person who walks on a beam

job = simrecon.Job(
    input=str(example / "beam.npz"),
    output=str(out / "beam"),
    scene=simrecon.read_scene(example / "beam.toml"),
    plan=simrecon.read_plan("quick"),
)
result = simrecon.run(job)

frames, metrics = result.report["frames"], result.report["metrics"]
print(f"{frames['simulated']} of {frames['count']} frames are simulated")
print(f"mean ground reaction force {metrics['mean_grf_pct_bw']:.0f} % of body weight")
print(f"deepest penetration of the floor {metrics['penetration_max_mm']:.1f} mm")
print(f"replays bit for bit: {result.report['audit']['replay_exact']}")
