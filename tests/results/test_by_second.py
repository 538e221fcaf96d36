"""The verdict of each second, on a squat of ten frames that is stretched over three seconds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simrecon.replay import FALLBACK
from simrecon.results import by_second

PER_SECOND = 10


@pytest.fixture
def long(run: Any) -> Any:
    """Thirty frames in three seconds: the squat's first frame, held."""
    frames, motion, fit, problem = 3 * PER_SECOND, run.motion, run.fit, run.problem
    times = np.arange(frames) / PER_SECOND

    def held(values: np.ndarray) -> np.ndarray:
        return np.repeat(values[:1], frames, axis=0)

    motion = replace(
        motion,
        times_s=motion.times_s[0] + times,
        status=np.zeros(frames, np.uint8),
        qpos=held(motion.qpos),
        joints_m=held(problem.points_m),
        com_m=held(motion.com_m),
        kinematic_qpos=None,
    )
    clock = replace(problem.clock, frame_s=1 / PER_SECOND, frames=frames)
    problem = replace(
        problem,
        clock=clock,
        qpos=held(problem.qpos),
        points_m=held(problem.points_m),
        orientations=held(problem.orientations),
    )
    fit = replace(
        fit,
        times_s=fit.times_s[0] + times,
        com_m=held(fit.com_m),
        interpolated=np.zeros(frames, bool),
        camera=None,
        contacts=None,
    )
    return replace(run, motion=motion, problem=problem, fit=fit)


def said(run: Any) -> list[tuple[str, str]]:
    return [(second["verdict"], second["reason"]) for second in by_second.make(run)]


def test_good_seconds_have_no_reason(long: Any) -> None:
    assert said(long) == [("good", "")] * 3
    first, *_, last = by_second.make(long)
    assert (first["from_s"], last["to_s"]) == (pytest.approx(long.motion.times_s[0]), long.motion.times_s[-1])
    assert by_second.short({"by_second": by_second.make(long)}) == [("0.0 to 2.9 s", "good")]


def test_a_second_that_is_not_simulated_is_bad_and_names_its_cause(long: Any) -> None:
    status = long.motion.status.copy()
    status[12:18] = FALLBACK
    status[29] = FALLBACK
    found = said(replace(long, motion=replace(long.motion, status=status)))
    assert [level for level, _ in found] == ["good", "bad", "doubtful"]
    assert found[1][1].startswith("not simulated (fell: ")
    report = {"by_second": by_second.make(replace(long, motion=replace(long.motion, status=status)))}
    assert [when for when, _ in by_second.short(report)] == ["0.0 to 0.9 s", "1.0 to 1.9 s", "2.0 to 2.9 s"]


def test_lost_landmarks_and_what_is_far_from_the_fit(long: Any) -> None:
    lost = np.zeros(30, bool)
    lost[:3] = lost[10:18] = True
    found = said(replace(long, fit=replace(long.fit, interpolated=lost)))
    assert found[0] == ("doubtful", "landmarks lost in 30 % of the frames")
    assert found[1] == ("bad", "landmarks lost in 80 % of the frames")
    assert found[2] == ("good", "")
    away = long.motion.joints_m.copy()
    away[25:, :, 0] += 0.3
    found = said(replace(long, motion=replace(long.motion, joints_m=away)))
    assert found[2] == ("bad", "30 cm from the kinematic fit at worst")


def test_a_reference_that_no_force_explains(long: Any) -> None:
    com = long.fit.com_m.copy()
    com[10:20, 2] += 0.5 * 90.0 * (np.arange(10) / PER_SECOND) ** 2
    found = said(replace(long, fit=replace(long.fit, com_m=com)))
    assert found[1][0] == "doubtful"
    assert found[1][1].startswith("unexplained force in the reference: ")
    assert found[0] == ("good", "")


def test_the_last_frame_is_no_second_of_its_own(long: Any) -> None:
    times = long.motion.times_s[0] + np.arange(30) * 2 / 29
    whole = replace(long, motion=replace(long.motion, times_s=times))
    assert len(by_second.make(whole)) == 2
