"""The frozen data types that pass between the stages; the path of the data is in `reconstruct`.

Array axes: T frames, J 2D landmarks, K 3D joints, N simulation steps, P population, W windows, B joints of
the body. World: right-handed, z up. Camera: OpenCV (x right, y down, z forward). Quaternions wxyz.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera.

    Attributes:
        matrix_px: (3, 3) intrinsic matrix K.
        distortion: (5,) OpenCV coefficients k1 k2 p1 p2 k3.
        world_to_camera: (4, 4) or (T, 4, 4) rigid transform, or None where the extrinsics are unknown.
        image_size_px: (width, height).
    """

    matrix_px: Array
    distortion: Array
    world_to_camera: Array | None
    image_size_px: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one camera saw of a person (`simrecon.evidence/1`).

    Attributes:
        times_s: (T,) increasing.
        keypoint_names: J names, empty without 2D landmarks.
        keypoints_px: (T, J, 2), NaN = not seen.
        scores: (T, J) in [0, 1].
        joint_names: K names, empty without a 3D estimate.
        joints_m: (T, K, 3), NaN = unknown.
        joints_frame: `world`, `camera` or `camera_root_relative`.
        rotation_names, rotations: B names and (T, B, 4) local joint rotations, or None.
        betas, mass_kg, height_m: what is known of the person, or None.
        camera: None where no intrinsics are given.
        sha256: of the file it was read from, `""` if made in memory.
        reading: how a foreign file was understood: format, frame, up axis, unit, person.
    """

    times_s: Array
    keypoint_names: tuple[str, ...]
    keypoints_px: Array
    scores: Array
    joint_names: tuple[str, ...]
    joints_m: Array
    joints_frame: str
    rotation_names: tuple[str, ...] = ()
    rotations: Array | None = None
    betas: Array | None = None
    mass_kg: float | None = None
    height_m: float | None = None
    camera: Camera | None = None
    sha256: str = ""
    reading: str = ""


@dataclass(frozen=True, eq=False)
class Primitive:
    """One rigid shape of the body.

    Attributes:
        name: unique among the primitives.
        segment: the body it is part of: `pelvis` or the name of a joint.
        kind: `capsule` (two end points and a radius) or `box` (centre and half sizes, axes of the segment).
        points_m: capsule (2, 3) end points, box (1, 3) centre, in the frame of the segment.
        size_m: capsule (1,) radius, box (3,) half sizes.
        mass_kg: its share of the body mass.
    """

    name: str
    segment: str
    kind: str
    points_m: Array
    size_m: Array
    mass_kg: float


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The kinematic tree: a free pelvis and 16 ball joints; every joint carries the segment of its name.

    World rotation of segment b: R_b = R_parent · rest_b · q_b, with q_b the joint's rotation in `qpos`;
    its origin: o_b = o_parent + R_parent · offset_b.

    Attributes:
        names: 17 segment names, `pelvis` first, parents before children; names[1:] are also the joint names.
        parents: (17,) index of the parent, -1 for the pelvis.
        offsets_m: (17, 3) joint centre in the parent's frame; the pelvis' row is zero.
        rest: (17, 4) orientation of the segment in its parent's frame at the centre of the joint's range.
        point_names: names of the landmark points (28 of the core paper, then further joint centres).
        point_segments: (M,) segment index of each point.
        point_offsets_m: (M, 3) in the frame of the segment.
        limits_rad: (16, 3, 2) range of each component of the joint's rotation vector.
    """

    names: tuple[str, ...]
    parents: IntArray
    offsets_m: Array
    rest: Array
    point_names: tuple[str, ...]
    point_segments: IntArray
    point_offsets_m: Array
    limits_rad: Array


@dataclass(frozen=True, eq=False)
class Body:
    """A person: kinematic tree, primitives, mass, and the MJCF made of them (the person alone, no scene)."""

    betas: Array
    height_m: float
    mass_kg: float
    skeleton: Skeleton
    primitives: tuple[Primitive, ...]
    mjcf: str


@dataclass(frozen=True)
class Friction:
    """Of a surface; what is None does not act.

    Attributes:
        sliding: Coulomb coefficient.
        torsional_m: moment about the normal over normal force.
        rolling_m: moment about an axis in the surface over normal force; needs `torsional_m` too.
    """

    sliding: float = 0.9
    torsional_m: float | None = None
    rolling_m: float | None = None


@dataclass(frozen=True)
class Ground:
    """The floor: a plane.

    Attributes:
        height_m: at the world's z axis.
        friction: of its surface.
        slope_rad: angle with the horizontal; slope_yaw_rad: direction in which it rises, from +x.
        stiffness_Npm, damping_Nspm: of a compliant floor, which sinks as a whole; None: hard.
            `"fit"`: to be found from the clip, see `simrecon.softfloor`.
    """

    height_m: float = 0.0
    friction: Friction = Friction()
    slope_rad: float = 0.0
    slope_yaw_rad: float = 0.0
    stiffness_Npm: float | Literal["fit"] | None = None
    damping_Nspm: float | None = None


Value = float | int | bool | str | tuple[float, float, float]
"""Of a parameter of a scene item."""


@dataclass(frozen=True)
class SceneItem:
    """A thing that the person may touch; kinds and their parameters are in models/scene/kinds.toml.

    Attributes:
        name: unique.
        kind: such as `box`.
        position_m: centre of its footprint, at its lowest height.
        parameters: of its kind, all of them.
        yaw_rad: about z.
        friction: of its surface.
        mass_kg: of a movable thing; None: fixed.
    """

    name: str
    kind: str
    position_m: tuple[float, float, float]
    parameters: Mapping[str, Value]
    yaw_rad: float = 0.0
    friction: Friction = Friction()
    mass_kg: float | None = None


@dataclass(frozen=True)
class Scene:
    """Floor and things of `scene.toml`; files that items name lie in `folder`."""

    ground: Ground = field(default_factory=Ground)
    items: tuple[SceneItem, ...] = ()
    folder: str = field(default=".", compare=False)


@dataclass(frozen=True, eq=False)
class KinematicFit:
    """Root and joint angles of all frames, in the world of the scene; no physics yet.

    Attributes:
        body, scene: what was fitted, where.
        camera: with extrinsics resolved to the world of `scene`, or None.
        times_s: (T,) uniform.
        qpos: (T, 7 + 4 * 16) root position, root quaternion, joint quaternions.
        com_m: (T, 3).
        reprojection_px: (T, J), NaN where a landmark was not seen.
        interpolated: (T,) frames in which the person was out of view.
        iterations: of the optimiser.
        loss: at the end, by term.
    """

    body: Body
    scene: Scene
    camera: Camera | None
    times_s: Array
    qpos: Array
    com_m: Array
    reprojection_px: Array
    interpolated: NDArray[np.bool_]
    iterations: int
    loss: dict[str, float]


@dataclass(frozen=True)
class Window:
    """One piece of the clip, in simulation steps: optimised over [start, end), kept over [start, commit)."""

    index: int
    start_step: int
    commit_step: int
    end_step: int


@dataclass(frozen=True, eq=False)
class Handover:
    """What one window passes to the next: full integration state with solver warm start, and spline knots.

    Attributes:
        state: (nstate,) `mjSTATE_INTEGRATION`.
        knots_rad: (Q, nu) control offsets of the window's knots; none before the first window.
        first: index of the first of them among the knots of the clip.
    """

    state: Array
    knots_rad: Array
    first: int = 0


class WindowStatus(Enum):
    """The rule that ended the optimisation of a window."""

    GENERATIONS = "all generations used"
    AT_REST = "the loss improved by less than tol_loss"
    SMALL_STEPS = "the step size fell below tol_sigma"
    FAILED = "no rollout stayed finite"


@dataclass(frozen=True)
class Effort:
    """What a window is solved with after a fall.

    Attributes:
        retry: 0 at first; each one doubles generations and descent steps and draws other random numbers.
        until: index of the last window that is solved so, the one that fell.
    """

    retry: int = 0
    until: int = -1

    @property
    def factor(self) -> int:
        """On the numbers of generations and descent steps."""
        return int(2**self.retry)


@dataclass(frozen=True, eq=False)
class WindowResult:
    """One solved window.

    Attributes:
        window: which.
        ctrl: (commit_step - start_step, nu) the committed control.
        states: (commit_step - start_step + 1, nstate) the committed states, the first included.
        loss: best total loss; loss_terms: its weighted terms by name.
        trace: (1 + D + G,) best loss at the warm start, after each descent step and each generation.
        steps: (1 + D + G,) simulation steps spent until then.
        descent_steps: D. evaluations: rollouts done, the last one of the mean.
        seconds: wall time. stepping_s: within MuJoCo, of all threads over their number.
        handover: to the next window.
    """

    window: Window
    ctrl: Array
    states: Array
    loss: float
    loss_terms: dict[str, float]
    trace: Array
    steps: IntArray
    descent_steps: int
    evaluations: int
    seconds: float
    stepping_s: float
    status: WindowStatus
    effort: Effort
    handover: Handover


@dataclass(frozen=True, eq=False)
class Motion:
    """What `motion.npz` holds (`simrecon.result/1`); shapes and units are in docs/formats.md.

    `kinematic_qpos` (T, nq) is what the simulation was to follow; None in results of earlier versions.
    """

    times_s: Array
    frame_step: IntArray
    status: NDArray[np.uint8]
    qpos: Array
    qvel: Array
    state0: Array
    ctrl: Array
    joint_names: tuple[str, ...]
    joints_m: Array
    com_m: Array
    torque_Nm: Array
    contact_body: tuple[str, ...]
    contact_force_N: Array
    contact_point_m: Array
    contact_slip_mps: Array
    grf_N: Array
    kinematic_qpos: Array | None = None


Report = dict[str, Any]
