"""Records of a check from the log of its run."""

import numpy as np
import pytest

from bench.checks import compute_records
from bench.log import read_log
from tests.support.checks import MOUNTED, REST, START, write_check_log


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
