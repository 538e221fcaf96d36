"""The kinematic objective and the laws of motion together, Xie 2021, eqs. 1 to 7."""

from __future__ import annotations

from simrecon.kinematics import forward, layout
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.planners.soft_contact import person, steady
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.physics import Motion, World
from simrecon.types import Array, IntArray

REACH_M = 0.25
"""Contacts farther than this from the scene, all the time, are left out: a push would cost 10⁵ times as much
as one from σ_d, and what a plan moves is centimetres."""


class Planned:
    """Loss of a clip's variables; called with the packed vector it returns loss and gradient.

    Attributes:
        problem: evidence and kinematic terms. world: of the physics. weight: of it.
        fit_com_m: (T, 3) centres of mass that the plan stays near.
        lengths: whether scale, sole and lengths move; else the gradient by them lacks the physics.
        losses: each term's share of the loss, by name, at the point of the last call.
    """

    def __init__(
        self, problem: Problem, world: World, weight: float, fit_com_m: Array, *, lengths: bool = False
    ) -> None:
        self.problem, self.world, self.weight, self.fit_com_m = problem, world, weight, fit_com_m
        self.lengths = lengths
        self.losses: dict[str, float] = {}
        self._evidence = Objective(problem)
        self._residual: Array | None = None
        self._rows: IntArray | None = None

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Loss and gradient, (n,), at the packed variables x (n,)."""
        motion, found = self.explained(x)
        loss, gradient = self._evidence(x, motion.state)
        unit = self.weight * self.problem.dt
        rough, by_wrench = steady.rate(motion.wrench, self.world.change(self.problem.dt))
        away, by_com = steady.place(motion.com_m, self.fit_com_m, self.world.scales.place_m)
        physics, held = unit * motion.loss(found), unit * (rough + away)
        points = motion.gradient(found, by_wrench, by_com)
        force, turns = forward.adjoint(self.problem.skeleton, motion.state.pose, *points)
        root, rotvecs, shared = layout.split(gradient, self.problem.frames)  # views
        root += unit * force[0]
        rotvecs += unit * turns
        self.losses = {**self._evidence.losses, "dynamics": physics, "steady": held}
        if self.lengths:
            by_person = person.gradient(motion, found, points, force)
            shared[: len(by_person)] += unit * by_person
        return loss + physics + held, gradient

    def explained(self, x: Array) -> tuple[Motion, Explained]:
        """The motion at packed variables x (n,), and the forces that explain it best."""
        motion = Motion(State(self.problem, self.problem.unpack(x)), self.world)
        if self._rows is None:
            self._rows = motion.within(REACH_M)
        found = motion.explained(self._rows, self._residual)
        self._residual = found.residual
        return motion, found
