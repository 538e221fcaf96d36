"""Frames on simulation steps, and windows that cover a clip."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon import schedule
from simrecon.plan import Plan, Simulation, WindowPlan
from simrecon.schedule import Clock
from tests.support.window_results import solved

clocks = st.builds(
    Clock, st.sampled_from([1 / 120, 1 / 60, 1 / 30, 1 / 25, 0.1]), st.integers(1, 6), st.integers(2, 400)
)
pieces = st.tuples(st.floats(0.02, 4.0), st.floats(0.0, 0.95)).map(lambda p: (p[0], p[0] * p[1]))


def with_windows(length_s: float, overlap_s: float) -> Plan:
    """A plan as far as time goes."""
    return Plan(
        purpose="",
        simulation=Simulation(0.01, "usual"),
        window=WindowPlan(length_s, overlap_s, 0.1),
        optimiser=None,
        recovery=None,
        loss=None,
        kinematics=None,
    )


@given(clocks, pieces)
def test_kept_parts_cover_the_clip_once(clock: Clock, piece: tuple[float, float]) -> None:
    windows = schedule.cut(clock, with_windows(*piece))
    assert windows[0].start_step == 0
    assert windows[-1].commit_step == windows[-1].end_step == clock.steps
    for i, window in enumerate(windows):
        assert window.index == i
        assert window.start_step < window.commit_step <= window.end_step
        assert {step % clock.stride for step in (window.start_step, window.commit_step, window.end_step)} == {
            0
        }
    for before, after in itertools.pairwise(windows):
        assert before.commit_step == after.start_step
        assert before.end_step <= after.end_step


@given(clocks, pieces)
def test_windows_have_the_length_of_the_plan(clock: Clock, piece: tuple[float, float]) -> None:
    windows = schedule.cut(clock, with_windows(*piece))
    for window in windows[:-1]:
        length_s = (window.end_step - window.start_step) * clock.step_s
        assert abs(length_s - piece[0]) <= 0.5001 * clock.frame_s or length_s == pytest.approx(clock.frame_s)
    last = windows[-1]
    assert last.end_step - last.start_step <= max(
        clock.stride, round(piece[0] / clock.frame_s) * clock.stride
    )


def test_a_clip_of_two_seconds() -> None:
    windows = schedule.cut(Clock(0.1, 5, 21), with_windows(0.8, 0.4))
    steps = [(window.start_step, window.commit_step, window.end_step) for window in windows]
    assert steps == [(0, 20, 40), (20, 40, 60), (40, 60, 80), (60, 100, 100)]


def test_a_clip_shorter_than_a_window_is_one_window() -> None:
    (window,) = schedule.cut(Clock(0.1, 2, 3), with_windows(0.8, 0.4))
    assert (window.start_step, window.commit_step, window.end_step) == (0, 4, 4)


@given(st.floats(1 / 240, 0.2), st.floats(1e-3, 0.05), st.integers(2, 50))
def test_steps_are_the_largest_that_fall_on_frames(frame_s: float, longest_s: float, frames: int) -> None:
    clock = schedule.clock(np.arange(frames) * frame_s, longest_s)
    assert clock.stride * clock.step_s == pytest.approx(frame_s, rel=1e-9)
    assert clock.step_s <= longest_s * (1 + 1e-6)
    assert clock.stride == 1 or frame_s / (clock.stride - 1) > longest_s * (1 - 1e-6)
    assert (clock.frames, clock.steps) == (frames, (frames - 1) * clock.stride)


def test_a_frame_interval_that_is_a_multiple_takes_no_extra_step() -> None:
    assert schedule.clock(np.arange(9) * 0.1, 0.1 / 3).stride == 3
    assert schedule.clock(3.0 + np.arange(9) * 0.1, 0.1 / 3).stride == 3
    assert schedule.clock(np.arange(9) / 30, 0.012).stride == 3
    assert schedule.clock(np.arange(9) / 30, 0.05).stride == 1


def test_stitching_keeps_the_order() -> None:
    windows = schedule.cut(Clock(0.1, 5, 21), with_windows(0.8, 0.4))
    results = tuple(
        solved(
            window,
            np.full((window.commit_step - window.start_step, 2), float(window.index)),
            np.zeros((1, 1)),
        )
        for window in windows
    )
    np.testing.assert_array_equal(schedule.stitch(results)[:, 0], np.repeat([0, 1, 2, 3], [20, 20, 20, 40]))
