"""Position, velocity, torque and clock of the simulated servo drive."""

import math

import pytest

from sim_rig.instruments.encoder import DriveMechanics, DriveSensors, compute_torque

MILLISECOND = 1_000_000


@pytest.fixture
def sensors(signals):
    return DriveSensors(signals, DriveMechanics(clock_offset_ns=2_000_000, ppm=100.0))


def test_torque_is_force_times_lead_over_two_pi(signals, sensors):
    assert compute_torque(1000.0, 5e-3) == pytest.approx(0.795775, rel=1e-6)
    assert compute_torque(1000.0) == compute_torque(1000.0, 5e-3)


@pytest.mark.parametrize(
    ("force", "per_mille"),
    [(1000.0, 796), (-1000.0, -796), (1e6, 32767), (-1e6, -32768), (math.nan, 0), (None, 0)],
)
def test_torque_is_reported_in_thousandths_of_the_rated_one(signals, sensors, force, per_mille):
    signals.samples["force"] = [] if force is None else [(0, force)]
    assert sensors.read_torque(0, 1.0) == per_mille


def test_torque_is_relative_to_the_rated_one(signals, sensors):
    signals.samples["force"] = [(0, 1000.0)]
    assert sensors.read_torque(0, 2.0) == 398


def test_clock_is_in_microseconds_with_offset_rate_error_and_32_bits(sensors):
    assert sensors.read_clock_us(0) == 2_000
    assert sensors.read_clock_us(10_000_000_000) == 10_003_000
    assert sensors.read_clock_us(2**32 * 1000) == 2_000 + 429_496


def test_velocity_is_the_slope_of_the_last_five_positions(signals, sensors):
    signals.samples["actuator_position"] = [(k * MILLISECOND, 99.0 if k < 2 else 1e-3 * k) for k in range(7)]
    assert sensors.read_motion(6 * MILLISECOND) == (6 * MILLISECOND, 6e-3, pytest.approx(1.0))
    assert sensors.read_motion(7 * MILLISECOND)[0] == 6 * MILLISECOND


@pytest.mark.parametrize(
    ("positions", "motion"),
    [([], (9, 0.0, 0.0)), ([0.5], (9, 0.5, 0.0)), ([0.5, 0.502], (1_000_000, 0.502, pytest.approx(2.0)))],
)
def test_velocity_needs_two_positions(signals, sensors, positions, motion):
    signals.samples["actuator_position"] = [(k * MILLISECOND, value) for k, value in enumerate(positions)]
    assert sensors.read_motion(9 if len(positions) < 2 else 9 * MILLISECOND) == motion


def test_position_is_the_newest_sample_or_zero(signals, sensors):
    signals.now = 5 * MILLISECOND
    assert sensors.read_position() == (5 * MILLISECOND, 0.0)
    signals.samples["actuator_position"] = [(0, 0.1), (MILLISECOND, 0.2)]
    assert sensors.read_position() == (MILLISECOND, 0.2)
