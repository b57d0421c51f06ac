"""Store of the samples as columns."""

import numpy as np
import pytest

from bench.errors import LogError
from bench.log import read_log
from bench.samples import SampleStore
from tests.support.logs import write_log
from tests.support.service_logs import STARTED, write_complete_log, write_truncated_log


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "run.mcap"
    write_log(path)
    return path


def test_the_samples_are_those_of_the_log_with_units_and_segments(tmp_path, log):
    table = SampleStore(tmp_path).load(log, None)
    recorded = read_log(log).samples
    np.testing.assert_allclose(table.columns["force"], recorded["force"], rtol=1e-6)
    np.testing.assert_array_equal(table.time, recorded["time"])
    assert (table.units["force"], table.units["coil_drive"], table.drive_unit) == ("N", "V", "V")
    (segment,) = table.segments
    assert (segment.name, segment.first, segment.samples) == ("10mm_1Hz_0.2V", 100, 900)
    assert (segment.start_s, segment.stop_s) == (pytest.approx(0.2), pytest.approx(1.998))
    assert (segment.amplitude_m, segment.frequency_hz, segment.drive_value) == (0.01, 1.0, 0.2)


def test_a_stored_table_is_equal_and_needs_no_log(tmp_path, log):
    store = SampleStore(tmp_path)
    first = store.load(log, "abc")
    log.unlink()
    second = store.load(log, "abc")
    assert (second.segments, second.units) == (first.segments, first.units)
    np.testing.assert_array_equal(second.columns["segment"], first.columns["segment"])
    np.testing.assert_array_equal(second.time, first.time)


def test_the_start_is_that_of_the_first_sample(tmp_path):
    write_complete_log(tmp_path / "run.mcap", first_s=5.0)
    table = SampleStore(tmp_path).load(tmp_path / "run.mcap", None)
    assert table.started_utc_s == STARTED.timestamp() + 5.0


def test_a_damaged_table_is_made_again(tmp_path, log):
    store = SampleStore(tmp_path)
    store.load(log, "abc")
    (tmp_path / ".samples" / "abc.npz").write_bytes(b"PK nothing")
    assert len(store.load(log, "abc").time) == 1500


def test_a_table_that_cannot_be_stored_is_returned(tmp_path, log, caplog):
    (tmp_path / ".samples").write_text("a file is in the place of the folder")
    assert len(SampleStore(tmp_path).load(log, "abc").time) == 1500
    assert "samples_not_stored" in caplog.messages


def test_tables_above_the_size_are_deleted(tmp_path, log):
    store = SampleStore(tmp_path, max_bytes=1)
    store.load(log, "abc")
    assert list((tmp_path / ".samples").glob("*.npz")) == []


def test_a_truncated_log_is_refused(tmp_path):
    write_truncated_log(tmp_path / "run.mcap")
    with pytest.raises(LogError, match="truncated"):
        SampleStore(tmp_path).load(tmp_path / "run.mcap", None)
