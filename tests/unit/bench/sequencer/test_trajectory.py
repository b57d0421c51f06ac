"""Trajectories of single moves."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.sequencer.trajectory import (
    ScheduledTrajectory,
    SoftStop,
    Trajectory,
    make_standstill,
    plan_approach,
)


def test_approach_starts_and_ends_at_rest_within_its_limits():
    approach = plan_approach(-0.03, 0.01)
    assert approach.displacement[[0, -1]] == pytest.approx([-0.03, 0.01], abs=1e-12)
    velocity = np.diff(approach.displacement) * approach.rate
    assert np.max(np.abs(velocity)) <= 0.031
    assert np.max(np.abs(np.diff(velocity))) * approach.rate <= 0.31


def test_approach_to_the_present_position_takes_no_time():
    approach = plan_approach(0.01, 0.01)
    assert approach.duration == 0.0
    assert approach.displacement.tolist() == [0.01]


def make_line(count=5, rate=10.0):
    """Return a motion at 0.2 m/s from 0, and at 3 m/s², which its samples need not agree with."""
    samples = np.arange(count)
    return Trajectory(rate, 0.2 / rate * samples, np.full(count, 0.2), np.full(count, 3.0))


@pytest.mark.parametrize(
    ("elapsed_s", "position"),
    [(-1.0, 0.0), (0.0, 0.0), (0.05, 0.01), (0.1, 0.02), (0.275, 0.055), (0.4, 0.08), (0.401, 0.08), (9.0, 0.08)],
)
def test_position_is_interpolated_and_constant_outside(elapsed_s, position):
    schedule = ScheduledTrajectory(make_line(), 7_000_000_000)
    time_ns = 7_000_000_000 + round(elapsed_s * 1e9)
    assert schedule.find_position(time_ns) == pytest.approx(position, abs=1e-12)
    assert schedule.find_positions(np.array([time_ns])) == pytest.approx([position], abs=1e-12)


def test_standstill_has_one_position_and_no_duration():
    schedule = ScheduledTrajectory(make_standstill(0.03), 5)
    assert (schedule.end_ns, schedule.find_position(0), schedule.find_position(10**10)) == (5, 0.03, 0.03)
    assert schedule.find_positions(np.array([0, 10**10])).tolist() == [0.03, 0.03]


def test_motion_ends_with_its_last_sample_unless_it_is_stopped_earlier():
    """Five samples at 10 Hz last 0.4 s. A stop at 0.3 s takes 0.5 s; one at the end or later changes nothing."""
    schedule = ScheduledTrajectory(make_line(), 2_000_000_000)
    assert schedule.end_ns == 2_400_000_000
    assert schedule.add_soft_stop(2_300_000_000, 1e3).end_ns == 2_800_000_000
    assert schedule.add_soft_stop(2_400_000_000, 1e3).end_ns == 2_400_000_000
    assert schedule.add_soft_stop(2_500_000_000, 1e3).end_ns == 2_400_000_000


def test_soft_stop_slows_the_time_of_the_trajectory_along_a_raised_cosine():
    """Its rate (1 + cos)/2 is 1/2 in the middle; until then, time advances by (1/2 + 1/pi)/2 of the stop."""
    line = make_line(101)
    schedule = ScheduledTrajectory(line, 0).add_soft_stop(1_000_000_000, 1e3)
    assert schedule.soft_stop == SoftStop(1.0, 0.5)
    instants = np.array([900_000_000, 1_000_000_000, 1_250_000_000, 1_500_000_000, 9_000_000_000])
    time = [0.9, 1.0, 1.0 + 0.25 * (0.5 + 1 / math.pi), 1.25, 1.25]
    assert schedule.map_time(instants) == pytest.approx(time, abs=1e-12)
    assert schedule.find_positions(instants) == pytest.approx(0.2 * np.array(time), abs=1e-12)
    assert schedule.find_position(1_250_000_000) == pytest.approx(0.2 * time[2], abs=1e-12)


@pytest.mark.parametrize(
    ("acceleration", "duration"),
    [(0.629, 0.5), (0.628, 0.7), (0.449, 0.7), (0.448, 1.0), (0.079, 4.0), (0.078, 4.0), (0.0, 4.0)],
)
def test_soft_stop_is_the_shortest_within_the_acceleration_limit(acceleration, duration):
    """At a steady 0.2 m/s the peak deceleration of a stop is pi/2 x 0.2 m/s / duration: 0.6283 m/s² in 0.5 s."""
    steady = replace(make_line(101), acceleration=np.zeros(101))
    stopped = ScheduledTrajectory(steady, 0).add_soft_stop(1_000_000_000, acceleration)
    assert stopped.soft_stop.duration == duration


def test_soft_stop_counts_the_acceleration_of_the_motion_itself():
    """Where it is 3 m/s² at the begin of the stop, no stop stays within less."""
    schedule = ScheduledTrajectory(make_line(101), 0)
    assert schedule.add_soft_stop(1_000_000_000, 2.99).soft_stop.duration == 4.0
    assert schedule.add_soft_stop(1_000_000_000, 3.01).soft_stop.duration == 0.5


def test_second_stop_and_one_before_the_begin():
    schedule = ScheduledTrajectory(make_line(), 1_000_000_000)
    assert schedule.add_soft_stop(0, 1e3).soft_stop.start == 0.0
    stopped = schedule.add_soft_stop(1_200_000_000, 1e3)
    assert stopped.add_soft_stop(1_300_000_000, 1e3) is stopped
