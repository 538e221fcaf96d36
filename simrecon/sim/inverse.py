"""Derivatives of inverse dynamics f(q, v, a, u) along the steps of a trajectory.

Under the `discrete` integrator (MuJoCo's documentation, "Computation"), with damping D and stiffness K of
joints and of motors that are below their limits,

    f = τ(q, v, a) + (h D + h² K) a + (D + h K) v - K (u - log q) - Jᵀ λ,
    λ = -d (J a - r),    ∂r/∂v = -b J,    b = (B + h K I) / (1 + h B + h² K I),

where λ are forces of rows of constraints; d is MuJoCo's `efc_D`, and K, B, I in b are its `efc_KBIP`. So all
slopes by v and a are known in closed form, and by q those of τ (`rigid`) and of motors. What something fixed
does to a body depends on where the body is: six moves of the person as a whole say how, and `reaction`
carries it to every joint. Joint limits, and what bodies that move do to each other, are differentiated by
each joint that takes part.

Inexact is this: d also depends on the inertia that a contact feels, and so on joints elsewhere; that is
left out. It matters little where a contact has settled, up to 1e-3 of the largest slope by q, but may be
much where bodies are pressed deep into each other (docs/studies/derivatives.md). Slopes by v, a and u have no
such error.

Models of which this is not known to hold are differentiated as a whole by MuJoCo.

Axes: N steps, V degrees of freedom, U motors, B bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.geometry import rotations
from simrecon.sim import reaction
from simrecon.sim.address import motor_dofs
from simrecon.sim.reaction import Reaction
from simrecon.sim.rigid import Motion, Rigid
from simrecon.sim.state import qpos_of, qvel_of
from simrecon.sim.steps import Reader, Step
from simrecon.sim.tree import BALL, FREE, SLIDE, Mask, Tree
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class ForceSlopes:
    """∂f of N steps: by tangents of q, by v and by a, (N, V, V) each, and by the control (N, V, U).

    Attributes:
        wrenches: (N, K, 6, 3 V) of what the scene does to the bodies that are felt, by q, v and a.
    """

    by_position: Array
    by_velocity: Array
    by_acceleration: Array
    by_control: Array
    wrenches: Array


class Inverse:
    """Inverse dynamics of a model; several threads may use one at a time.

    Attributes:
        model: what moves. tree: its joints.
        felt: bodies of which wrenches are asked for.
        closed: whether the closed form holds for it.
    """

    def __init__(self, model: mujoco.MjModel, felt: Sequence[int] = ()) -> None:
        """Find out what the model is made of."""
        self.model, self.tree, self.felt = model, Tree.of(model), tuple(felt)
        self.closed = _closed_form(model, self.tree)
        self._dof = motor_dofs(model)
        self._pull = np.eye(model.nv)[self._dof]  # (U, V) which motor pulls at what
        self._gear = model.actuator_gear.sum(axis=1)  # along the one axis that it has

    def slopes(self, states: Array, ctrl: Array) -> ForceSlopes:
        """Of consecutive steps from states (N + 1, nstate) under control (N, U)."""
        model, reader = self.model, Reader(self.model, self.tree)
        velocities = qvel_of(model, states)
        accelerations = np.diff(velocities, axis=0) / model.opt.timestep
        free, steps, wholes = np.zeros(ctrl.shape, np.bool_), list[Step](), list[tuple[Array, Array, Array]]()
        for index, (own, acceleration) in enumerate(zip(ctrl, accelerations, strict=True)):
            reader.place(states[index], own, acceleration)
            free[index] = reader.free()
            if self.closed:
                steps.append(reader.read(index))
            else:
                wholes.append(reader.whole())
        control = self._by_control(ctrl, free)
        if not self.closed:
            position, velocity, by_acceleration = (np.array(own) for own in zip(*wholes, strict=True))
            unknown = np.zeros((len(ctrl), len(self.felt), 6, 3 * model.nv))
            return ForceSlopes(position, velocity, by_acceleration, control, unknown)
        motion = Motion(
            axes=np.array([step.axes for step in steps]),
            inertias=np.array([step.inertias for step in steps]),
            qvel=velocities[:-1],
            qacc=accelerations,
        )
        rigid = Rigid(model, self.tree, motion)
        reactions = [own for step in steps for own in step.reactions]
        return ForceSlopes(
            *self._assembled(steps, rigid, reactions, qpos_of(model, states[:-1]), free),
            control,
            reaction.wrenches(rigid, reactions, self.felt),
        )

    def _by_control(self, ctrl: Array, free: Mask) -> Array:
        """∂f/∂u (N, V, U): motors push where neither their force nor their control is at a limit."""
        model = self.model
        low, high = model.actuator_ctrlrange.T
        within = free & ((ctrl >= low) & (ctrl <= high) | (model.actuator_ctrllimited == 0))
        slope = np.zeros((*ctrl.shape[:1], model.nv, model.nu))
        slope[:, self._dof, np.arange(model.nu)] = -model.actuator_gainprm[:, 0] * self._gear * within
        return slope

    def _assembled(
        self, steps: Sequence[Step], rigid: Rigid, reactions: Sequence[Reaction], qpos: Array, free: Mask
    ) -> tuple[Array, Array, Array]:
        """∂f/∂q, ∂f/∂v and ∂f/∂a, (N, V, V) each, in closed form, at configurations (N, nq)."""
        model, step_s, every = self.model, self.model.opt.timestep, np.arange(self.model.nv)
        stiffness, damping = np.zeros((2, len(steps), model.nv))
        stiffness += model.jnt_stiffness.ravel()[model.dof_jntid]
        damping += model.dof_damping
        gains = -model.actuator_biasprm[:, 1:3].T * self._gear**2  # (2, U)
        stiffness += (gains[0] * free) @ self._pull
        damping += (gains[1] * free) @ self._pull
        position = rigid.by_position() + self._springs(qpos, stiffness)
        position -= reaction.by_position(rigid, reactions)
        velocity = rigid.by_velocity() + np.array([step.by_velocity for step in steps])
        velocity[:, every, every] += damping + step_s * stiffness
        acceleration = np.array([step.mass + step.by_acceleration for step in steps])
        acceleration[:, every, every] += step_s * damping + step_s**2 * stiffness
        for own, step in zip(position, steps, strict=True):
            own[:, step.columns] = step.differences
        return position, velocity, acceleration

    def _springs(self, qpos: Array, stiffness: Array) -> Array:
        """∂(K log q)/∂q (N, V, V) of stiffness (N, V) at configurations (N, nq)."""
        turns = rotations.log(qpos[:, self.tree.quaternions[:, None] + np.arange(4)])  # (N, R, 3)
        blocks = stiffness[:, self.tree.turns][..., None] * rotations.log_jacobian(turns)  # (N, R, 3, 3)
        return self.tree.blocks(stiffness, blocks)


def _closed_form(model: mujoco.MjModel, tree: Tree) -> bool:
    """Whether a model has nothing of which the closed form knows nothing."""
    option, joint = model.opt, model.jnt_type[model.actuator_trnid[:, 0]]
    turning = np.isin(model.jnt_type, (BALL, FREE))
    slides = model.jnt_type[model.dof_jntid] == SLIDE
    turned = tree.carries[:, ~slides].any(axis=1)  # bodies; a lift on one that only slides is constant
    return (
        option.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
        and option.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
        and bool(mujoco.mj_isSparse(model))
        and option.density == option.viscosity == 0
        and model.neq == model.ntendon == model.nflex == 0
        and not model.dof_frictionloss.any()
        and not (model.body_gravcomp * turned).any()
        and not (model.jnt_stiffness.ravel()[: model.njnt] * turning).any()
        and bool((model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT).all())
        and bool((model.actuator_dyntype == mujoco.mjtDyn.mjDYN_NONE).all())
        and bool((model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE).all())
        and bool((joint != FREE).all())
        and bool(((model.actuator_gear != 0).sum(axis=1) == 1).all())
    )
