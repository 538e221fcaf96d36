"""Steps of a trajectory as MuJoCo has them: what `inverse` needs of each, read while the data is at it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.sim import spatial
from simrecon.sim.reaction import Reaction
from simrecon.sim.state import set_state
from simrecon.sim.tree import Mask, Tree
from simrecon.types import Array, IntArray

EPSILON = 1e-9
"""Of differences by position: with larger ones rows of hard contacts let go within them."""
EPSILON_WHOLE = 1e-8
"""Of differences of all, by velocity and acceleration too, where smaller ones are rounded."""

_LIMIT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
_PUSHES = int(mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of the constraints that push in a step, R of them.

    Attributes:
        jacobian: (R, V) J. weight: (R,) d. drag: (R,) d b.
        limits: dof of joints at their limits, (V,). bodies: (R, 2) that touch, -1 where nothing does.
    """

    jacobian: Array
    weight: Array
    drag: Array
    limits: Mask
    bodies: IntArray


@dataclass(frozen=True, eq=False)
class Step:
    """What is known of one step.

    Attributes:
        axes: (V, 6) and inertias: (B, 10), MuJoCo's `cdof` and `cinert`.
        mass: (V, V). by_velocity, by_acceleration: (V, V) slopes of the constraints.
        columns: (C,) degrees of freedom by which f was differentiated; differences: (V, C) of f by those.
        reactions: of what is fixed on the bodies that touch it.
    """

    axes: Array
    inertias: Array
    mass: Array
    by_velocity: Array
    by_acceleration: Array
    columns: IntArray
    differences: Array
    reactions: Sequence[Reaction]


class Reader:
    """Reads one step after another, for one thread.

    Attributes:
        data: of the step that was put in place last.
    """

    def __init__(self, model: mujoco.MjModel, tree: Tree) -> None:
        """Make room."""
        self._model, self._tree, self.data = model, tree, mujoco.MjData(model)

    def place(self, state: Array, ctrl: Array, acceleration: Array) -> None:
        """Bring the data to a step from a state (nstate,), under ctrl (U,), with its acceleration (V,)."""
        model, data = self._model, self.data
        set_state(model, data, state)
        data.ctrl[:], data.qacc[:] = ctrl, acceleration
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_inverseSkip(model, data, mujoco.mjtStage.mjSTAGE_VEL, True)

    def free(self) -> Mask:
        """Motors (U,) below their largest force."""
        low, high = self._model.actuator_forcerange.T
        force = self.data.actuator_force
        below: Mask = (force > low) & (force < high) | (self._model.actuator_forcelimited == 0)
        return below

    def whole(self) -> tuple[Array, Array, Array]:
        """Slopes of f by q, v and a, (V, V) each, by differences of all; the data is elsewhere after it."""
        by_q, by_v, by_a = np.empty((3, self._model.nv, self._model.nv))
        whole = by_q, by_v, by_a, None, None, None, None
        mujoco.mjd_inverseFD(self._model, self.data, EPSILON_WHOLE, True, *whole)
        return by_q.T, by_v.T, by_a.T

    def read(self, index: int) -> Step:
        """The step in place, the `index`-th of those that are read; the data is elsewhere after it."""
        model, data = self._model, self.data
        axes, inertias, centres = data.cdof.copy(), data.cinert.copy(), data.subtree_com.copy()
        mass, by_velocity, by_acceleration = np.zeros((3, model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        columns, differences = np.zeros(0, np.int64), np.zeros((model.nv, 0))
        reactions: list[Reaction] = []
        rows = self._rows()
        if rows is not None:
            by_velocity = rows.jacobian.T @ (rows.drag[:, None] * rows.jacobian)
            by_acceleration = rows.jacobian.T @ (rows.weight[:, None] * rows.jacobian)
            columns, touching = self._to_move(rows)
            differences, wrench, changes = self._moved(columns, bool(touching))
            for body, own in touching.items():
                six = slice(self._tree.root[body], self._tree.root[body] + 6)
                first = int(np.searchsorted(columns, six.start))
                each = np.linalg.solve(axes[six], rows.jacobian[own, six].T)  # (6, R') wrenches of the rows
                reactions.append(
                    Reaction(
                        step=index,
                        body=body,
                        root=six.start,
                        centre=centres[model.body_rootid[body]],
                        wrench=wrench[body],
                        changes=changes[first : first + 6, body],
                        by_velocity=-(each * rows.drag[own]) @ each.T,
                        by_push=-(each * rows.weight[own]) @ each.T,
                    )
                )
        return Step(
            axes, inertias, mass, by_velocity, by_acceleration, columns, differences, tuple(reactions)
        )

    def _rows(self) -> Rows | None:
        """What pushes; None if nothing does."""
        model, data, step_s = self._model, self.data, self._model.opt.timestep
        pushing = np.flatnonzero(data.efc_state == _PUSHES)
        if not len(pushing):
            return None
        dense = np.zeros((data.nefc, model.nv))
        mujoco.mju_sparse2dense(dense, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        weight, (k, b, impedance) = data.efc_D[pushing], data.efc_KBIP[pushing, :3].T
        drag = (b + step_s * k * impedance) / (1 + step_s * b + step_s**2 * k * impedance)
        limits, ids = data.efc_type[pushing] == _LIMIT, data.efc_id[pushing]
        bodies = np.full((len(pushing), 2), -1)
        if not limits.all():
            bodies[~limits] = model.geom_bodyid[data.contact.geom[ids[~limits]]]
        return Rows(dense[pushing], weight, weight * drag, np.isin(model.dof_jntid, ids[limits]), bodies)

    def _to_move(self, rows: Rows) -> tuple[IntArray, Mapping[int, list[int]]]:
        """Degrees of freedom (C,) to move; rows by which bodies of free trees touch what is fixed."""
        tree, columns, touching = self._tree, rows.limits.copy(), dict[int, list[int]]()
        for row, (one, other) in enumerate(rows.bodies.tolist()):
            if one < 0:
                continue
            if tree.moved[one] and tree.moved[other]:
                columns |= tree.carries[one] ^ tree.carries[other]
                continue
            body = one if tree.moved[one] else other
            if tree.root[body] < 0:
                columns |= tree.carries[body]
            else:
                columns |= tree.roots[body]
                touching.setdefault(body, []).append(row)
        return np.flatnonzero(columns), touching

    def _moved(self, columns: IntArray, wrenches: bool) -> tuple[Array, Array, Array]:
        """Differences (V, C) of f, what contacts do to bodies (B, 6), and how that changes (C, B, 6)."""
        model, data, count = self._model, self.data, len(columns)
        start, force = data.qpos.copy(), data.qfrc_inverse - data.qfrc_actuator
        differences = np.empty((model.nv, count))
        wrench, centre = np.zeros((1 + count, model.nbody, 6)), np.zeros((1 + count, model.nbody, 3))

        def record(place: int) -> None:
            mujoco.mj_rnePostConstraint(model, data)
            wrench[place], centre[place] = data.cfrc_ext, data.subtree_com

        if wrenches:
            record(0)
        move, moved = np.zeros(model.nv), np.empty_like(start)
        for place, dof in enumerate(columns.tolist()):
            move[dof] = EPSILON
            moved[:] = start
            mujoco.mj_integratePos(model, moved, move, 1.0)
            move[dof] = 0.0
            data.qpos[:] = moved
            mujoco.mj_inverseSkip(model, data, mujoco.mjtStage.mjSTAGE_NONE, True)
            mujoco.mj_fwdActuation(model, data)
            differences[:, place] = (data.qfrc_inverse - data.qfrc_actuator - force) / EPSILON
            if wrenches and self._tree.rooted[dof]:
                record(1 + place)
        shift = (centre - centre[0])[:, model.body_rootid]  # wrenches are about the centre of mass of a tree
        wrench[..., :3] += spatial.cross(shift, wrench[..., 3:])
        return differences, wrench[0], (wrench[1:] - wrench[0]) / EPSILON
