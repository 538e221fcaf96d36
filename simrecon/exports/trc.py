"""TRC: joint centres and landmarks as markers, y up, metres, as OpenSim and its tools read them."""

from __future__ import annotations

from simrecon import kinematics
from simrecon.exports.clock import TO_Y_UP, uniform_motion
from simrecon.results import Result
from simrecon.types import Array

HEADER = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"


def write(result: Result) -> bytes:
    """Joint centres and landmarks of a result's simulated motion, at a uniform frame rate."""
    times_s, qpos = uniform_motion(result)
    places_m = kinematics.configurations(result.body, qpos)[1]
    return trc(times_s, result.body.skeleton.point_names, places_m)


def trc(times_s: Array, names: tuple[str, ...], places_m: Array) -> bytes:
    """A TRC file.

    Args:
        times_s: (T,) uniform; the file's begin at 0.
        names: of the M markers.
        places_m: (T, M, 3), world, z up.
    """
    count, markers = places_m.shape[:2]
    rate = f"{(count - 1) / (times_s[-1] - times_s[0]):.6f}"
    numbers = (rate, rate, str(count), str(markers), "m", rate, "1", str(count))
    labels = ["Frame#", "Time", *(f"{name}\t\t" for name in names)]
    axes = ["", "", *(f"{axis}{marker + 1}" for marker in range(markers) for axis in "XYZ")]
    head = [
        "PathFileType\t4\t(X/Y/Z)\tmotion.trc",
        "\t".join(HEADER.split()),
        "\t".join(numbers),
        "\t".join(labels).rstrip("\t"),
        "\t".join(axes),
    ]
    rows = (places_m @ TO_Y_UP.T).reshape(count, -1)
    lines = [
        "\t".join((str(frame + 1), f"{time:.6f}", *(f"{value:.6f}" for value in row)))
        for frame, (time, row) in enumerate(zip(times_s - times_s[0], rows, strict=True))
    ]
    return "\n".join([*head, *lines, ""]).encode("ascii")
