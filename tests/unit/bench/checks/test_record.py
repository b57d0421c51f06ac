"""Records of a check from the log of its run."""

import numpy as np
import pytest

from bench.checks import CHECK_KINDS, CHECK_METHODS, compute_records, find_check_kind
from bench.log import read_log
from bench.methods import load_method
from tests.support.checks import MOUNTED, REST, SETTLE, START, write_check_log, write_shunt_log


def read_records(path):
    return {one.channel: one for one in compute_records(read_log(path))}


def test_the_record_has_the_mean_of_the_rest_without_the_tare(tmp_path):
    record = read_records(write_check_log(tmp_path / "a.mcap", zero_n=8.0))["force"]
    # 800 samples with a noise of 2.5 N: the mean is known to 0.09 N. The tare of 50 N does not count.
    assert record.value == pytest.approx(8.0, abs=0.35)
    assert record.standard_deviation == pytest.approx(2.5, rel=0.1)
    assert record.standard_uncertainty == pytest.approx(2.5 / 800**0.5, rel=0.25)
    assert (record.unit, record.samples) == ("N", 800)
    assert record.duration_s == pytest.approx(REST, abs=0.01)
    assert (record.measured - START).total_seconds() == 1.0


def test_the_record_names_run_bench_instrument_and_temperature(tmp_path):
    record = read_records(write_check_log(tmp_path / "a.mcap", run="check-7"))["force"]
    assert (record.run, record.bench, record.specimen) == ("check-7", "bench 3", MOUNTED)
    assert (record.instrument, record.serial, record.temperature_c) == ("cell", "4242", 21.5)


def test_each_recorded_channel_has_a_record_in_its_unit(tmp_path):
    records = read_records(write_check_log(tmp_path / "a.mcap"))
    units = {channel: one.unit for channel, one in records.items()}
    assert units == {"force": "N", "displacement": "m", "coil_voltage": "V"}
    assert records["displacement"].value == pytest.approx(2e-5, abs=3e-7)
    assert records["displacement"].instrument == ""


def test_the_same_log_gives_the_same_record(tmp_path):
    path = write_check_log(tmp_path / "a.mcap", zero_n=3.0)
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(path.read_bytes())
    assert read_records(copy) == read_records(path)


@pytest.mark.parametrize("changes", [{"method": "quick"}, {"motion": "sine"}, {"outcome": "incomplete"}])
def test_a_run_that_is_no_completed_check_has_no_record(tmp_path, changes):
    assert read_records(write_check_log(tmp_path / "a.mcap", **changes)) == {}


def test_a_log_with_unreadable_instruments_has_a_record_without_them(tmp_path):
    log = read_log(write_check_log(tmp_path / "a.mcap"))
    log.attachments.update({"instruments.json": b'["cell"]', "bench.toml": b"[rig"})
    record = compute_records(log)[0]
    assert (record.channel, record.instrument, record.serial, record.bench) == ("force", "", "", "")


def test_a_log_without_untared_force_is_read_from_the_force(tmp_path):
    log = read_log(write_check_log(tmp_path / "a.mcap", zero_n=8.0, tare_n=0.0))
    log.samples["force_raw"] = np.full(len(log.samples["force"]), np.nan)
    assert {one.channel: one.value for one in compute_records(log)}["force"] == pytest.approx(8.0, abs=0.35)


def read_shunt(path, **changes):
    (record,) = compute_records(read_log(write_shunt_log(path, **changes)))
    return record


def test_a_shunt_check_has_one_record_with_the_change_of_the_force(tmp_path):
    record = read_shunt(tmp_path / "a.mcap", shunt_n=1010.0)
    assert (record.check, record.channel, record.unit) == ("shunt", "force", "N")
    # 600 samples in each segment: the difference is known to 2.5 N / sqrt(600) * sqrt(1.5) = 0.125 N.
    assert record.value == pytest.approx(1010.0, abs=0.5)
    assert record.standard_uncertainty == pytest.approx(0.125, rel=0.25)
    assert record.standard_deviation == pytest.approx(2.5, rel=0.1)
    assert (record.instrument, record.serial, record.specimen) == ("cell", "4242", MOUNTED)


def test_the_edges_of_the_segments_do_not_count(tmp_path):
    """The force follows the shunt 0.4 s late, which is within the margin of 0.5 s."""
    record = read_shunt(tmp_path / "a.mcap", late_s=0.4, noise_n=0.0)
    assert record.value == pytest.approx(1000.0, abs=1e-9)
    assert record.duration_s == pytest.approx(REST - 1.0, abs=0.02)
    begin = SETTLE + REST + 0.5
    assert (record.measured - START).total_seconds() == pytest.approx(begin, abs=0.01)
    assert read_shunt(tmp_path / "b.mcap", late_s=0.8, noise_n=0.0).value < 950.0


@pytest.mark.parametrize("rests", [(4, 4), (3, 8)])
def test_a_linear_drift_changes_neither_value_nor_uncertainty(tmp_path, rests):
    steady = read_shunt(tmp_path / "a.mcap", rests=rests)
    drifting = read_shunt(tmp_path / "b.mcap", rests=rests, drift=2.0)
    # The noise of 2.5 N gives a slope that is known to 0.04 N/s, which acts on the unequal rests only.
    assert drifting.value == pytest.approx(steady.value, abs=1e-6)
    assert drifting.standard_uncertainty == pytest.approx(steady.standard_uncertainty, rel=1e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {"outcome": "incomplete"},
        {"motion": "sine"},
        {"method": "quick"},
        {"marked": ()},
        {"marked": ("shunt", "rest_after")},
        {"names": ("rest", "shunt", "later")},
        {"names": ("before", "shunt", "rest_after")},
        {"names": ("rest_after", "shunt", "rest")},
        {"rests": (4, 1)},
    ],
)
def test_a_shunt_check_without_all_three_parts_has_no_record(tmp_path, changes):
    assert compute_records(read_log(write_shunt_log(tmp_path / "a.mcap", **changes))) == []


def test_a_zero_check_does_not_count_the_shunt(tmp_path):
    assert read_records(write_shunt_log(tmp_path / "a.mcap", method="zero_check"))["force"].value == pytest.approx(
        0.0, abs=0.35
    )


@pytest.mark.parametrize(
    ("method", "kind"),
    [
        ("zero_check", "zero"),
        ("zero_check_current", "zero"),
        ("shunt_check", "shunt"),
        ("quick", None),
        ("", None),
    ],
)
def test_the_method_names_the_kind_of_check(method, kind):
    assert find_check_kind(method) == kind


@pytest.mark.parametrize("kind", CHECK_KINDS)
def test_the_methods_of_a_check_are_shipped_for_both_drives(kind):
    for drive_kind, name in CHECK_METHODS[kind].items():
        method = load_method(name)
        assert (method.name, method.drive_kind) == (name, drive_kind)
        assert [one.shunt for one in method.segments].count(True) == (kind == "shunt")
