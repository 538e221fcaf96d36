"""What one camera saw of a person."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon.types.arrays import Array
from simrecon.types.camera import Camera


@dataclass(frozen=True)
class Part:
    """Which frames of its source a piece of evidence holds: `first`, `first + every`, …, counted from 0 on.

    Attributes:
        first: number of its first frame there.
        every: from one of its frames to the next; 1: none is left out.
        count: of the frames of the source, 0 where the source does not say.
    """

    first: int
    every: int
    count: int


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
        mass_kg, height_m: what is known of the person, or None.
        lengths_m: lengths that the source states of the person, by name (`body.lengths.STATED`).
        camera: None where no intrinsics are known.
        ground_known: whether the scene's ground is where the world of the camera's path has it; if not, it is
            estimated, as it is without a path.
        part: which frames of its source these are; None: all.
        trust: what its source is worth, as `simrecon.trust` reads it; `""`: as its frame usually deserves.
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
    mass_kg: float | None = None
    height_m: float | None = None
    lengths_m: tuple[tuple[str, float], ...] = ()
    camera: Camera | None = None
    ground_known: bool = True
    part: Part | None = None
    trust: str = ""
    sha256: str = ""
    reading: str = ""
