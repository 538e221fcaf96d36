"""A result and the geometry of its configurations, ready to be scored."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco

from simrecon.evaluation.configurations import Configurations, configurations, foot_rest
from simrecon.evidence import cutting
from simrecon.evidence.cutting import WHOLE, Span
from simrecon.metrics import bones
from simrecon.metrics.statistics import Scores
from simrecon.results import open_result, report_file
from simrecon.sim.address import locate
from simrecon.types import Motion, Report, Scene

BY_FRAME = (
    "times_s", "frame_step", "status", "qpos", "qvel", "joints_m", "com_m", "torque_Nm", "contact_force_N",
    "contact_point_m", "contact_slip_mps", "grf_N", "kinematic_qpos", "planned_qpos", "band_joints_m",
    "band_grf_N", "band_feet_N", "contact_probability",
)  # fmt: skip
"""Arrays of a motion with a row for each frame."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """A result; T frames.

    Attributes:
        motion, scene, model, report: what its folder holds.
        body: of the simulated configurations; kinematic, planned: of the kinematic fit and of what a planner
            made of it, or None.
    """

    motion: Motion
    scene: Scene
    model: mujoco.MjModel
    report: Report
    body: Configurations
    kinematic: Configurations | None
    planned: Configurations | None = None

    @property
    def radii_m(self) -> dict[str, float]:
        """Of the primitives that are capsules in scores."""
        return {name: float(self.model.geom(name).size[0]) for name in bones.capsule_primitives()}

    @property
    def mass_kg(self) -> float:
        """Of the body."""
        return locate(self.model).mass_kg(self.model)

    @property
    def rest_m(self) -> dict[str, float]:
        """Height of its heels and toes over the sole, by name (`comparison.Track`)."""
        return foot_rest(self.model)


def read(folder: Path | str, span: Span = WHOLE) -> Simulated:
    """Read a result folder and work out its geometry.

    Args:
        folder: of the result.
        span: what of it to keep; of a part, there is nothing that only the report says.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    result = open_result(folder)
    motion, scene, model = within(result.motion, span, str(folder)), result.scene, result.model
    parts, points = motion.contact_body, motion.joint_names
    body = configurations(model, scene, motion.qpos, parts, points, motion.qvel)
    kinematic, planned = (
        None if qpos is None else configurations(model, scene, qpos, parts, points)
        for qpos in (motion.kinematic_qpos, motion.planned_qpos)
    )
    report = result.report if span.is_all else {}
    simulated = Simulated(motion, scene, model, report, body, kinematic, planned)
    with report_file.understood(folder):
        reported(simulated)
    return simulated


def within(motion: Motion, span: Span, source: str) -> Motion:
    """The frames of a motion that lie in a span; state, control and model are those of the whole.

    Raises:
        InputError: fewer than two frames lie in it.
    """
    if span.is_all:
        return motion
    part = cutting.frames(motion.times_s, span, source)
    frames = {name: getattr(motion, name)[part] for name in BY_FRAME if getattr(motion, name) is not None}
    return replace(motion, **frames)


def reported(result: Simulated) -> Scores:
    """What only the run itself could measure."""
    values = {
        "mpjpe_2d_px": result.report.get("metrics", {}).get("mpjpe_2d_px"),
        "self_penetration_max_mm": result.report.get("audit", {}).get("self_penetration_max_mm"),
    }
    return Scores({}, {name: float(value) for name, value in values.items() if value is not None})
