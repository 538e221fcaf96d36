"""Forces for OpenSim: a MOT with ground reactions, and the XML that says on which bodies they act.

y up, N, N m, metres; times begin at 0, as in the TRC. Each foot has a force, the centre of pressure, and the
moment about it. What else the scene pushes (hands, seat) comes after the feet, on the body of OpenSim's
full-body models that it belongs to.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact import rules
from simrecon.exports import tables
from simrecon.exports.axes import TO_Y_UP
from simrecon.exports.forces import per_frame
from simrecon.exports.view import ResultView
from simrecon.types import Array

FEET = {"right_ankle": ("calcn_r", "r"), "left_ankle": ("calcn_l", "l")}
"""Segments of the feet: OpenSim's bodies, and what the columns call them; written in any case."""
OTHERS = {
    "pelvis": "pelvis", "spine": "torso", "chest": "torso", "neck": "torso", "head": "torso",
    "left_shoulder": "humerus_l", "left_elbow": "ulna_l", "left_wrist": "hand_l",
    "right_shoulder": "humerus_r", "right_elbow": "ulna_r", "right_wrist": "hand_r",
    "left_hip": "femur_l", "left_knee": "tibia_l", "right_hip": "femur_r", "right_knee": "tibia_r",
}  # fmt: skip
"""Further segments and OpenSim's bodies; written where the scene pushes them."""
MOT, XML = "forces.mot", "forces.xml"


def write(view: ResultView) -> dict[str, bytes]:
    """The forces on feet, and on what else is pushed, at about the rate of the simulation.

    Raises:
        InputError: the motion is not the one that was simulated.
    """
    forces = view.forces
    times_s, span_s = sample_times(view.times_s, per_frame(forces, view.rate_hz))
    loads = forces.at(times_s, span_s)
    pushed = np.linalg.norm(loads.force_N, axis=-1).max(axis=0) > rules.LOADED_N  # (S,)
    bodies = dict(FEET)
    for segment, body in OTHERS.items():
        if pushed[forces.segments.index(segment)]:
            bodies[segment] = (body, segment)
    names, columns = ["time"], [times_s - times_s[0]]
    for segment, (_, word) in bodies.items():
        row = forces.segments.index(segment)
        parts = (loads.force_N[:, row], filled(loads.centre_m[:, row]), loads.moment_Nm[:, row])
        columns += [part @ TO_Y_UP.T for part in parts]
        names += [f"ground_force_{word}_v{axis}" for axis in "xyz"]
        names += [f"ground_force_{word}_p{axis}" for axis in "xyz"]
        names += [f"ground_torque_{word}_{axis}" for axis in "xyz"]
    head = [MOT, "version=1", f"nRows={len(times_s)}", f"nColumns={len(names)}", "inDegrees=no", "endheader"]
    content = tables.lines(head, ["\t".join(names)], tables.rows(columns))
    return {MOT: content, XML: external_loads({word: body for body, word in bodies.values()})}


def sample_times(times_s: Array, count: int) -> tuple[Array, float]:
    """Times (H,) with so many in each interval of frames (G,), and the span between them."""
    span_s = float(times_s[-1] - times_s[0]) / (len(times_s) - 1) / count
    return np.asarray(times_s[0] + span_s * np.arange((len(times_s) - 1) * count + 1)), span_s


def filled(centre_m: Array) -> Array:
    """Places (H, 3), NaN where nothing presses: there on the way from one to the next, zero without any."""
    known = np.isfinite(centre_m[:, 0])
    if not known.any():
        return np.zeros_like(centre_m)
    frames = np.arange(len(centre_m))
    return np.stack([np.interp(frames, frames[known], column[known]) for column in centre_m.T], axis=1)


def external_loads(bodies: dict[str, str]) -> bytes:
    """The XML of `ExternalLoads` for `forces.mot`: OpenSim's bodies by the word in the columns."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<OpenSimDocument Version="40000">']
    lines += ['  <ExternalLoads name="forces">', "    <objects>"]
    for word, body in bodies.items():
        lines.append(f'      <ExternalForce name="scene_on_{word}">')
        keys = {
            "applied_to_body": body,
            "force_expressed_in_body": "ground",
            "point_expressed_in_body": "ground",
            "force_identifier": f"ground_force_{word}_v",
            "point_identifier": f"ground_force_{word}_p",
            "torque_identifier": f"ground_torque_{word}_",
            "data_source_name": MOT,
        }
        lines += [f"        <{key}>{text}</{key}>" for key, text in keys.items()]
        lines.append("      </ExternalForce>")
    lines += ["    </objects>", f"    <datafile>{MOT}</datafile>", "  </ExternalLoads>", "</OpenSimDocument>"]
    return tables.lines(lines)
