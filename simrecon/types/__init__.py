"""The frozen data types that pass between the stages, one module each; `pipeline` is their path.

Array axes: T frames, J 2D landmarks, K 3D joints, N simulation steps, P population, W windows, B joints of
the body, C parts in contact. World: right-handed, z up. Camera: OpenCV (x right, y down, z forward).
Quaternions wxyz.
"""

from __future__ import annotations

from simrecon.types.arrays import Array, Flags, IntArray, runs
from simrecon.types.body import Body, Primitive, Skeleton
from simrecon.types.camera import Camera, Lens
from simrecon.types.contact import ContactLabels, ContactTargets, ContactWish, Interval
from simrecon.types.evidence import Evidence, Part
from simrecon.types.frozen import FrozenMap, frozen
from simrecon.types.motion import Motion, Report
from simrecon.types.reference import KinematicFit, Reference
from simrecon.types.scene import Friction, Ground, Scene, SceneItem, Value
from simrecon.types.window import Effort, Handover, Spread, Window, WindowResult, WindowStatus

__all__ = [
    "Array",
    "Body",
    "Camera",
    "ContactLabels",
    "ContactTargets",
    "ContactWish",
    "Effort",
    "Evidence",
    "Flags",
    "Friction",
    "FrozenMap",
    "Ground",
    "Handover",
    "IntArray",
    "Interval",
    "KinematicFit",
    "Lens",
    "Motion",
    "Part",
    "Primitive",
    "Reference",
    "Report",
    "Scene",
    "SceneItem",
    "Skeleton",
    "Spread",
    "Value",
    "Window",
    "WindowResult",
    "WindowStatus",
    "frozen",
    "runs",
]
