"""The figure of a plan, as figure 5b of Rempe 2020: centre of mass and forces at heels and toes, over time.

usage: python -m tools.make.plan_image CLIP.npz -o FILE.png [--scene SCENE.toml] [--planner centroidal]

Above, from the side in which the person goes: the path of the centre of mass, contact points, and forces on
them, each tenth of a second. Below: upward force on each point in body weights, and their sum. The fit is
that of plan `quick`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics, plan, planners
from simrecon import scene as scenes
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.metrics.dynamics import body_weight_pct
from simrecon.types import Array, Reference, Scene

mpl.use("Agg")
from matplotlib import pyplot

EVERY_S, METRES_PER_WEIGHT = 0.1, 0.5


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("clip", type=Path)
    parser.add_argument("-o", dest="output", type=Path, required=True)
    parser.add_argument("--scene", type=Path)
    parser.add_argument("--planner", default="centroidal", choices=planners.names())
    options = parser.parse_args()
    seen, _ = resample(readers.read(options.clip))
    settings = plan.read("quick")
    scene = Scene() if options.scene is None else scenes.read(options.scene)
    fit = kinematics.fit(seen, scene, settings.kinematics)
    found = planners.plan(options.planner, fit, seen, settings)
    draw(found, fit.body.mass_kg, options.output)


def draw(found: Reference, mass_kg: float, path: Path) -> None:
    """A plan as a PNG.

    Raises:
        InputError: the planner knows no forces.
    """
    if found.contact_force_N is None or found.contact_place_m is None:
        raise InputError(
            f"planner {found.planner}: there are no forces to draw; valid: one that plans forces"
        )
    weights = body_weight_pct(found.contact_force_N, mass_kg) / 100.0  # (T, C, 3)
    figure, (side, over) = pyplot.subplots(2, 1, figsize=(10, 7), height_ratios=(3, 2))
    _from_the_side(side, found.com_m, found.contact_place_m, weights, found.times_s)
    for name, column in zip(found.contact_names, weights[..., 2].T, strict=True):
        if column.any():
            over.plot(found.times_s, column, label=name.replace("_", " "))
    over.plot(found.times_s, weights[..., 2].sum(axis=1), "k--", label="sum")
    over.set(xlabel="s", ylabel="upward force, body weights")
    over.legend(fontsize="small", ncols=5)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def _from_the_side(axes: pyplot.Axes, com_m: Array, places_m: Array, weights: Array, times_s: Array) -> None:
    """The plane in which the centre of mass goes farthest, and up."""
    flat = com_m[:, :2] - com_m[:, :2].mean(axis=0)
    along = np.linalg.svd(flat, full_matrices=False)[2][0]  # (2,)
    axes.plot(com_m[:, :2] @ along, com_m[:, 2], color="0.4")
    frames = np.unique(np.round(np.arange(0.0, times_s[-1] - times_s[0], EVERY_S) / np.diff(times_s[:2])))
    for frame in frames.astype(int):
        axes.plot(com_m[frame, :2] @ along, com_m[frame, 2], "o", color="0.4", markersize=4)
        pushes = np.flatnonzero(np.linalg.norm(weights[frame], axis=1) > 0.01)
        force, place = METRES_PER_WEIGHT * weights[frame, pushes], places_m[frame, pushes]
        axes.quiver(
            place[:, :2] @ along, place[:, 2], force[:, :2] @ along, force[:, 2],
            pushes, cmap="tab10", clim=(0, 9), angles="xy", scale_units="xy", scale=1, width=0.002,
        )  # fmt: skip
    axes.set_aspect("equal")
    axes.set(ylabel="m")


if __name__ == "__main__":
    main()
