"""What the things of a scene do to the person, read off a replay: loads, depths, sink; and scores of them.

Axes: T frames, I things.
"""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.ndimage import uniform_filter1d

from simrecon import scene as scenes
from simrecon.evaluation.simulated import Simulated
from simrecon.metrics.contact import Flags
from simrecon.metrics.dynamics import body_weight_pct
from simrecon.metrics.joints import Clip, Scores
from simrecon.metrics.truth import at
from simrecon.replay import SIMULATED, mean_since
from simrecon.scene import check, parts
from simrecon.sim import contacts
from simrecon.sim.state import set_state
from simrecon.types import Array, Scene

# Who sits down comes up by this much; within this of the lowest or highest hips, and this slow, is at rest.
SITS_LEAST_M, NEAR_M, STILL_MPS = 0.15, 0.05, 0.1
# A load rises above the first share of weight, and has let go below the second, as a mean over this time.
BORNE_PCT, FREE_PCT, SMOOTH_S = 40.0, 5.0, 0.2


def forces(model: mujoco.MjModel, scene: Scene, state0: Array, ctrl: Array) -> Array:
    """Force on the person in every step of a replay, (N + 1, I + 1, 3) N: of each thing, and of the ground.

    Row k acted from state k - 1 to state k; row 0 is zero.

    Args:
        model: of person and scene.
        scene: that it was built from.
        state0: (nstate,) full state.
        ctrl: (N, nu).
    """
    owners = check.owners(model, scene)
    person = np.where(owners < 0, 0, -1)  # (ngeom,)
    rows = np.zeros((len(ctrl) + 1, len(scene.items) + 1, 3))
    data = mujoco.MjData(model)
    set_state(model, data, state0)
    for row, control in zip(rows[1:], ctrl, strict=True):
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        touching = contacts.find(data, person)
        np.add.at(row, owners[touching.other], contacts.forces(model, data, touching)[0])
    return rows


def loads(of: Simulated) -> Array:
    """Force of each thing of the scene on the person, mean since the previous frame, (T, I, 3) N.

    Fallback frames are zero; the ground is no thing.

    Args:
        of: a result, which is replayed.
    """
    motion = of.motion
    rows = forces(of.model, of.scene, motion.state0, motion.ctrl)[:, :-1]
    found = np.zeros((len(motion.times_s), *rows.shape[1:]))
    kept = motion.status == SIMULATED
    found[kept] = mean_since(rows, motion.frame_step[kept])
    return found


def scores(of: Simulated, on: Clip) -> Scores:
    """Loads and depths of the things, and the sink of those that are sprung; none without things.

    Args:
        of: the result.
        on: the clip, whose reference says when the person sits and stands.
    """
    if not of.scene.items:
        return Scores()
    motion, mass = of.motion, of.mass_kg
    vertical = body_weight_pct(loads(of), mass)[..., 2].sum(-1)  # (T,)
    kept = (motion.status == SIMULATED) & (motion.frame_step > 0)
    total = float(body_weight_pct(motion.grf_N, mass)[kept, 2].mean())
    numbers = {"thing_load_pct": 100.0 * float(vertical[kept].mean()) / total if total > 0 else np.nan}
    known = at(on.times_s, motion.times_s, kept.astype(np.float64)) > 0.99  # not the first frame, no fallback
    borne = at(on.times_s, motion.times_s, vertical)
    hips = on.truth.at(on.times_s, ("left_hip", "right_hip")).mean(axis=1)  # (T, 3)
    if np.ptp(hips[:, 2]) > SITS_LEAST_M:
        sitting, standing = (at_rest & known for at_rest in rests(hips, on.interval_s))
        numbers |= {
            "thing_sitting_pct": float(borne[sitting].mean()) if sitting.any() else np.nan,
            "thing_standing_pct": float(borne[standing].max()) if standing.any() else np.nan,
            "rises": float(releases(borne[known], on.interval_s)),
            "reference_rises": float(rises(hips[:, 2])),
        }
    found = check.penetrations(of.model, of.scene, motion.qpos[kept])
    depths = [entry.depth_m.max() for entry in found if entry.name != scenes.GROUND_GEOM]
    numbers["thing_penetration_max_mm"] = 1e3 * float(max(depths, default=0.0))
    return Scores({}, numbers | _sheets(of))


def rests(hips_m: Array, interval_s: float) -> tuple[Flags, Flags]:
    """Frames in which a person sits still and in which one stands, from the middle of the hips (T, 3)."""
    height = hips_m[:, 2]
    low, high = np.percentile(height, [5.0, 95.0])
    speed = np.linalg.norm(np.gradient(hips_m, interval_s, axis=0), axis=-1)
    sitting = (height < low + NEAR_M) & (speed < STILL_MPS)
    return np.asarray(sitting), np.asarray(height > high - NEAR_M)


def rises(height_m: Array) -> int:
    """How often hips go from the lower to the upper quarter of their range, (T,)."""
    low, high = np.percentile(height_m, [5.0, 95.0])
    quarter = (high - low) / 4
    return _climbs(height_m < low + quarter, height_m > high - quarter)


def releases(load_pct: Array, interval_s: float) -> int:
    """How often a load (T,) of `BORNE_PCT` is followed by none, as a mean over `SMOOTH_S`."""
    smooth = uniform_filter1d(load_pct, max(1, round(SMOOTH_S / interval_s)), mode="nearest")
    return _climbs(smooth > BORNE_PCT, smooth < FREE_PCT)


def _climbs(before: Flags, after: Flags) -> int:
    """How often frames that are `after` follow ones that are `before`."""
    marks = np.where(before, 1, 0) + np.where(after, 2, 0)
    seen = marks[marks > 0]
    return int(((seen[:-1] == 1) & (seen[1:] == 2)).sum())


def _sheets(of: Simulated) -> dict[str, float]:
    """Sink of mats and trampolines, and how high the centre of mass comes over where it began."""
    if not any(parts.sheet(item) for item in of.scene.items):
        return {}
    model, motion = of.model, of.motion
    tiles = [i for i in range(model.njnt) if "/tile_" in model.joint(i).name]
    kept = motion.status == SIMULATED
    sink = -motion.qpos[kept][:, model.jnt_qposadr[tiles]].min(axis=1)  # (T,)
    rise = motion.com_m[kept, 2] - motion.com_m[0, 2]
    return {
        "sheet_sink_mm": 1e3 * float(sink.max()),
        "apex_mm": 1e3 * float(rise.max()),
        "apex_s": float(motion.times_s[kept][rise.argmax()]),
    }
