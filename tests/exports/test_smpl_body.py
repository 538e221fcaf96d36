"""The person's own shape in files of SMPL's family: a synthetic body model, posed as its papers state it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import cli, evidence, exports
from simrecon.body import model_file, shape
from simrecon.body.shape import ShapeSpace
from simrecon.errors import InputError
from simrecon.exports import segments, smpl, smpl_body
from simrecon.exports import view as views
from simrecon.geometry import rotations
from simrecon.job import Person
from simrecon.results import Result, open_result
from simrecon.types import Array, Body
from tests.exports.test_smpl import moved
from tests.support import plan_text, smpl_layout
from tests.support.runs import person, squat

BETAS = np.array([0.8, 1.5, -1.0, 0.6, -0.4, 0.5, 0.0, 0.3, -0.2, 0.1])
MODELS = {"SMPL_FEMALE.npz": "smpl", "SMPLX_NEUTRAL.npz": "smplx"}
FAST = {"population": 8, "generations": 2, "length_s": 0.2, "overlap_s": 0.1, "evaluations": 10}
SAME_M, NEAR_M = 0.0005, 0.015
"""For a person of just these betas, and for one who is larger or smaller than they say."""
SOLE_M = 0.02
"""Between heel and toe points, which the squat stands on, and the lowest of the skin."""


@pytest.fixture(scope="module", params=MODELS)
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A body model of SMPL, or of SMPL-X."""
    path = tmp_path_factory.mktemp("models") / request.param
    made = smpl_layout.t_pose()
    np.savez(path, **(made if MODELS[request.param] == "smpl" else smpl_layout.with_fingers(made)))
    return path


@pytest.fixture(scope="module")
def space(file: Path) -> ShapeSpace:
    return model_file.read(file)


def of_shape(space: ShapeSpace, scale: float = 1.0) -> Body:
    """A person of the model, who may be larger than their betas say."""
    skeleton = bodies.rescaled(shape.skeleton(BETAS, space), scale)
    return replace(person(), betas=BETAS, skeleton=skeleton, shape_space=space.name)


def meshes(file: Path, betas: Array, turns: Array, trans_m: Array) -> tuple[Array, Array]:
    """Mesh (G, V, 3) and joints (G, 22, 3) of the file for rotation vectors (G, 22, 3) in the parents."""
    made: dict[str, Any] = dict(np.load(file))
    count = made["kintree_table"].shape[1]
    all_turns = np.broadcast_to(np.eye(3), (len(turns), count, 3, 3)).copy()
    all_turns[:, :22] = rotations.matrix(rotations.exp(turns))
    pairs = [smpl_layout.posed(made, betas, *one) for one in zip(all_turns, trans_m, strict=True)]
    return np.array([mesh for mesh, _ in pairs]), np.array([joints[:22] for _, joints in pairs])


def of_file(file: Path, path: Path) -> tuple[Array, Array]:
    """Mesh and joints of a body model in the poses of an exported file."""
    with np.load(path, allow_pickle=False) as saved:
        keys = ("poses",) if "poses" in saved else ("root_orient", "pose_body")
        turns = np.concatenate([saved[key] for key in keys], axis=1)[:, :66].reshape(-1, 22, 3)
        return meshes(file, saved["betas"][:10], turns, saved["trans"])


def skins(space: ShapeSpace, betas: Array, posed: segments.Segments) -> Array:
    """The skin (G, V, 3) of a shape, moved by our segments: what the mesh of the file should be."""
    origins, axes = space.frames(betas)
    local = np.einsum("sji,vsj->svi", axes, space.vertices_m(betas)[:, None] - origins)
    turned = np.einsum("gsij,svj->gsvi", rotations.matrix(posed.quats), local) + posed.origins_m[:, :, None]
    return np.asarray(np.einsum("vs,gsvi->gvi", space.weights, turned))


def off_m(joints: Array, posed: segments.Segments, names: tuple[str, ...]) -> dict[str, float]:
    """By how much joints (G, 22, 3) of SMPL's tree are off ours, at most."""
    return {
        name: float(np.linalg.norm(joints[:, joint] - posed.origins_m[:, names.index(name)], axis=1).max())
        for joint, name in smpl_layout.OURS.items()
    }


@pytest.mark.parametrize("scale", [1.0, 1.08, 0.92])
def test_mesh_of_the_users_model_is_the_person(
    file: Path, space: ShapeSpace, rng: np.random.Generator, scale: float
) -> None:
    """In any pose; also if a height was given that is not that of the betas."""
    own = of_shape(space, scale)
    body = smpl_body.of_space(own, space, MODELS[file.name])
    assert body is not None
    if scale == 1.0:
        np.testing.assert_allclose(body.betas[:10], BETAS, atol=1e-6)
    posed = segments.of(own.skeleton, moved(own.skeleton, rng, 6))
    pose = smpl.pose(own.skeleton, posed, body, np.zeros((6, 2), dtype=bool), -10.0, 1 / 30)
    mesh, joints = meshes(file, body.betas[:10], pose.rotvecs[:, :22], pose.trans_m)
    off = off_m(joints, posed, own.skeleton.names)
    assert max(off.values()) < (SAME_M if scale == 1.0 else NEAR_M), off
    away = np.linalg.norm(mesh - skins(space, body.betas[:10], posed), axis=-1)
    assert away.max() < (SAME_M if scale == 1.0 else 2 * NEAR_M)


@pytest.fixture
def result(finished: Path, space: ShapeSpace, file: Path) -> Result:
    """The squat, of a person of the model."""
    found = open_result(finished)
    body = of_shape(space)
    qpos = squat(body, np.linspace(0.0, 0.9, len(found.motion.times_s)))
    points = segments.points(body.skeleton, segments.of(body.skeleton, qpos))
    qpos[:, 2] -= points[..., 2].min(axis=1)
    job = found.job
    job = replace(job, person=Person(body_model=str(file), betas=tuple(BETAS)))
    found.__dict__ |= {"body": body, "job": job, "motion": replace(found.motion, qpos=qpos)}
    return found


def test_files_hold_the_persons_shape(result: Result, file: Path, tmp_path: Path) -> None:
    """Read back from the file, the mesh of the user's model stands on the floor with our joints."""
    name = {"smpl": "amass", "smplx": "smplx"}[MODELS[file.name]]
    (path,) = exports.export(result, (name,), tmp_path)
    with np.load(path, allow_pickle=False) as saved:
        assert str(saved["gender"]) == ("female" if "FEMALE" in file.name else "neutral")
        np.testing.assert_allclose(saved["betas"][:10], BETAS, atol=1e-6)
    mesh, joints = of_file(file, path)
    view = views.of(result, views.Choices())
    off = off_m(joints, view.segments, view.body.skeleton.names)
    assert max(off.values()) < 5e-3, off
    assert np.abs(mesh[..., 2].min(axis=1)).max() < SOLE_M


@pytest.mark.slow
def test_a_run_with_a_body_model_is_exported_in_it(run: Any, file: Path, tmp_path: Path) -> None:
    """From the command to the mesh: the joints of the result are where the user's model has them."""
    clip, plan, out = tmp_path / "squat.npz", tmp_path / "fast.toml", tmp_path / "out"
    evidence.write(clip, replace(run.evidence, sha256=""))
    plan.write_text(plan_text.quick(FAST), encoding="utf-8")
    betas = "--betas=" + ",".join(map(str, BETAS))
    words = ["run", str(clip), "-o", str(out), "--plan", str(plan), "--body-model", str(file), betas]
    assert cli.main([*words, "--no-report"]) in (0, 3)
    name = {"smpl": "amass", "smplx": "smplx"}[MODELS[file.name]]
    assert cli.main(["export", str(out), "--to", name]) in (0, 3)
    view = views.of(open_result(out), views.Choices())
    _, joints = of_file(file, out / "export" / f"{name}.npz")
    off = off_m(joints, view.segments, view.body.skeleton.names)
    assert max(off.values()) < NEAR_M, off


def test_files_of_the_other_family_hold_the_average_body(result: Result, file: Path, tmp_path: Path) -> None:
    """Betas of SMPL mean nothing to SMPL-X, and the other way round."""
    name = {"smpl": "smplx", "smplx": "amass"}[MODELS[file.name]]
    (path,) = exports.export(result, (name,), tmp_path)
    with np.load(path, allow_pickle=False) as saved:
        assert not saved["betas"][1:].any()
        assert str(saved["gender"]) == "neutral"


def test_a_model_that_moved_or_changed_is_asked_for(result: Result, file: Path, tmp_path: Path) -> None:
    gone = replace(result.job, person=Person(body_model=str(tmp_path / file.name)))
    result.__dict__["job"] = gone
    with pytest.raises(InputError, match=r"found no such body model; valid: --body-model"):
        exports.export(result, ("amass",), tmp_path / "a")
    assert exports.export(result, ("amass",), tmp_path / "a", body_model=file)
    other = tmp_path / "other.npz"
    other.write_bytes(file.read_bytes())
    with pytest.raises(
        InputError, match=rf"other.npz: found another body model than the person's {file.name}"
    ):
        exports.export(result, ("smplx",), tmp_path / "a", body_model=other)
    result.__dict__["job"] = replace(gone, sha256={str((tmp_path / file.name).resolve()): "0" * 64})
    with pytest.raises(InputError, match=r"found another body model"):
        exports.export(result, ("smplx",), tmp_path / "a", body_model=file)


def test_a_model_that_serves_nothing_is_refused(finished: Path, file: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="valid: with amass or smplx"):
        exports.export(finished, ("bvh",), tmp_path, body_model=file)
    with pytest.raises(InputError, match=r"whose shape is simrecon's own; valid: leave it out"):
        exports.export(finished, ("amass",), tmp_path, body_model=file)
