"""A motion as one camera and a pose network see it: evidence for the corpus of the synthesis.

The camera is that of Rempe 2020, appendix A.1: 4.5 to 7.5 m away, at a height of N(0.9, 0.3) m within 0.3 and
1.75, up to 90 degrees from the front, and looking at hip height; farther away where the person would leave
the image. The errors are of the sizes that monocular networks make: landmarks tremble, drop out and change
sides; a 3D estimate has errors of scale, lean, depth, rotation and place. The person's height and mass are
known.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import kinematics
from simrecon.evidence import from_arrays
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Array, Camera, Evidence, KinematicFit, Lens
from tools.train.contact_views import lasting, viewpoint

FOCAL_PX, SIZE_PX = 1400.0, (1280, 720)
REACH_SHARE = 0.4
"""Farthest that the person goes from the middle, as a share of the camera's distance: 88 % of the image."""
LASTING_PX, LASTING_S, WHITE_PX, DROPPED_PX, DROPPED_SHARE = 3.0, 0.2, 2.5, 25.0, 0.03
SWAP_FRAMES = 40
"""Longer clips have a moment in which the legs change sides."""
LEAN_DEG, SCALE = 5.0, 0.03
ROOT_DEG, JOINT_DEG, TURN_S = (3.5, 0.5), (7.0, 1.2), 0.4
"""Errors of rotations: those that last, and white ones."""
DEPTH_M, DEPTH_S, DEPTH_WHITE_M = 0.08, 0.8, 0.006
PLACE_M, PLACE_S, PLACE_WHITE_M = 0.015, 0.3, 0.003


def seen(fit: KinematicFit, rng: np.random.Generator) -> Evidence:
    """What is seen of a motion over a floor at z = 0.

    Args:
        fit: the motion, T frames on uniform times.
        rng: draws camera and errors.

    Returns:
        Evidence with 2D landmarks and a 3D estimate of all points of the body.
    """
    rate_hz = 1.0 / float(fit.times_s[1] - fit.times_s[0])
    marks = kinematics.configurations(fit.body, fit.qpos)[1]  # (T, M, 3)
    names = fit.body.skeleton.point_names
    camera = _camera(marks, names, rng)
    pixels, scores = _landmarks(cameras.project(camera, marks), names, rate_hz, rng)
    return from_arrays(
        fit.times_s,
        keypoint_names=names,
        keypoints_px=pixels,
        scores=scores,
        joint_names=names,
        joints_m=_estimate(fit, marks, camera, rate_hz, rng),
        camera=camera,
        height_m=fit.body.height_m,
        mass_kg=fit.body.mass_kg,
    )


def _camera(marks: Array, names: tuple[str, ...], rng: np.random.Generator) -> Camera:
    """A camera that stands still before the person of landmarks (T, M, 3)."""
    middle = marks.mean(axis=(0, 1))
    reach_m = np.linalg.norm(marks[..., :2] - middle[:2], axis=-1).max()
    eye, axes = viewpoint(marks, names, rng, reach_m / REACH_SHARE)
    transform = np.eye(4)
    transform[:3, :3] = axes
    transform[:3, 3] = -transform[:3, :3] @ eye
    width, tall = SIZE_PX
    matrix = np.array([[FOCAL_PX, 0.0, width / 2], [0.0, FOCAL_PX, tall / 2], [0.0, 0.0, 1.0]])
    return cameras.still(Lens(matrix, np.zeros(5), SIZE_PX), transform, len(marks))


def _landmarks(
    pixels: Array, names: tuple[str, ...], rate_hz: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Landmarks (T, M, 2) as a network finds them, and their scores (T, M)."""
    found = pixels + lasting(pixels.shape, LASTING_PX, LASTING_S, rate_hz, rng)
    found += WHITE_PX * rng.standard_normal(pixels.shape)
    scores = np.clip(0.92 + 0.06 * rng.standard_normal(pixels.shape[:2]), 0.05, 1.0)
    dropped = rng.random(scores.shape) < DROPPED_SHARE
    scores[dropped] = rng.uniform(0.02, 0.3, int(dropped.sum()))
    found[dropped] += DROPPED_PX * rng.standard_normal((int(dropped.sum()), 2))
    if len(found) > SWAP_FRAMES:
        first = rng.integers(5, len(found) - 10)
        rows = slice(first, first + rng.integers(2, 5))
        for name in ("hip", "knee", "ankle", "heel", "toe"):
            pair = [names.index(f"{side}_{name}") for side in ("left", "right")]
            found[rows, pair] = found[rows, pair[::-1]]
            scores[rows, pair] *= 0.6
    return found, scores


def _estimate(
    fit: KinematicFit, marks: Array, camera: Camera, rate_hz: float, rng: np.random.Generator
) -> Array:
    """A network's 3D estimate (T, M, 3), world, of a motion with landmarks (T, M, 3)."""
    turned = marks_of(fit, _misjudged(fit, camera, rate_hz, rng))
    pelvis = fit.body.skeleton.point_names.index("pelvis")
    root = marks[:, pelvis]
    ray = root - cameras.centre_m(camera)
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    frames = len(root)
    depth = lasting((frames, 1), DEPTH_M, DEPTH_S, rate_hz, rng) + rng.normal(0.0, DEPTH_M)
    depth += DEPTH_WHITE_M * rng.standard_normal((frames, 1))
    place = root + ray * depth + lasting((frames, 3), PLACE_M, PLACE_S, rate_hz, rng)
    place += PLACE_WHITE_M * rng.standard_normal((frames, 3))
    relative = turned - turned[:, [pelvis]]
    return np.asarray(place[:, None] + (1.0 + rng.normal(0.0, SCALE)) * relative)


def _misjudged(fit: KinematicFit, camera: Camera, rate_hz: float, rng: np.random.Generator) -> Array:
    """Configurations (T, nq) with errors of rotations, all of them leaning about the image's horizontal."""
    horizontal = cameras.extrinsics(camera)[0, 0, :3]
    lean = rotations.exp(np.deg2rad(rng.normal(0.0, LEAN_DEG)) * horizontal)
    quats = fit.qpos[:, 3:].reshape(len(fit.qpos), -1, 4).copy()
    for joint in range(quats.shape[1]):
        low, white = JOINT_DEG if joint else ROOT_DEG
        error_deg = lasting((len(quats), 3), low, TURN_S, rate_hz, rng)
        error_deg += white * rng.standard_normal(error_deg.shape)
        quats[:, joint] = rotations.multiply(quats[:, joint], rotations.exp(np.deg2rad(error_deg)))
    quats[:, 0] = rotations.multiply(lean, quats[:, 0])
    return np.concatenate((fit.qpos[:, :3], rotations.canonical(quats).reshape(len(quats), -1)), axis=1)


def marks_of(fit: KinematicFit, qpos: Array) -> Array:
    """Landmarks (T, M, 3) of the fit's body in configurations (T, nq)."""
    return kinematics.configurations(fit.body, qpos)[1]


def on_floor(fit: KinematicFit) -> KinematicFit:
    """The motion with its floor moved to z = 0, as those have it who see the corpus."""
    down = np.zeros(fit.qpos.shape[1])
    down[2] = fit.scene.ground.height_m
    ground = replace(fit.scene.ground, height_m=0.0)
    return replace(
        fit,
        scene=replace(fit.scene, ground=ground),
        qpos=fit.qpos - down,
        com_m=fit.com_m - down[:3],
    )
