"""Bones of the body beside those that motion capture measured: a unit, a name or a shape may be wrong."""

from __future__ import annotations

from simrecon import body as bodies
from simrecon import trust
from simrecon.errors import InputError
from simrecon.types import Evidence, Skeleton

SAID, MOST = 0.15, 0.35
"""Share of its length by which a bone may differ before that is said, and before it is refused."""


def apart(evidence: Evidence, skeleton: Skeleton) -> dict[str, float]:
    """Length of each bone of a body over that measured, less one; empty where the source knows no lengths.

    A stature that somebody says is compared with that of the skeleton, as `stature`.

    Args:
        evidence: with a 3D estimate.
        skeleton: of the body, lengths in m.
    """
    return {name: ours / theirs - 1 for name, (ours, theirs) in _compared(evidence, skeleton).items()}


def _compared(evidence: Evidence, skeleton: Skeleton) -> dict[str, tuple[float, float]]:
    """Lengths of the body, and those of the motion capture, m."""
    if not (evidence.joint_names and trust.of(evidence).metric):
        return {}
    ours, measured = bodies.measure_template(skeleton), bodies.measure(evidence)
    both = {name: (ours[name], measured[name]) for name in bodies.bone_names() if name in measured}
    if evidence.height_m is not None and both:
        both["stature"] = evidence.height_m, bodies.stature_m(skeleton)
    return both


def check(evidence: Evidence, skeleton: Skeleton) -> None:
    """Refuse a body with bones of another person.

    Args:
        evidence: as of `apart`.
        skeleton: as of `apart`.

    Raises:
        InputError: a bone, or a stature that somebody says, differs by more than `MOST` of what was measured.
    """
    off = apart(evidence, skeleton)
    worst = max(off, key=lambda name: abs(off[name]), default="")
    if not worst or abs(off[worst]) <= MOST:
        return
    ours, theirs = _compared(evidence, skeleton)[worst]
    raise InputError(
        f"{worst.replace('_', ' ')} of the body: found {ours:.3g} m, where the motion capture has "
        f"{theirs:.3g} m ({100 * off[worst]:+.0f} %); valid: up to {100 * MOST:.0f} % apart; "
        "check --unit, --joints, --height-m and --betas"
    )
