"""Where the drive wants to be, and what a bus does to frames, without sockets."""

import pytest

from sim_rig.can_bus import BusTiming, CanFrame, frame_bits
from sim_rig.drive_motion import Demand, Motion

MILLISECOND = 1_000_000


def test_setpoint_is_reached_in_a_straight_line_after_one_period():
    demand = Demand()
    demand.follow(4e-4, 4 * MILLISECOND, 1.0, 10.0)
    places = []
    for k in range(5):
        demand.advance(k * MILLISECOND)
        places.append(demand.position)
    assert places == pytest.approx([0, 1e-4, 2e-4, 3e-4, 4e-4])


def test_late_setpoint_is_bridged_and_then_the_rod_brakes_by_itself():
    demand = Demand()
    demand.follow(4e-4, 4 * MILLISECOND, 1.0, 10.0)
    demand.advance(12 * MILLISECOND)
    assert demand.position == pytest.approx(12e-4)
    demand.advance(16 * MILLISECOND)
    assert demand.motion is Motion.BRAKE
    demand.advance(100 * MILLISECOND)
    assert demand.motion is Motion.REST
    assert demand.position == pytest.approx(12e-4 + 0.1**2 / 2 / 10)


def test_setpoints_that_come_in_a_heap_are_bridged_at_their_own_pace():
    demand = Demand()
    for k in range(1, 6):
        demand.follow(k * 1e-4, 4 * MILLISECOND, 1.0, 10.0)
    demand.advance(4 * MILLISECOND)
    assert demand.position == pytest.approx(5e-4)
    demand.advance(8 * MILLISECOND)
    assert demand.position == pytest.approx(6e-4)


def test_speed_is_limited():
    demand = Demand()
    demand.follow(1.0, 4 * MILLISECOND, 0.5, 10.0)
    demand.advance(4 * MILLISECOND)
    assert demand.position == pytest.approx(0.002)


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
