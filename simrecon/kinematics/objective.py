"""The kinematic objective of a whole clip, with its analytic gradient."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon import body as bodies
from simrecon import rotations
from simrecon import scene as scenes
from simrecon.kinematics import forward, terms
from simrecon.plan import Kinematics
from simrecon.prior import Prior
from simrecon.types import Array, IntArray, Primitive, Scene, Skeleton

SIGMA_LIMIT_RAD = 0.1
SIGMA_PENETRATION_M = 0.01
SIGMA_TOUCH_M = 0.05
SIGMA_STAND_M = 0.1
SIGMA_BALANCE_M = 0.08
SIGMA_STILL_MPS = 0.1
SIGMA_SMOOTH_MPS2 = 20.0
SIGMA_SMOOTH_RADPS2 = 100.0
# A person is pushed sideways by friction only, and upwards by a few times body weight at most.
SIGMA_COM_MPS2 = np.array([3.0, 3.0, 10.0])
# The 3D estimate as a whole leans by some degrees, more or less so as the person turns; lengths measured in
# it are off by up to 14 per cent (BlazePose): image, floor and balance know better (docs/decisions/0010).
SIGMA_LEAN_RAD, LEAN_PERIOD_S = 0.15, 1.0
LEANS_MAX = 32  # of 16 s; in a longer clip the lean changes more slowly, or cost would grow with the square
SIGMA_LENGTH = 0.25
SOLE_M, SIGMA_SOLE_M = 0.0, 0.015


@dataclass(frozen=True, eq=False)
class Observations:
    """What the pose is held against; M points of the body, T frames.

    Attributes:
        interval_s: between frames.
        rays: (M, T, 2) undistorted detections x/z, y/z; ray_weights: (M, T); ray_sigma: in the same units.
        world_to_camera: (4, 4) or (T, 4, 4), or None without 2D landmarks.
        joints_m: (M, T, 3) 3D estimate, world axes, relative to its root; joint_weights: (M, T).
        place_m: (T, 3) where the 3D estimate puts its root; place_weights: (T,).
        root_weights: (M,) with which points' mean is the root of the 3D estimate.
        standing: (2, T) how surely the left and the right foot stand still, 0 to 1.
        scale_sigma: how well the skeleton's scale is known (natural logarithm).
        neutral, spread: (16, 3) of the joints' rotation vectors: where the search begins, its scale.
        prior: on poses.
    """

    interval_s: float
    rays: Array
    ray_weights: Array
    ray_sigma: float
    world_to_camera: Array | None
    joints_m: Array
    joint_weights: Array
    place_m: Array
    place_weights: Array
    root_weights: Array
    standing: Array
    scale_sigma: float
    neutral: Array
    spread: Array
    prior: Prior


@dataclass(frozen=True, eq=False)
class Variables:
    """Unknowns of the fit.

    Attributes:
        root_m: (T, 3); rotvecs: (17, T, 3).
        log_scale: natural logarithm of the skeleton's scale; sole_m: how far the sole is below its place.
        lengths: (L,) natural logarithms of factors on the skeleton's lengths (`bodies.length_offsets`).
        lean: (F, 3) cosine coefficients of the rotation vector by which the 3D estimate is turned.
    """

    root_m: Array
    rotvecs: Array
    log_scale: float
    sole_m: float
    lengths: Array
    lean: Array

    def pack(self) -> Array:
        """As one vector."""
        shared = ([self.log_scale, self.sole_m], self.lengths, self.lean.ravel())
        return np.concatenate((self.root_m.ravel(), self.rotvecs.ravel(), *shared))

    @staticmethod
    def unpack(x: Array, frames: int, lengths: int) -> Variables:
        """From one vector of `frames` frames and `lengths` lengths."""
        places, shared = 3 * frames, 54 * frames
        return Variables(
            x[:places].reshape(frames, 3),
            x[places:shared].reshape(17, frames, 3),
            float(x[shared]),
            float(x[shared + 1]),
            x[shared + 2 : shared + 2 + lengths],
            x[shared + 2 + lengths :].reshape(-1, 3),
        )


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Spheres that stand for the primitives where they may touch the scene.

    Attributes:
        segments: (G,); offsets_m: (G, 3); radii_m: (G,).
        drop: (G, 3) how the point moves as the sole goes down by a metre.
        mass_share: (G,) weights whose mean of the points is the centre of mass.
        soles: (2, 4) rows of the corners of the left and the right sole.
    """

    segments: IntArray
    offsets_m: Array
    radii_m: Array
    drop: Array
    mass_share: Array
    soles: IntArray


def contact_points(skeleton: Skeleton, primitives: tuple[Primitive, ...]) -> ContactPoints:
    """Ends of the capsules and corners of the boxes; `primitives` made with sole_m = 0."""
    segments, offsets, radii, sole, owner, mass = [], [], [], [], [], []
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for part in primitives:
        capsule = part.kind == "capsule"
        places = part.points_m if capsule else part.points_m + signs * part.size_m
        for place in places:
            segments.append(skeleton.names.index(part.segment))
            offsets.append(place)
            radii.append(part.size_m[0] if capsule else 0.0)
            sole.append(float(part.name.endswith("_foot")))
            owner.append(part.name)
            mass.append(part.mass_kg / len(places))
    parts = np.array(owner)
    drop = np.outer(sole, [0.0, 0.0, -1.0])
    # corners with the lower sign of z come first in every pair
    soles = np.array([np.flatnonzero(parts == f"{side}_foot")[::2] for side in ("left", "right")])
    return ContactPoints(
        np.array(segments),
        np.array(offsets),
        np.array(radii),
        drop,
        np.array(mass) / sum(mass),
        soles,
    )


class Objective:
    """Loss of a clip's kinematic variables; called with the packed vector it returns loss and gradient."""

    def __init__(
        self,
        skeleton: Skeleton,
        contacts: ContactPoints,
        scene: Scene,
        base: Array,
        observations: Observations,
        weights: Kinematics,
        *,
        lengths: bool = True,
    ) -> None:
        """Hold the problem.

        Args:
            skeleton: unscaled.
            contacts: points of its primitives.
            scene: what they may touch.
            base: (T, 3, 3) orientation from which the root's rotation is counted.
            observations: evidence.
            weights: and scales of the plan.
            lengths: whether the skeleton's lengths are unknowns; else L is 0.
        """
        self.skeleton, self.contacts, self.scene = skeleton, contacts, scene
        self.base, self.observations, self.weights = base, observations, weights
        self.terms: dict[str, float] = {}
        ends = [name.endswith(("_heel", "_toe")) for name in skeleton.point_names]
        self.feet = np.flatnonzero(ends)
        count = None if lengths else 0
        self.tallness = bodies.length_shares(skeleton)[:count]  # (L,)
        self.stretch = bodies.length_offsets(skeleton)[:count]  # (L, 17, 3)
        self.leans = leans(len(base), observations.interval_s)  # (T, F)
        self.drop = np.outer(ends, [0.0, 0.0, -1.0])  # (M, 3) landmarks that go down with the sole

    def pose(self, variables: Variables) -> forward.Pose:
        """Forward kinematics at the variables."""
        scale = float(np.exp(variables.log_scale))
        person = self.person(variables)
        return forward.forward(person, variables.root_m, self.base, variables.rotvecs, scale)

    def person(self, variables: Variables) -> Skeleton:
        """The skeleton with the lengths of the variables, unscaled."""
        longer = np.tensordot(np.expm1(variables.lengths), self.stretch, axes=1)
        return replace(self.skeleton, offsets_m=self.skeleton.offsets_m + longer)

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Loss and gradient, (n,), at the packed variables x (n,)."""
        variables = Variables.unpack(x, len(self.base), len(self.stretch))
        scale = float(np.exp(variables.log_scale))
        pose = self.pose(variables)
        self.terms = {}
        marks, d_marks, d_scale, d_lean = self._marks(pose, variables, scale)
        touch, d_touch, d_touch_scale = self._contacts(pose, variables, scale)
        segments = np.concatenate((self.skeleton.point_segments, self.contacts.segments))
        points = np.concatenate((marks, touch))
        gradient = np.concatenate((d_marks, d_touch))
        force, d_rotvecs = forward.adjoint(self.skeleton, pose, segments, points, gradient)
        # all lengths grow with exp(log_scale), so a point moves by its distance from the root
        d_scale += d_touch_scale + float(np.sum(gradient * (points - variables.root_m)))
        fixed = np.concatenate((self.drop, self.contacts.drop))  # (M + G, 3)
        down = (pose.axes[segments] @ fixed[:, None, :, None])[..., 0]  # (M + G, T, 3)
        d_sole = float(np.sum(gradient * down))
        # the sole's height does not grow with the scale
        d_scale -= variables.sole_m * d_sole
        d_lengths = self._longer(pose, variables, scale, force)
        shared = self._shared(variables)
        d_rotvecs += self._joint_space(variables)
        ends = np.concatenate(([d_scale, d_sole], d_lengths, d_lean.ravel())) + shared
        return sum(self.terms.values()), np.concatenate((force[0].ravel(), d_rotvecs.ravel(), ends))

    def _longer(self, pose: forward.Pose, variables: Variables, scale: float, force: Array) -> Array:
        """Gradient of the lengths (L,): all below a joint moves with its offset; force (17, T, 3) on it."""
        parents = self.skeleton.parents[1:]
        local = np.einsum("btji,btj->bi", pose.axes[parents], force[1:])  # (16, 3) Σ_t R_parentᵀ f
        along = np.einsum("lbi,bi->l", self.stretch[:, 1:], local)
        return np.asarray(scale * np.exp(variables.lengths) * along)

    def _marks(
        self, pose: forward.Pose, variables: Variables, scale: float
    ) -> tuple[Array, Array, float, Array]:
        """Terms of the landmark points: positions, gradients of them, of log scale but for them, of lean."""
        see, w = self.observations, self.weights
        offsets = scale * self.skeleton.point_offsets_m + variables.sole_m * self.drop
        marks = forward.points(pose, self.skeleton.point_segments, offsets)  # (M, T, 3)
        gradient = np.zeros_like(marks)
        d_scale, d_lean, dt = 0.0, np.zeros_like(variables.lean), see.interval_s
        if see.world_to_camera is not None and w.keypoint:
            loss, g = terms.reprojection(marks, see.rays, see.ray_weights, see.world_to_camera, see.ray_sigma)
            self.terms["keypoint"] = w.keypoint * dt * loss
            gradient += w.keypoint * dt * g
        if see.joint_weights.any():
            root = np.tensordot(see.root_weights, marks, axes=1)  # (T, 3)
            turn = self.leans @ variables.lean  # (T, 3)
            targets = scale * forward.turned(turn, see.joints_m)  # (M, T, 3)
            loss, g = terms.distance(marks - root, targets, see.joint_weights, w.joint_scale_m)
            self.terms["joint"] = w.joint * dt * loss
            g *= w.joint * dt
            gradient += g - see.root_weights[:, None, None] * g.sum(axis=0)
            d_scale -= float(np.sum(g * targets))
            moment = -forward.cross(targets, g).sum(axis=0)  # (T, 3)
            d_lean = (
                self.leans.T @ (rotations.left_jacobian(turn).swapaxes(-1, -2) @ moment[..., None])[..., 0]
            )
            loss, g_root = terms.distance(root, see.place_m, see.place_weights, w.place_scale_m)
            self.terms["place"] = w.place * dt * loss
            gradient += w.place * dt * see.root_weights[:, None, None] * g_root
        loss, g = terms.still(marks[self.feet], dt, SIGMA_STILL_MPS)
        self.terms["still"] = w.still * dt * loss
        gradient[self.feet] += w.still * dt * g
        loss, g = terms.acceleration(marks, dt, SIGMA_SMOOTH_MPS2)
        self.terms["smooth_position"] = w.smooth_position * dt * loss
        gradient += w.smooth_position * dt * g
        if w.travel_position:
            loss, g = terms.travel(marks, dt)
            self.terms["travel_position"] = w.travel_position * dt * loss
            gradient += w.travel_position * dt * g
        return marks, gradient, d_scale, d_lean

    def _contacts(self, pose: forward.Pose, variables: Variables, scale: float) -> tuple[Array, Array, float]:
        """Terms of the contact points: positions, gradient, and the gradient of log scale by their radii."""
        touch, w, dt = self.contacts, self.weights, self.observations.interval_s
        offsets = scale * touch.offsets_m + variables.sole_m * touch.drop
        points = forward.points(pose, touch.segments, offsets)  # (G, T, 3)
        apart, normals = scenes.nearby(self.scene, points)  # (S, G, T), (S, G, T, 3)
        clearance = apart - scale * touch.radii_m[:, None]
        loss, slope = terms.penetration(clearance, SIGMA_PENETRATION_M)
        self.terms["penetration"] = w.penetration * dt * loss
        slope *= w.penetration * dt
        # The lowest point of the body, and the soles of feet that stand still (in the manner of eq. 6, 7).
        frames = np.arange(clearance.shape[2])
        lowest = np.argmin(clearance.reshape(-1, len(frames)), axis=0)  # (T,)
        closest = (*np.unravel_index(lowest, clearance.shape[:2]), frames)
        loss, g = terms.touching(clearance[closest], SIGMA_TOUCH_M)
        slope[closest] += w.contact * dt * g
        soles = touch.soles.ravel()
        corners = touch.soles.shape[1]
        share = np.repeat(self.observations.standing, corners, axis=0) / corners  # (8, T)
        thing = np.argmin(np.abs(clearance[:, soles]), axis=0)  # (8, T)
        stand = (thing, soles[:, None], frames[None])
        more, g = terms.touching(clearance[stand], SIGMA_STAND_M, share)
        slope[stand] += w.contact * dt * g
        self.terms["contact"] = w.contact * dt * (loss + more)
        gradient = np.einsum("sgt,sgti->gti", slope, normals)
        gradient += self._motion_of_mass(points)
        d_scale = -float(np.sum(slope.sum(axis=0) * scale * touch.radii_m[:, None]))
        return points, gradient, d_scale

    def _motion_of_mass(self, points: Array) -> Array:
        """Terms of the centre of mass; returns their gradient, (G, T, 3), by the contact points."""
        touch, w, dt = self.contacts, self.weights, self.observations.interval_s
        com = np.tensordot(touch.mass_share, points, axes=1)  # (T, 3)
        loss, g_com = terms.acceleration(com[None] / SIGMA_COM_MPS2, dt, 1.0)
        self.terms["smooth_com"] = w.smooth_com * dt * loss
        d_com = w.smooth_com * dt * g_com[0] / SIGMA_COM_MPS2  # (T, 3)
        gradient = np.zeros_like(points)
        if w.balance:
            feet = points[touch.soles].mean(axis=1)  # (2, T, 3)
            over = com - [0.0, 0.0, self.scene.ground.height_m]
            loss, g_com, g_feet = terms.balance(over, feet, self.observations.standing, dt, SIGMA_BALANCE_M)
            self.terms["balance"] = w.balance * dt * loss
            d_com = d_com + w.balance * dt * g_com
            gradient[touch.soles] += w.balance * dt * g_feet[:, None] / touch.soles.shape[1]
        gradient += touch.mass_share[:, None, None] * d_com
        return gradient

    def _shared(self, variables: Variables) -> Array:
        """Priors on scale, sole, lengths and lean; returns their gradient, (2 + L + 3 F,)."""
        see = self.observations
        # what changes the lengths should leave the stature as it is known
        tall = variables.log_scale + float(self.tallness @ variables.lengths)
        offset = (variables.sole_m - SOLE_M) / SIGMA_SOLE_M
        self.terms["shared"] = offset**2 + (tall / see.scale_sigma) ** 2
        self.terms["lengths"] = float(np.sum(variables.lengths**2)) / SIGMA_LENGTH**2
        self.terms["lean"] = float(np.sum(variables.lean**2)) / SIGMA_LEAN_RAD**2
        d_tall = 2 * tall / see.scale_sigma**2
        d_lengths = d_tall * self.tallness + 2 * variables.lengths / SIGMA_LENGTH**2
        d_lean = 2 * variables.lean / SIGMA_LEAN_RAD**2
        return np.concatenate(([d_tall, 2 * offset / SIGMA_SOLE_M], d_lengths, d_lean.ravel()))

    def _joint_space(self, variables: Variables) -> Array:
        """Terms of the rotation vectors themselves; returns their gradient (17, T, 3)."""
        see, w, dt = self.observations, self.weights, self.observations.interval_s
        gradient = np.zeros_like(variables.rotvecs)
        joints = variables.rotvecs[1:]  # (16, T, 3)
        low, high = (self.skeleton.limits_rad[:, None, :, side] for side in (0, 1))
        loss, g = terms.outside(joints, low, high, SIGMA_LIMIT_RAD)
        self.terms["limit"] = w.limit * dt * loss
        gradient[1:] += w.limit * dt * g
        loss, g = terms.acceleration(joints, dt, SIGMA_SMOOTH_RADPS2)
        self.terms["smooth_rotation"] = w.smooth_rotation * dt * loss
        gradient[1:] += w.smooth_rotation * dt * g
        if w.travel_rotation:
            loss, g = terms.travel(joints, dt)
            self.terms["travel_rotation"] = w.travel_rotation * dt * loss
            gradient[1:] += w.travel_rotation * dt * g
        if w.prior:
            squared, g = see.prior.squared(np.swapaxes(joints, 0, 1))
            self.terms["prior"] = w.prior * dt * float(np.sum(squared))
            gradient[1:] += w.prior * dt * np.swapaxes(g, 0, 1)
        return gradient


def leans(frames: int, interval_s: float) -> Array:
    """Slow cosines of a clip (T, F), the first one constant; each of root mean square one."""
    count = min(1 + int(2 * frames * interval_s / LEAN_PERIOD_S), LEANS_MAX)
    phase = np.pi * (np.arange(frames)[:, None] + 0.5) / frames * np.arange(min(count, frames))  # (T, F)
    return np.where(np.arange(phase.shape[1]) > 0, np.sqrt(2.0), 1.0) * np.cos(phase)


def to_qpos(root_m: Array, base: Array, rotvecs: Array) -> Array:
    """Joint configuration (T, 7 + 4·16) of MuJoCo from the fit's variables."""
    root = rotations.canonical(rotations.multiply(rotations.from_matrix(base), rotations.exp(rotvecs[0])))
    joints = rotations.exp(np.swapaxes(rotvecs[1:], 0, 1))  # (T, 16, 4)
    return np.concatenate((root_m, root, joints.reshape(len(root_m), -1)), axis=1)
