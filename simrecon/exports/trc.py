"""TRC: joint centres and landmarks as markers, y up, metres, as OpenSim and its tools read them."""

from __future__ import annotations

from simrecon.exports import tables
from simrecon.exports.axes import TO_Y_UP
from simrecon.exports.view import ResultView
from simrecon.types import Array

HEADER = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"


def write(view: ResultView) -> dict[str, bytes]:
    """Joint centres and landmarks of the motion."""
    return {"motion.trc": trc(view.times_s, view.body.skeleton.point_names, view.points_m)}


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
    rows = tables.rows((times_s - times_s[0], places_m @ TO_Y_UP.T))
    return tables.lines(head, [f"{frame}\t{row}" for frame, row in enumerate(rows, 1)])
