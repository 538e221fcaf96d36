"""What touched in a simulation, and whether what the user wished of it holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from simrecon.contact import honoured, parts, rules, wishes
from simrecon.kinematics.touched import Touched, touched
from simrecon.pipeline import Reconstruction
from simrecon.types import Array, Body, ContactTargets, Flags, Interval, Motion, Scene


def make(run: Reconstruction) -> dict[str, Any]:
    """The section `contacts` of a report (docs/formats.md)."""
    fit, motion = run.fit, run.motion
    section: dict[str, Any] = {"source": None if fit.contacts is None else fit.contacts.source, "wishes": []}
    if fit.wished is None:
        return section
    posed = touched(fit.body, fit.scene, fit.qpos, fit.times_s)
    near = rules.near(posed.clearance_m)
    in_fit = honoured.honoured(fit.wished, near, posed.speed_mps)
    at = np.abs(motion.times_s[:, None] - fit.times_s).argmin(axis=1)
    asked, found = fit.wished.at(at), of_motion(fit.body, fit.scene, motion)
    pushed = pushes(motion, found)
    in_simulation = honoured.honoured(_where(asked, motion.kept), pushed, found.speed_mps)
    cannot = honoured.impossible(fit.wished, posed.clearance_m)
    done = {(wish.part, wish.kind): wish for wish in in_simulation}
    for wish in in_fit:
        column = fit.wished.parts.index(wish.part)
        elsewhere = cannot[:, column] & wish.asked if wish.kind != "free" else np.zeros_like(wish.asked)
        result = done.get((wish.part, wish.kind))
        section["wishes"].append(
            {
                "part": wish.part,
                "kind": wish.kind,
                "frames": int(wish.asked.sum()),
                "fit_share": wish.share,
                "simulated_share": None if result is None else result.share,
                "cannot_s": wishes.spans(elsewhere, fit.times_s),
                "apart_m": float(posed.clearance_m[elsewhere, column].max()) if elsewhere.any() else None,
            }
        )
    return section


def _where(asked: ContactTargets, frames: Flags) -> ContactTargets:
    """Wishes for some frames (T,) alone."""
    kept = {name: getattr(asked, name) & frames[:, None] for name in ("touch", "stay", "free")}
    return replace(asked, **kept)


def of_motion(body: Body, scene: Scene, motion: Motion) -> Touched:
    """How near each part is to floor and items in a simulated motion."""
    count = 3 + 4 * len(body.skeleton.names)
    return touched(body, scene, motion.qpos[:, :count], motion.times_s)


def pushes(motion: Motion, found: Touched) -> Flags:
    """Which parts (T, P) the scene pushes: their primitives are loaded, and the part itself is near."""
    loaded = rules.pushed(np.linalg.norm(motion.contact_force_N, axis=-1))  # (T, C)
    columns = [
        loaded[:, [motion.contact_body.index(name) for name in part.at]].any(axis=1) for part in parts.parts()
    ]
    return np.asarray(np.stack(columns, axis=1) & rules.near(found.clearance_m))


def spans(body: Body, scene: Scene, motion: Motion) -> Mapping[str, tuple[Interval, ...]]:
    """When each part touched in a simulated motion, s, by name."""
    pushed = pushes(motion, of_motion(body, scene, motion)) & motion.kept[:, None]
    rounded: dict[str, tuple[Interval, ...]] = {}
    for name, flags in zip(parts.names(), pushed.T, strict=True):
        rounded[name] = tuple(_rounded(span, motion.times_s) for span in wishes.spans(flags, motion.times_s))
    return rounded


def _rounded(span: Interval, times_s: Array) -> Interval:
    """An interval to a tenth of a frame, so that it holds the same frames."""
    digits = max(2, int(np.ceil(-np.log10(0.1 * np.median(np.diff(times_s))))))
    slack = 10.0**-digits
    return round(span[0] - slack / 2, digits), round(span[1] + slack / 2, digits)
