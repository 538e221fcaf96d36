"""Run a clip, then again on a softer floor, from the finished motion on.

Usage: python scene_and_rerun.py [OUT]
"""

import sys
from dataclasses import replace
from pathlib import Path

import simrecon
from simrecon import resources

out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
example = resources.folder("example")

hard = simrecon.run(
    simrecon.Job(
        input=str(example / "beam.npz"),
        output=str(out / "hard"),
        scene=simrecon.read_scene(example / "beam.toml"),
        plan=simrecon.read_plan("quick"),
    )
)

# the job of a result holds all that was asked for; only what is named here changes
floor = replace(hard.scene.ground, stiffness_Npm=20_000.0, damping_Nspm=400.0)
job = replace(
    hard.job,
    output=str(out / "soft"),
    scene=replace(hard.scene, ground=floor),
    start=str(hard.folder / "motion.npz"),
)
soft = simrecon.run(job)
for name, result in (("hard", hard), ("soft", soft)):
    print(f"{name} floor: lowest centre of mass {result.motion.com_m[:, 2].min():.3f} m")
