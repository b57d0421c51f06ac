"""Status of the instruments, with their age in seconds, and warnings."""

from types import SimpleNamespace

import pytest

from bench.agent.status import collect_warnings, make_instrument_statuses
from drivers.instrument import Health


def make_status(health, failed=(), is_known=True):
    instrument = SimpleNamespace(get_health=lambda: health)
    registered = SimpleNamespace(name="lvdt", driver="lvdt", address="tcp://a", instrument=instrument)
    clock_map = SimpleNamespace(is_known=is_known, compute_error_bound=lambda: 2e-4)
    acquisition = SimpleNamespace(maps={"lvdt": clock_map}, failed_instruments=failed)
    (status,) = make_instrument_statuses([registered], acquisition, lambda: 10_000_000_000)
    return status


def test_age_counts_from_the_last_frame():
    status = make_status(Health(True, 1, 2, 3, 4, 7_500_000_000, ""))
    assert status.age_s == pytest.approx(2.5)
    assert (status.received, status.lost, status.corrupted, status.resynchronised) == (1, 2, 3, 4)
    assert (status.connected, status.message, status.clock_error_bound_s) == (True, "", 2e-4)


def test_instrument_without_a_frame_has_no_age_and_without_a_clock_no_bound():
    status = make_status(Health(True, 0, 0, 0, 0, None, ""), is_known=False)
    assert (status.age_s, status.clock_error_bound_s) == (None, None)


@pytest.mark.parametrize(
    ("connected", "message", "failed", "expected"),
    [
        (True, "", ("lvdt",), (False, "does not reply")),
        (True, "over range", ("lvdt",), (False, "over range")),
        (True, "over range", ("other",), (True, "over range")),
        (False, "", (), (False, "")),
    ],
)
def test_instrument_whose_reading_failed_is_not_connected(connected, message, failed, expected):
    status = make_status(Health(connected, 0, 0, 0, 0, None, message), failed)
    assert (status.connected, status.message) == expected


@pytest.mark.parametrize(
    ("priority", "expected"),
    [
        ("", ("no priority", "slow disk")),
        ("no priority", ("slow disk", "no priority; the drive stops by itself 0.05 s after the last setpoint")),
    ],
)
def test_missing_priority_is_listed_once_with_its_consequence(priority, expected):
    acquisition = SimpleNamespace(warnings=["no priority", "slow disk"])
    assert collect_warnings(acquisition, priority, 0.05, "") == expected


def test_little_space_is_a_warning():
    warnings = collect_warnings(SimpleNamespace(warnings=["slow disk"]), "", 0.05, "the disk has 0.4 GB free")
    assert warnings == ("slow disk", "the disk has 0.4 GB free")
