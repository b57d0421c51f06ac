"""Latest checks as the agent judges them, and their record in the log."""

from datetime import UTC, datetime, timedelta

import pytest

from bench.calibration import LatestCheck, list_failed, make_check_record, read_entry, read_failed

NOW = datetime(2026, 3, 1, 10, 0, tzinfo=UTC)
TEXT = "force: zero check of 2026-02-28 10:00 UTC is out of control: 8.2 N is above the limit 1.4 N"


def make_check(state="in_control", channel="force", age_days=1.0):
    measured = NOW - timedelta(days=age_days)
    return LatestCheck(channel=channel, check="zero", run="run-1", measured=measured, state=state, text=TEXT)


@pytest.mark.parametrize("state", ["not_enough", "no_limits", "in_control"])
def test_only_a_check_out_of_control_has_failed(state):
    assert list_failed([make_check(state)], ["force"], NOW, None) == []
    assert list_failed([make_check("out_of_control")], ["force"], NOW, None) == [TEXT]


def test_a_check_is_too_old_beyond_the_interval_only():
    assert list_failed([make_check(age_days=7.0)], ["force"], NOW, 7.0) == []
    assert list_failed([make_check(age_days=9.25)], ["force"], NOW, 7.0) == [
        "force: the latest zero check is 9.2 days old; one is due every 7 days"
    ]


def test_a_channel_without_check_has_failed_where_an_interval_is_set():
    assert list_failed([], ["force"], NOW, None) == []
    assert list_failed([], ["force"], NOW, 7.0) == ["force: no zero check yet; one is due every 7 days"]


def test_a_channel_that_is_not_checked_is_not_judged():
    assert list_failed([make_check("out_of_control")], ["displacement"], NOW, None) == []


def test_the_record_of_the_log_names_check_and_failure():
    checks = [make_check("out_of_control"), make_check(channel="displacement")]
    failed = [TEXT, "coil_voltage: no zero check yet; one is due every 7 days"]
    record = make_check_record(checks, failed)
    assert read_failed(record) == failed
    entry = read_entry(record["force"])
    assert (entry["run"], entry["state"], entry["failed"]) == ("run-1", "out_of_control", TEXT)
    assert read_entry(record["displacement"])["failed"] == ""
    assert read_failed({}) == []


SHUNT_TEXT = "force: shunt check of 2026-02-28 10:00 UTC is out of control: 1010 N is above the limit 1001 N"


def make_shunt_check(state, age_days=1.0):
    return make_check(state, age_days=age_days).model_copy(update={"check": "shunt", "text": SHUNT_TEXT})


def test_a_channel_fails_by_either_kind_of_check():
    zero, shunt = make_check(), make_shunt_check("out_of_control")
    assert list_failed([zero, shunt], ["force"], NOW, None) == [SHUNT_TEXT]
    both = [make_check("out_of_control"), shunt]
    assert list_failed(both, ["force"], NOW, None) == [TEXT, SHUNT_TEXT]
    assert list_failed([zero, make_shunt_check("in_control")], ["force"], NOW, None) == []


def test_the_interval_counts_zero_checks_only():
    old = make_shunt_check("in_control", age_days=30.0)
    assert list_failed([make_check(), old], ["force"], NOW, 7.0) == []
    new = make_shunt_check("in_control")
    assert list_failed([new], ["force"], NOW, 7.0) == ["force: no zero check yet; one is due every 7 days"]


def test_the_record_of_the_log_has_an_entry_for_each_kind():
    checks = [make_check(age_days=9.0), make_shunt_check("out_of_control")]
    failed = list_failed(checks, ["force"], NOW, 7.0)
    record = make_check_record(checks, failed)
    assert read_failed(record) == failed
    assert len(failed) == 2
    assert read_entry(record["force"])["failed"].startswith("force: the latest zero check is 9.0 days old")
    assert read_entry(record["force.shunt"])["failed"] == SHUNT_TEXT
