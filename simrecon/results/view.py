"""A finished result, opened: everything in its folder, read when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import mujoco
import numpy as np

from simrecon import job as jobs
from simrecon import plan as plans
from simrecon import scene as scenes
from simrecon.body import clothed, known
from simrecon.drawing import overlay
from simrecon.errors import InputError
from simrecon.io.messages import shown
from simrecon.io.paths import usable
from simrecon.job import Job
from simrecon.plan import Plan
from simrecon.replay import moments
from simrecon.replay.moments import Moments
from simrecon.results import folder as folders
from simrecon.results import motion_file, plots, report_file
from simrecon.results.plots import Plots
from simrecon.sim import models
from simrecon.sim.state import state_size
from simrecon.types import Body, Motion, Report, Scene


class Result:
    """A result folder.

    Each attribute is read and checked when it is first used, and raises an `InputError` that names the file
    if it can't be.

    Attributes:
        folder: where it is.
        to_html: makes what notebooks show; `import simrecon` gives it, for pages are made of results.
    """

    to_html: ClassVar[Callable[[Result], str] | None] = None

    def __init__(self, folder: Path | str) -> None:
        """Open a result.

        Raises:
            InputError: there is no such folder, or it is no result.
        """
        self.folder = usable(folder)
        if self.folder.is_file():
            raise InputError(f"{folder}: found a file; valid: a result folder, with {folders.MOTION}")
        if not self.folder.is_dir():
            raise InputError(f"{folder}: found no such folder; valid: a result folder, with {folders.MOTION}")
        if people := folders.people(self.folder):
            names = ", ".join(map(str, people))
            raise InputError(f"{folder}: found the results of several people; valid: one of {names}")
        if not (self.folder / folders.MOTION).is_file():
            raise InputError(f"{folder}: holds no {folders.MOTION}; valid: the folder of a result")

    def __repr__(self) -> str:
        """`Result('out/clip')`."""
        return f"Result({str(self.folder)!r})"

    def _repr_html_(self) -> str | None:
        """What notebooks show, as they ask for it; None: they show `repr`."""
        make = type(self).to_html
        return None if make is None else make(self)

    @cached_property
    def motion(self) -> Motion:
        """What was simulated (`motion.npz`)."""
        return motion_file.read(self.folder)

    @cached_property
    def report(self) -> Report:
        """Settings, costs, losses and plausibility (`report.json`)."""
        return report_file.read(self.folder)

    @cached_property
    def scene(self) -> Scene:
        """The scene that was used (`scene.toml`)."""
        return scenes.read(self.folder / folders.SCENE)

    @cached_property
    def model(self) -> mujoco.MjModel:
        """Body and scene as MuJoCo compiles them (`model.xml`)."""
        path = self.folder / folders.MODEL
        model = models.load(path)
        motion = self.motion
        shape = (motion.qpos.shape[1], motion.torque_Nm.shape[1], len(motion.state0))
        own = (model.nq, model.nu, state_size(model))
        if own != shape:
            raise InputError(
                f"{self.folder / folders.MOTION}: qpos, torque_Nm, state0: hold {_listed(shape)}; "
                f"valid: those of {folders.MODEL}, {_listed(own)}"
            )
        self._check_parts({model.geom(row).name for row in range(model.ngeom)})
        return model

    @cached_property
    def body(self) -> Body:
        """The person, read back from the model; the shape parameters are those of the report."""
        path = self.folder / folders.MODEL
        text = models.text_of(path)
        person = report_file.person(self.report, self.folder / folders.REPORT)
        try:
            body = known.of_mjcf(text, person.height_m)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        self._check_person(body)
        return replace(body, betas=np.array(person.betas), shape_space=person.shape_space)

    def _check_person(self, body: Body) -> None:
        """Check that the motion is one of the person, of all parts."""
        own, path = {part.name for part in body.primitives}, self.folder / folders.MOTION
        self._check_parts(own)
        for name in sorted(own - {*self.motion.contact_body}):
            raise InputError(f"{path}: contact_body: found no {name}; valid: all parts of the person")
        found, least = self.motion.qpos.shape[1], 3 + 4 * len(body.skeleton.names)
        if found < least:
            raise InputError(f"{path}: qpos: found {found} coordinates; valid: the person's {least}, or more")

    def _check_parts(self, names: Collection[str]) -> None:
        """Check that what touches in the motion is a part of the person."""
        for name in self.motion.contact_body:
            if name not in names:
                raise InputError(
                    f"{self.folder / folders.MOTION}: contact_body: found {shown(name)}; "
                    f"valid: parts of the person in {folders.MODEL}"
                )

    @cached_property
    def plan(self) -> Plan:
        """The plan that was used, as the report has it."""
        where = f"{self.folder / folders.REPORT}: plan"
        return replace(plans.build(self.report["plan"], where), name=self.report["plan_name"])

    def moments(self, cutoff_hz: float = moments.CUTOFF_HZ) -> Moments:
        """Joint moments and powers at the frames, by inverse dynamics of the filtered motion and forces.

        Args:
            cutoff_hz: of a zero-lag low-pass filter; at most 0.8 of half the frame rate is used.

        Raises:
            InputError: nothing was simulated.
        """
        return moments.moments(self.model, self.body, self.motion, cutoff_hz)

    def animation(self, style: str = "skin") -> overlay.Animation:
        """What is drawn of the motion, in a style of `clothed.STYLES`: the body in its scene, with forces."""
        skin = clothed.skin(self.body) if style == "skin" else None
        return overlay.Animation.of(self.model, self.motion, skin=skin)

    @cached_property
    def plot(self) -> Plots:
        """Curves over time: `plot.forces()`, `.contacts()`, `.angles()`, `.moments()` (extra `plot`)."""
        return Plots(self.motion, self.body, self.moments)

    def to_pandas(self) -> Any:
        """The motion as a pandas `DataFrame` (extra `plot`), one row a frame, times in s as the index.

        Columns are named by what they hold and its unit: `com_x_m`, `root_z_m`, `left_knee_y_rad` (rotation
        vector of a joint from the middle of its range), `left_toe_z_m` (landmark), `left_knee_y_Nm` (torque
        of a motor), `grf_z_N`, `left_foot_force_z_N` and `left_foot_centre_x_m` (of the scene on a part), and
        `simulated`, whether the frame is simulated.

        Raises:
            InputError: pandas is not installed.
        """
        names = [self.model.actuator(row).name for row in range(self.model.nu)]
        return plots.table(self.motion, self.body, names)

    @cached_property
    def job(self) -> Job:
        """The job that the result is of (`job.toml`)."""
        path = self.folder / folders.JOB
        if not path.is_file():
            raise InputError(f"{self.folder}: holds no {folders.JOB}; valid: a result of this version")
        return jobs.read(path)


def _listed(sizes: tuple[int, int, int]) -> str:
    return "{} coordinates, {} motors, {} numbers of state".format(*sizes)


def open_result(folder: Path | str) -> Result:
    """Open a result folder.

    Raises:
        InputError: there is no such folder, or it is no result.
    """
    return Result(folder)
