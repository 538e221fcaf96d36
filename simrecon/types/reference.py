"""What the simulation is asked to do."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simrecon.types.arrays import Array
from simrecon.types.body import Body
from simrecon.types.camera import Camera
from simrecon.types.contact import ContactLabels, ContactTargets
from simrecon.types.scene import Scene


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
        contacts: how surely each part of the body rests on the scene, with the user's wishes over it; None
            where nobody looked.
        wished: what the user wishes of the contacts, or None.
        world: (4, 4) rigid transform from the world of the evidence to that of `scene`.
        spread_m: (2, T, M, 3) standard deviations of the body's points by the fit's curvature, across the
            line of sight and along it, without a factor (`models/evidence/bands.toml`); None: not known.
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
    contacts: ContactLabels | None = None
    wished: ContactTargets | None = None
    world: Array = field(default_factory=lambda: np.eye(4))
    spread_m: Array | None = None


@dataclass(frozen=True, eq=False)
class Reference:
    """What the simulation is asked to do: the kinematic fit, or what a planner made of it.

    Attributes:
        planner: name of the planner.
        times_s: (T,) uniform.
        qpos: (T, nq) root position, root quaternion, joint quaternions.
        com_m: (T, 3).
        contact_names: C parts of the body or contact points, none where nothing is known of contacts.
        contact: (T, C) probability that each touches, or None.
        contact_segments: (C,) segment of the body that each is on, where forces are known.
        contact_parts: (C,) primitive of the body that each is on, where forces are known.
        contact_force_N: (T, C, 3) force of the scene on it, or None.
        contact_place_m: (T, C, 3) where that acts, or None.
        contact_apart_m: (T, C) how far that is from the scene, negative inside, or None: contacts touch.
        root_wrench: (T, 6) force (N) and moment (Nm) on the root that contacts and gravity leave unexplained;
            zero obeys dynamics; None where the planner knows no dynamics.
        body: with the lengths of the plan, where these are others than the fit's, or None.
        notes: of the planner, in words: what it could not do, or took otherwise than it was asked.
    """

    planner: str
    times_s: Array
    qpos: Array
    com_m: Array
    contact_names: tuple[str, ...] = ()
    contact: Array | None = None
    contact_segments: tuple[str, ...] = ()
    contact_parts: tuple[str, ...] = ()
    contact_force_N: Array | None = None
    contact_place_m: Array | None = None
    contact_apart_m: Array | None = None
    root_wrench: Array | None = None
    body: Body | None = None
    notes: tuple[str, ...] = ()
