"""Motion generator of the drive and timing of the CAN bus, without sockets."""

import numpy as np
import pytest

from sim_rig.instruments.motion_generator import MotionGenerator, MotionState
from sim_rig.live.command_queue import LinearInterpolator
from sim_rig.protocols.can_bus import BusTiming, CanFrame, count_frame_bits

MILLISECOND = 1_000_000


def test_a_setpoint_is_reached_linearly_four_periods_after_its_arrival():
    demand = MotionGenerator()
    demand.add_setpoint(12e-4, 0, 4 * MILLISECOND, 1.0, 10.0)
    positions = []
    for k in range(17):
        demand.advance(k * MILLISECOND)
        positions.append(demand.position)
    assert positions == pytest.approx([k * 0.75e-4 for k in range(17)])


def test_setpoints_with_jitter_are_followed_at_a_constant_velocity():
    demand, random, period = MotionGenerator(), np.random.default_rng(7), 4 * MILLISECOND
    positions, arrivals = [], []
    for k in range(500):
        arrivals.append((k * period + int(random.integers(3 * MILLISECOND)), k * 2e-4))
    for now in range(0, 500 * period, MILLISECOND // 4):
        while arrivals and arrivals[0][0] <= now:
            at, target = arrivals.pop(0)
            demand.advance(at)
            demand.add_setpoint(target, at, period, 1.0, 10.0)
        demand.advance(now)
        positions.append(demand.position)
    velocity = np.diff(positions)[2000:] / 0.25e-3
    assert velocity.mean() == pytest.approx(0.05, rel=1e-3)
    assert velocity.std() < 0.05 * 0.05


def test_a_missing_setpoint_is_extrapolated_and_then_the_rod_brakes():
    demand = MotionGenerator()
    demand.add_setpoint(4e-4, 0, 4 * MILLISECOND, 1.0, 10.0)
    demand.advance(24 * MILLISECOND)
    assert demand.position == pytest.approx(12e-4)
    demand.advance(26 * MILLISECOND)
    assert demand.state is MotionState.BRAKE
    demand.advance(100 * MILLISECOND)
    assert demand.state is MotionState.REST
    assert demand.position == pytest.approx(12e-4 + 0.1**2 / 2 / 10)


def test_setpoints_that_arrive_together_are_reached_one_after_the_other():
    demand = MotionGenerator()
    for k in range(1, 6):
        demand.add_setpoint(k * 1e-4, 0, 4 * MILLISECOND, 1.0, 10.0)
    positions = []
    for now in range(33):
        demand.advance(now * MILLISECOND)
        positions.append(demand.position)
    assert positions[16] == pytest.approx(1e-4, rel=0.05)
    assert np.all(np.diff(positions) > 0)
    assert positions[31] == pytest.approx(5e-4, rel=0.1)


def test_the_speed_is_limited():
    demand = MotionGenerator()
    demand.add_setpoint(1.0, 0, 4 * MILLISECOND, 0.5, 10.0)
    demand.advance(16 * MILLISECOND)
    assert demand.position == pytest.approx(0.002)


def test_moves_join_in_a_smooth_curve_through_the_setpoints():
    demand, signal, period = MotionGenerator(), LinearInterpolator(0.0, 1), 4 * MILLISECOND
    newest = []
    for k in range(100):
        demand.advance(k * period)
        moves = demand.add_setpoint(5e-3 * np.sin(k / 16), k * period, period, 1.0, 10.0)
        newest.append(moves[-1])
        for move in moves:
            signal.add(move.end_ns - 1, move.target, move.begin_ns - 1)
    assert [move.begin_ns for move in newest[1:]] == [move.end_ns for move in newest[:-1]]
    times = np.arange(20 * period, 90 * period, MILLISECOND)
    assert signal.evaluate(times) == pytest.approx(5e-3 * np.sin((times / period - 4) / 16), abs=1e-7)


def test_a_host_that_paused_for_a_period_at_rest_does_not_count_as_late():
    demand, period = MotionGenerator(), 4 * MILLISECOND
    for k in range(200):
        at = k * period + (period if k > 50 else 0)
        demand.advance(at)
        demand.add_setpoint(max(k - 50, 0) * 1e-4, at, period, 1.0, 10.0)
    demand.advance(204 * period)
    assert demand.position == pytest.approx(149e-4)


def test_a_move_that_has_started_is_not_replaced():
    demand, period = MotionGenerator(), 4 * MILLISECOND
    for k in range(6):
        demand.advance(k * period)
        demand.add_setpoint(k * k * 1e-5, k * period, period, 1.0, 10.0)
    demand.advance(10 * period)
    assert len(demand.add_setpoint(36e-5, 6 * period, period, 1.0, 10.0)) == 1


def test_a_setpoint_that_is_nearly_a_period_late_does_not_shift_the_grid():
    late, punctual, period = MotionGenerator(), MotionGenerator(), 4 * MILLISECOND
    differences = []
    for k in range(60):
        for demand, delay in ((late, 3_700_000 if k == 20 else 0), (punctual, 0)):
            demand.advance(k * period + delay)
            demand.add_setpoint(k * k * 1e-6, k * period + delay, period, 1.0, 10.0)
        differences.append(abs(late.position - punctual.position) if k != 20 else 0.0)
    assert max(differences[25:]) < 2e-6


def test_the_grid_follows_the_earliest_setpoints_while_the_lateness_of_most_changes():
    demand, random, period = MotionGenerator(), np.random.default_rng(3), 4 * MILLISECOND
    differences = []
    for k in range(3000):
        max_delay = 2_900_000 if k // 500 % 2 else 400_000
        at = k * period + (int(random.integers(max_delay)) if k % 20 else 0)
        demand.add_setpoint(k * 4e-4, at, period, 1.0, 10.0)
        demand.advance((k + 1) * period)
        differences.append(demand.position - (k - 2) * 4e-4)
    assert np.ptp(differences[200:]) < 0.1 * 80e-6


@pytest.mark.parametrize("target", [0.01, -0.01])
def test_a_move_ends_at_its_target(target):
    demand = MotionGenerator()
    demand.move_to(target, 0.02)
    for k in range(1000):
        demand.advance(k * MILLISECOND)
    assert demand.position == target
    assert demand.state is MotionState.REST


def test_frames_take_their_transmission_time_and_the_lowest_identifier_goes_first():
    bus = BusTiming(1_000_000)
    for sender, identifier in (("a", 0x300), ("b", 0x100), ("c", 0x200)):
        bus.enqueue(CanFrame(identifier, bytes(8), sender), 0)
    assert bus.pop_transmitted(0) == []
    duration = count_frame_bits(8) * 1000
    assert bus.find_next_event() == duration
    transmitted = bus.pop_transmitted(10 * duration)
    assert [frame.identifier for _, frame in transmitted] == [0x100, 0x200, 0x300]
    assert [end for end, _ in transmitted] == [duration, 2 * duration, 3 * duration]
    assert bus.compute_load(6 * duration) == pytest.approx(0.5)


def test_frames_of_one_sender_keep_their_order():
    bus = BusTiming()
    for identifier in (0x205, 0x080):
        bus.enqueue(CanFrame(identifier, b"", "master"), 0)
    assert [frame.identifier for _, frame in bus.pop_transmitted(MILLISECOND)] == [0x205, 0x080]


def test_a_frame_waits_until_it_is_ready():
    bus = BusTiming()
    bus.enqueue(CanFrame(0x181, b"", "drive"), 5 * MILLISECOND)
    assert bus.pop_transmitted(MILLISECOND) == []
    assert bus.find_next_event() == 5 * MILLISECOND
    assert len(bus.pop_transmitted(6 * MILLISECOND)) == 1
    assert bus.find_next_event() is None


def test_frames_that_follow_each_other_are_transmitted_at_one_instant():
    bus = BusTiming()
    assert bus.find_idle_instant() is None
    for identifier in (0x205, 0x080):
        bus.enqueue(CanFrame(identifier, bytes(8), "master"), MILLISECOND)
    bus.enqueue(CanFrame(0x181, bytes(8), "late"), 5 * MILLISECOND)
    idle = MILLISECOND + 2 * count_frame_bits(8) * 1000
    assert bus.find_idle_instant() == idle
    assert bus.pop_next(MILLISECOND) is None
    assert bus.find_idle_instant() == idle
    assert [end for end, _ in bus.pop_transmitted(idle)][-1] == idle


def test_a_reply_wins_the_arbitration_against_later_frames_however_late_it_is_popped():
    bus = BusTiming()
    for identifier in (0x080, 0x605):
        bus.enqueue(CanFrame(identifier, b"", "master"), 0)
    end, frame = bus.pop_next(9 * MILLISECOND)
    bus.enqueue(CanFrame(0x185, b"", "drive"), end)
    assert frame.identifier == 0x080
    assert [frame.identifier for _, frame in bus.pop_transmitted(9 * MILLISECOND)] == [0x185, 0x605]
