"""The kinematic objective of a whole clip, with its analytic gradient."""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np

from simrecon import body as bodies
from simrecon import scene as scenes
from simrecon.geometry import rotations
from simrecon.kinematics import forward, terms
from simrecon.kinematics.contacts import SIGMA_TOUCH_M, ContactPoints, Places, lowest, pulls
from simrecon.kinematics.variables import Variables, leans
from simrecon.plan import Kinematics
from simrecon.prior import Prior
from simrecon.types import Array, IntArray, Scene, Skeleton

SIGMA_LIMIT_RAD = 0.1
SIGMA_PENETRATION_M = 0.01
SIGMA_BALANCE_M = 0.08
SIGMA_STILL_MPS = 0.1
SIGMA_SMOOTH_MPS2 = 20.0
SIGMA_SMOOTH_RADPS2 = 100.0
# A person is pushed sideways by friction only, and upwards by a few times body weight at most.
SIGMA_COM_MPS2 = np.array([3.0, 3.0, 10.0])
# The 3D estimate as a whole leans by some degrees, more or less so as the person turns; lengths measured in
# it are off by up to 14 per cent (BlazePose): image, floor and balance know better (docs/decisions/0010).
SIGMA_LEAN_RAD = 0.15
SIGMA_LENGTH = 0.25
FAR_M = 10.0  # in place of the infinite distance of things out of reach
SOLE_M, SIGMA_SOLE_M = 0.0, 0.015
# Frames whose loss is taken at once, which bounds memory, and frames on which a term reaches, but for one.
BLOCK, OVERLAP = 600, 2


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
        sitting: (T,) how surely the hips are still, 0 to 1.
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
    sitting: Array
    scale_sigma: float
    neutral: Array
    spread: Array
    prior: Prior

    def part(self, frames: slice | IntArray) -> Observations:
        """Those of some frames."""
        camera = self.world_to_camera
        return replace(
            self,
            rays=self.rays[:, frames],
            ray_weights=self.ray_weights[:, frames],
            world_to_camera=camera if camera is None or camera.ndim == 2 else camera[frames],
            joints_m=self.joints_m[:, frames],
            joint_weights=self.joint_weights[:, frames],
            place_m=self.place_m[frames],
            place_weights=self.place_weights[frames],
            standing=self.standing[:, frames],
            sitting=self.sitting[frames],
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

    def part(self, frames: slice) -> Objective:
        """The objective of some frames, with the priors on what all share."""
        part = copy.copy(self)
        part.base, part.leans = self.base[frames], self.leans[frames]
        part.observations = self.observations.part(frames)
        return part

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Loss and gradient, (n,), at the packed variables x (n,).

        A term is of one frame, or of up to three in a row, or a prior. So the loss of a long clip is that of
        blocks which overlap by two frames, less that of the overlaps.
        """
        frames = len(self.base)
        variables = Variables.unpack(x, frames, len(self.stretch))
        if frames <= BLOCK + OVERLAP:
            return self._loss(variables)
        loss, gradient, summed = 0.0, np.zeros_like(x), dict[str, float]()
        slopes = Variables.unpack(gradient, frames, len(self.stretch))  # views
        shared = gradient[54 * frames :]
        starts = range(0, frames - OVERLAP, BLOCK)
        blocks = [(1.0, slice(start, start + BLOCK + OVERLAP)) for start in starts]
        overlaps = [(-1.0, slice(start, start + OVERLAP)) for start in starts[1:]]
        for sign, rows in blocks + overlaps:
            part = self.part(rows)
            value, slope = part._loss(variables.part(rows))
            count = len(part.base)
            slopes.root_m[rows] += sign * slope[: 3 * count].reshape(count, 3)
            slopes.rotvecs[:, rows] += sign * slope[3 * count : 54 * count].reshape(17, count, 3)
            shared += sign * slope[54 * count :]
            loss += sign * value
            summed.update({name: summed.get(name, 0.0) + sign * part.terms[name] for name in part.terms})
        self.terms = summed
        return loss, gradient

    def _loss(self, variables: Variables) -> tuple[float, Array]:
        """Loss and gradient of all frames at once."""
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
        low = np.flatnonzero(fixed.any(axis=1))
        down = (pose.axes[segments[low]] @ fixed[low, None, :, None])[..., 0]  # (low, T, 3)
        d_sole = float(np.sum(gradient[low] * down))
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
        touch, see, w = self.contacts, self.observations, self.weights
        dt = see.interval_s
        offsets = scale * touch.offsets_m + variables.sole_m * touch.drop
        points = forward.points(pose, touch.segments, offsets)  # (G, T, 3)
        apart, normals = scenes.nearby(self.scene, points)  # (S, G, T), (S, G, T, 3)
        clearance = np.minimum(apart, FAR_M) - scale * touch.radii_m[:, None]
        loss, slope = terms.penetration(clearance, SIGMA_PENETRATION_M)
        self.terms["penetration"] = w.penetration * dt * loss
        slope *= w.penetration * dt
        self.terms["contact"] = 0.0
        for pull in pulls(touch, see.standing, see.sitting, clearance):
            loss, g = terms.touching(clearance[pull.at] + pull.depth_m, pull.sigma, pull.weights)
            self.terms["contact"] += w.contact * dt * loss
            slope[pull.at] += w.contact * dt * g
        seated, hips, fading = self._seated(clearance)
        moving, d_borne = self._motion_of_mass(points, 1 - seated)
        slope[hips] += d_borne * fading
        gradient = np.einsum("sgt,sgti->gti", slope, normals) + moving
        d_scale = -float(np.sum(slope.sum(axis=0) * scale * touch.radii_m[:, None]))
        return points, gradient, d_scale

    def _seated(self, clearance: Array) -> tuple[Array, Places, Array]:
        """How surely something but the feet bears the person (T,): hips at rest near a thing.

        With the places of the clearances (S, G, T) that say so, and minus the derivative by them.
        """
        frames = np.arange(clearance.shape[2])
        if len(clearance) == 1:  # nothing but the ground
            none = np.zeros(len(frames), np.int64)
            return np.zeros(len(frames)), (none, none, frames), np.zeros(len(frames))
        hips = lowest(self.contacts.seat.ravel(), clearance, 1)
        far = np.maximum(clearance[hips], 0.0) / SIGMA_TOUCH_M
        seated = self.observations.sitting / (1 + far**2)
        return seated, hips, seated * 2 * far / (1 + far**2) / SIGMA_TOUCH_M

    def _motion_of_mass(self, points: Array, borne: Array) -> tuple[Array, Array]:
        """Terms of the centre of mass; gradients by the contact points (G, T, 3) and by `borne` (T,)."""
        touch, w, dt = self.contacts, self.weights, self.observations.interval_s
        com = np.tensordot(touch.mass_share, points, axes=1)  # (T, 3)
        loss, g_com = terms.acceleration(com[None] / SIGMA_COM_MPS2, dt, 1.0)
        self.terms["smooth_com"] = w.smooth_com * dt * loss
        d_com = w.smooth_com * dt * g_com[0] / SIGMA_COM_MPS2  # (T, 3)
        gradient, d_borne = np.zeros_like(points), np.zeros_like(borne)
        if w.balance:
            feet = points[touch.soles].mean(axis=1)  # (2, T, 3)
            over = com - [0.0, 0.0, self.scene.ground.height_m]
            loss, g_com, g_feet, d_borne = terms.balance(
                over, feet, self.observations.standing, borne, dt, SIGMA_BALANCE_M
            )
            d_borne *= w.balance * dt
            self.terms["balance"] = w.balance * dt * loss
            d_com = d_com + w.balance * dt * g_com
            gradient[touch.soles] += w.balance * dt * g_feet[:, None] / touch.soles.shape[1]
        gradient += touch.mass_share[:, None, None] * d_com
        return gradient, d_borne

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
