"""Zero check on the wires of the simulated rig: a zero shift of the load cell is in the record of the check."""

import pytest

from bench.checks import compute_records
from tests.support.live_bench import constant, make_force_scenario, record_check

pytestmark = [pytest.mark.wire, pytest.mark.timeout(240)]
SHIFT = 12.0
"""[N]"""
SEGMENTS = [
    {"name": name, "motion": {"kind": "hold"}, "duration_s": duration, "drive": constant(0.0)}
    for name, duration in (("settle", 1.0), ("rest", 3.0))
]
"""Segments of the shipped method, in a shorter time."""


def record(folder, zero_n):
    """Record a zero check with a known zero of the load cell [N]; return log and records by channel."""
    scenario = make_force_scenario(zero=zero_n, zero_spread=0.0)
    log = record_check(folder, scenario, "zero_check", SEGMENTS)
    return log, {one.channel: one for one in compute_records(log)}


@pytest.fixture(scope="module")
def checks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checks")
    return [record(folder / str(zero), zero) for zero in (0.0, SHIFT)]


def test_a_zero_shift_of_the_load_cell_is_the_difference_of_both_checks(checks):
    (_, before), (_, after) = checks
    # Each mean is known to 0.05 N.
    assert after["force"].value - before["force"].value == pytest.approx(SHIFT, abs=0.5)
    assert before["force"].standard_deviation == pytest.approx(2.5, rel=0.2)


def test_the_other_channels_have_not_moved(checks):
    (_, before), (_, after) = checks
    for channel, most in (("actuator_position", 2e-5), ("coil_voltage", 1e-3), ("coil_current", 1e-3)):
        assert abs(after[channel].value - before[channel].value) < most
        assert abs(before[channel].value) < most


def test_the_record_has_instrument_bench_and_untared_force(checks):
    log, records = checks[0]
    force = records["force"]
    assert (force.instrument, force.serial, force.bench, force.specimen) == (
        "load_cell",
        "1",
        "simulated rig",
        "none",
    )
    assert "force_raw" in log.samples
    assert force.duration_s == pytest.approx(3.0, abs=0.05)
    assert set(records) == {"force", "displacement", "actuator_position", "coil_voltage", "coil_current"}
