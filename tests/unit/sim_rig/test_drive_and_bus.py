"""Where the drive wants to be, and what a bus does to frames, without sockets."""

import numpy as np
import pytest

from sim_rig.can_bus import BusTiming, CanFrame, frame_bits
from sim_rig.command_track import JoinedTrack
from sim_rig.drive_motion import Demand, Motion

MILLISECOND = 1_000_000


def test_setpoint_is_reached_in_a_straight_line_four_periods_after_it_came():
    demand = Demand()
    demand.follow(12e-4, 0, 4 * MILLISECOND, 1.0, 10.0)
    places = []
    for k in range(17):
        demand.advance(k * MILLISECOND)
        places.append(demand.position)
    assert places == pytest.approx([k * 0.75e-4 for k in range(17)])


def test_setpoints_that_come_unpunctually_are_followed_at_a_steady_pace():
    demand, random, period = Demand(), np.random.default_rng(7), 4 * MILLISECOND
    places, coming = [], []
    for k in range(500):
        coming.append((k * period + int(random.integers(3 * MILLISECOND)), k * 2e-4))
    for now in range(0, 500 * period, MILLISECOND // 4):
        while coming and coming[0][0] <= now:
            at, target = coming.pop(0)
            demand.advance(at)
            demand.follow(target, at, period, 1.0, 10.0)
        demand.advance(now)
        places.append(demand.position)
    velocity = np.diff(places)[2000:] / 0.25e-3
    assert velocity.mean() == pytest.approx(0.05, rel=1e-3)
    assert velocity.std() < 0.05 * 0.05


def test_late_setpoint_is_bridged_and_then_the_rod_brakes_by_itself():
    demand = Demand()
    demand.follow(4e-4, 0, 4 * MILLISECOND, 1.0, 10.0)
    demand.advance(24 * MILLISECOND)
    assert demand.position == pytest.approx(12e-4)
    demand.advance(26 * MILLISECOND)
    assert demand.motion is Motion.BRAKE
    demand.advance(100 * MILLISECOND)
    assert demand.motion is Motion.REST
    assert demand.position == pytest.approx(12e-4 + 0.1**2 / 2 / 10)


def test_setpoints_that_come_in_a_heap_are_reached_one_after_the_other():
    demand = Demand()
    for k in range(1, 6):
        demand.follow(k * 1e-4, 0, 4 * MILLISECOND, 1.0, 10.0)
    places = []
    for now in range(33):
        demand.advance(now * MILLISECOND)
        places.append(demand.position)
    assert places[16] == pytest.approx(1e-4, rel=0.05)
    assert np.all(np.diff(places) > 0)
    assert places[31] == pytest.approx(5e-4, rel=0.1)


def test_speed_is_limited():
    demand = Demand()
    demand.follow(1.0, 0, 4 * MILLISECOND, 0.5, 10.0)
    demand.advance(16 * MILLISECOND)
    assert demand.position == pytest.approx(0.002)


def test_legs_join_and_lead_along_a_smooth_curve_through_the_setpoints():
    demand, track, period = Demand(), JoinedTrack(0.0, 1), 4 * MILLISECOND
    newest = []
    for k in range(100):
        demand.advance(k * period)
        legs = demand.follow(5e-3 * np.sin(k / 16), k * period, period, 1.0, 10.0)
        newest.append(legs[-1])
        for leg in legs:
            track.add(leg.end_ns - 1, leg.target, leg.begin_ns - 1)
    assert [leg.begin_ns for leg in newest[1:]] == [leg.end_ns for leg in newest[:-1]]
    times = np.arange(20 * period, 90 * period, MILLISECOND)
    assert track.at(times) == pytest.approx(5e-3 * np.sin((times / period - 4) / 16), abs=1e-7)


def test_a_host_that_was_silent_for_a_period_before_it_set_out_is_not_taken_for_late():
    demand, period = Demand(), 4 * MILLISECOND
    for k in range(200):
        at = k * period + (period if k > 50 else 0)
        demand.advance(at)
        demand.follow(max(k - 50, 0) * 1e-4, at, period, 1.0, 10.0)
    demand.advance(204 * period)
    assert demand.position == pytest.approx(149e-4)


def test_a_leg_that_the_rod_is_already_on_is_not_bent_any_more():
    demand, period = Demand(), 4 * MILLISECOND
    for k in range(6):
        demand.advance(k * period)
        demand.follow(k * k * 1e-5, k * period, period, 1.0, 10.0)
    demand.advance(10 * period)
    assert len(demand.follow(36e-5, 6 * period, period, 1.0, 10.0)) == 1


def test_a_setpoint_that_is_nearly_a_period_late_leaves_the_grid_where_it_was():
    late, punctual, period = Demand(), Demand(), 4 * MILLISECOND
    apart = []
    for k in range(60):
        for demand, delay in ((late, 3_700_000 if k == 20 else 0), (punctual, 0)):
            demand.advance(k * period + delay)
            demand.follow(k * k * 1e-6, k * period + delay, period, 1.0, 10.0)
        apart.append(abs(late.position - punctual.position) if k != 20 else 0.0)
    assert max(apart[25:]) < 2e-6


def test_the_grid_follows_the_earliest_setpoints_however_the_lateness_of_most_changes():
    demand, random, period = Demand(), np.random.default_rng(3), 4 * MILLISECOND
    apart = []
    for k in range(3000):
        most = 2_900_000 if k // 500 % 2 else 400_000
        at = k * period + (int(random.integers(most)) if k % 20 else 0)
        demand.follow(k * 4e-4, at, period, 1.0, 10.0)
        demand.advance((k + 1) * period)
        apart.append(demand.position - (k - 2) * 4e-4)
    assert np.ptp(apart[200:]) < 0.1 * 80e-6


@pytest.mark.parametrize("target", [0.01, -0.01])
def test_travel_ends_at_its_target(target):
    demand = Demand()
    demand.travel(target, 0.02)
    for k in range(1000):
        demand.advance(k * MILLISECOND)
    assert demand.position == target
    assert demand.motion is Motion.REST


def test_frames_take_their_bits_and_the_lowest_identifier_goes_first():
    bus = BusTiming(1_000_000)
    for sender, identifier in (("a", 0x300), ("b", 0x100), ("c", 0x200)):
        bus.offer(CanFrame(identifier, bytes(8), sender), 0)
    assert bus.passed(0) == []
    took = frame_bits(8) * 1000
    assert bus.next_ns() == took
    passed = bus.passed(10 * took)
    assert [frame.identifier for _, frame in passed] == [0x100, 0x200, 0x300]
    assert [end for end, _ in passed] == [took, 2 * took, 3 * took]
    assert bus.load(6 * took) == pytest.approx(0.5)


def test_frames_of_one_sender_keep_their_order():
    bus = BusTiming()
    for identifier in (0x205, 0x080):
        bus.offer(CanFrame(identifier, b"", "master"), 0)
    assert [frame.identifier for _, frame in bus.passed(MILLISECOND)] == [0x205, 0x080]


def test_frame_waits_until_it_is_ready():
    bus = BusTiming()
    bus.offer(CanFrame(0x181, b"", "drive"), 5 * MILLISECOND)
    assert bus.passed(MILLISECOND) == []
    assert bus.next_ns() == 5 * MILLISECOND
    assert len(bus.passed(6 * MILLISECOND)) == 1
    assert bus.next_ns() is None
