"""Slopes of inverse dynamics in closed form, against central differences of MuJoCo's own."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.sim.models import compile_text
from simrecon.sim.rigid import Motion, Rigid
from simrecon.sim.tree import Tree
from simrecon.types import Array

JOINTS = """
<mujoco>
  <option gravity="0.5 -1 -9"/>
  <worldbody>
    <body name="free" pos="0 0 1">
      <freejoint/>
      <geom type="box" size="0.2 0.1 0.05" pos="0.02 0.01 0" mass="3"/>
      <body pos="0.2 0 0.1" euler="10 20 30">
        <joint type="slide" axis="1 0.2 0"/>
        <joint type="hinge" axis="0 1 0.3" pos="0.01 0 0"/>
        <geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.04" mass="1.5"/>
        <body pos="0.3 0.1 0">
          <joint type="slide" axis="0 0 1"/>
          <joint type="ball" pos="0 0.02 0"/>
          <geom type="ellipsoid" size="0.1 0.05 0.2" pos="0 0 0.2" mass="0.7"/>
        </body>
      </body>
      <body pos="-0.2 0 0">
        <joint type="ball"/>
        <geom type="box" size="0.1 0.02 0.03" pos="-0.1 0 0" mass="1"/>
      </body>
    </body>
    <body name="fixed" pos="1 0 0">
      <geom type="box" size="0.1 0.1 0.1"/>
      <body pos="0 0 0.3">
        <joint type="ball"/>
        <geom type="capsule" fromto="0 0 0 0 0.2 0.3" size="0.03" mass="1"/>
        <body pos="0 0.2 0.3">
          <joint type="hinge" axis="1 0 0"/>
          <joint type="hinge" axis="0 1 0"/>
          <geom type="box" size="0.05 0.06 0.07" pos="0.1 0 0" mass="2"/>
        </body>
      </body>
    </body>
    <body name="ball" pos="0 2 1"><freejoint/><geom type="sphere" size="0.1" pos="0.05 0 0" mass="1"/></body>
  </worldbody>
</mujoco>
"""
MOVE = 1e-5
STATES = 3


def person() -> str:
    skeleton = bodies.scaled({}, 1.75)
    return bodies.build(skeleton, height_m=1.75, mass_kg=70.0).mjcf


@pytest.fixture(scope="module", params=["person", "joints"])
def model(request: pytest.FixtureRequest) -> mujoco.MjModel:
    return compile_text(JOINTS if request.param == "joints" else person())


def asked(model: mujoco.MjModel, qpos: Array, qvel: Array, qacc: Array) -> tuple[mujoco.MjData, Array]:
    """Data at a state, and the forces (V,) that its acceleration asks for."""
    data, force = mujoco.MjData(model), np.empty(model.nv)
    data.qpos[:], data.qvel[:], data.qacc[:] = qpos, qvel, qacc
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_rne(model, data, 1, force)
    return data, force


def shifted(model: mujoco.MjModel, qpos: Array, move: Array) -> Array:
    moved = qpos.copy()
    mujoco.mj_integratePos(model, moved, move, 1.0)
    return moved


def test_slopes_are_those_of_central_differences(model: mujoco.MjModel, rng: np.random.Generator) -> None:
    qpos = np.stack([shifted(model, model.qpos0, rng.normal(size=model.nv)) for _ in range(STATES)])
    qvel, qacc = rng.normal(size=(2, STATES, model.nv)) * np.array([2.0, 20.0])[:, None, None]
    at = [asked(model, *state)[0] for state in zip(qpos, qvel, qacc, strict=True)]
    rigid = Rigid(
        model,
        Tree.of(model),
        Motion(np.array([data.cdof for data in at]), np.array([data.cinert for data in at]), qvel, qacc),
    )
    by_q, by_v = np.empty((2, STATES, model.nv, model.nv))
    for state, (q, v, a) in enumerate(zip(qpos, qvel, qacc, strict=True)):
        for dof, move in enumerate(MOVE * np.eye(model.nv)):
            pairs = [asked(model, shifted(model, q, sign * move), v, a)[1] for sign in (1, -1)]
            by_q[state, :, dof] = (pairs[0] - pairs[1]) / (2 * MOVE)
            pairs = [asked(model, q, v + sign * move, a)[1] for sign in (1, -1)]
            by_v[state, :, dof] = (pairs[0] - pairs[1]) / (2 * MOVE)
    for found, expected in ((rigid.by_position(), by_q), (rigid.by_velocity(), by_v)):
        np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_several_states_are_those_one_by_one(rng: np.random.Generator) -> None:
    model = compile_text(JOINTS)
    tree = Tree.of(model)
    qvel, qacc = rng.normal(size=(2, STATES, model.nv))
    moves = rng.normal(size=(STATES, model.nv))
    at = [asked(model, shifted(model, model.qpos0, move), qvel[0], qacc[0])[0] for move in moves]
    axes, inertias = np.array([data.cdof for data in at]), np.array([data.cinert for data in at])
    whole = Rigid(model, tree, Motion(axes, inertias, qvel, qacc))
    for k in range(STATES):
        own = slice(k, k + 1)
        one = Rigid(model, tree, Motion(axes[own], inertias[own], qvel[own], qacc[own]))
        np.testing.assert_allclose(whole.by_position()[own], one.by_position(), atol=1e-10)
        np.testing.assert_allclose(whole.by_velocity()[own], one.by_velocity(), atol=1e-10)


def test_masks_of_a_tree_say_what_carries_what() -> None:
    model = compile_text(JOINTS)
    tree = Tree.of(model)
    names = {name: int(model.body(name).id) for name in ("free", "fixed", "ball")}
    assert [int(tree.root[names[name]]) for name in ("free", "fixed", "ball")] == [0, -1, model.nv - 6]
    assert not tree.moved[[0, names["fixed"]]].any()
    assert tree.rooted.sum() == 12
    # of every rotation the three axes, and where its quaternion begins
    for dofs, place in zip(tree.turns, tree.quaternions, strict=True):
        move = np.zeros(model.nv)
        move[dofs] = 0.1
        changed = np.flatnonzero(shifted(model, model.qpos0, move) != model.qpos0)
        assert changed.min() >= place
        assert changed.max() <= place + 3
    assert len(tree.turns) == 5


def test_axes_move_as_the_mask_says(rng: np.random.Generator) -> None:
    """MuJoCo's axes of unit motions, about a fixed point, change with those that move them and no others."""
    model = compile_text(JOINTS)
    tree = Tree.of(model)
    base = shifted(model, model.qpos0, rng.normal(size=model.nv))
    zero = np.zeros(model.nv)

    def turns(qpos: Array) -> Array:
        return asked(model, qpos, zero, zero)[0].cdof[:, :3]

    here = turns(base)
    for dof, move in enumerate(1e-3 * np.eye(model.nv)):
        changed = np.abs(turns(shifted(model, base, move)) - here).max(axis=1) > 1e-7
        assert not (changed & ~tree.moves[:, dof]).any()


def test_rotations_of_a_tree_are_turned_by_exp(rng: np.random.Generator) -> None:
    model = compile_text(JOINTS)
    tree = Tree.of(model)
    move = rng.normal(size=model.nv)
    moved = shifted(model, model.qpos0, move)
    for dofs, place in zip(tree.turns, tree.quaternions, strict=True):
        expected = rotations.multiply(model.qpos0[place : place + 4], rotations.exp(move[dofs]))
        np.testing.assert_allclose(moved[place : place + 4], expected, atol=1e-12)
