"""How positions move on over a step, and how points of a body move with the coordinates."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from simrecon.sim.derivatives import PointSlopes, by_offset, by_start
from simrecon.sim.models import compile_text
from simrecon.sim.poses import posed
from simrecon.sim.tree import Tree
from simrecon.types import Array

XML = """
<mujoco>
  <worldbody>
    <body name="post" pos="0 3 0"><joint type="hinge"/><geom size="0.1" mass="4"/></body>
    <body name="trunk" pos="0 0 1">
      <freejoint/>
      <geom type="capsule" fromto="-0.2 0 0 0.2 0.1 0" size="0.1" mass="5"/>
      <site name="front" pos="0.2 0 0.1"/>
      <body name="arm" pos="0.3 0 0">
        <joint type="ball"/>
        <geom type="box" pos="0.15 0 0" size="0.15 0.04 0.04" mass="1"/>
        <site name="elbow" pos="0.3 0 0"/>
        <body pos="0.3 0 0">
          <joint type="hinge" axis="0 1 0.2"/><joint type="slide" axis="1 0 0"/>
          <geom type="box" pos="0.1 0 0" size="0.1 0.04 0.04" mass="2"/>
          <site name="hand" pos="0.2 0.05 0"/>
        </body>
      </body>
      <body name="leg" pos="-0.3 0 0">
        <joint type="ball"/>
        <geom type="box" pos="-0.15 0 0" size="0.15 0.04 0.04" mass="3"/>
        <site name="toe" pos="-0.3 0 0.02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
MOVE = 1e-6


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return compile_text(XML)


def shifted(model: mujoco.MjModel, qpos: Array, move: Array) -> Array:
    moved = qpos.copy()
    mujoco.mj_integratePos(model, moved, np.ascontiguousarray(move), 1.0)
    return moved


@pytest.fixture
def qpos(model: mujoco.MjModel, rng: np.random.Generator) -> Array:
    return shifted(model, model.qpos0, rng.normal(size=model.nv))


def tangent(model: mujoco.MjModel, base: Array, moved: Array) -> Array:
    tangent = np.empty(model.nv)
    mujoco.mj_differentiatePos(model, tangent, 1.0, base, moved)
    return tangent


@pytest.mark.parametrize("size", [0.0, 1e-6, 0.1, 1.0])
def test_moves_change_with_where_they_start_and_how_far_they_go(
    model: mujoco.MjModel, qpos: Array, rng: np.random.Generator, size: float
) -> None:
    offset, tree, nv = size * rng.normal(size=model.nv), Tree.of(model), model.nv
    after, start, way = shifted(model, qpos, offset), np.empty((nv, nv)), np.empty((nv, nv))
    for dof, move in enumerate(MOVE * np.eye(nv)):
        for slope, ends in (
            (start, [shifted(model, shifted(model, qpos, sign * move), offset) for sign in (1, -1)]),
            (way, [shifted(model, qpos, offset + sign * move) for sign in (1, -1)]),
        ):
            pair = [tangent(model, after, end) for end in ends]
            slope[:, dof] = (pair[0] - pair[1]) / (2 * MOVE)
    np.testing.assert_allclose(by_start(tree, offset[None])[0], start, rtol=0, atol=1e-8)
    np.testing.assert_allclose(by_offset(tree, offset[None], np.eye(nv)[None])[0], way, rtol=0, atol=1e-8)
    some = rng.normal(size=(1, nv, 3))
    np.testing.assert_allclose(by_offset(tree, offset[None], some)[0], way @ some[0], rtol=0, atol=1e-7)


@pytest.mark.parametrize("root", ["trunk", "arm"])
def test_points_and_the_centre_of_mass_move_as_differences_say(
    model: mujoco.MjModel, qpos: Array, root: str
) -> None:
    body, sites = int(model.body(root).id), np.array([2, 0, 3])
    data = next(posed(model, qpos[None]))
    points, com = PointSlopes(model, Tree.of(model), sites, body).at(data)
    assert (points.shape, com.shape) == ((3, 3, model.nv), (3, model.nv))
    by_point, by_com = np.empty_like(points), np.empty_like(com)
    for dof, move in enumerate(MOVE * np.eye(model.nv)):
        pair = [
            (data.site_xpos[sites].copy(), data.subtree_com[body].copy())
            for data in posed(model, np.stack([shifted(model, qpos, sign * move) for sign in (1, -1)]))
        ]
        by_point[..., dof] = (pair[0][0] - pair[1][0]) / (2 * MOVE)
        by_com[:, dof] = (pair[0][1] - pair[1][1]) / (2 * MOVE)
    np.testing.assert_allclose(points, by_point, rtol=0, atol=1e-8)
    np.testing.assert_allclose(com, by_com, rtol=0, atol=1e-8)


def test_what_does_not_carry_a_point_does_not_move_it(model: mujoco.MjModel, qpos: Array) -> None:
    body = int(model.body("trunk").id)
    points, com = PointSlopes(model, Tree.of(model), np.arange(model.nsite), body).at(
        next(posed(model, qpos[None]))
    )
    hinge, leg = 0, slice(model.nv - 3, model.nv)
    assert not points[..., hinge].any()
    assert not com[:, hinge].any()
    assert not points[:3, :, leg].any()
    assert points[3, :, leg].any()
    np.testing.assert_allclose(com[:, 1:4], np.eye(3), atol=1e-15)
