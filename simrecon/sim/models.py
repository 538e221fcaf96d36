"""Models of MJCF."""

from __future__ import annotations

import mujoco


def compiled(mjcf: str) -> mujoco.MjModel:
    """The model of a text.

    Args:
        mjcf: MuJoCo's XML.

    Raises:
        ValueError: MuJoCo finds an error in it.
    """
    return mujoco.MjModel.from_xml_string(mjcf)
