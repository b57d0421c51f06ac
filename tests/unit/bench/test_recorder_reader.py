import json

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from recorder_examples import header, times, values, write_log

from bench.errors import LogError
from bench.recorder.reader import read_log
from bench.recorder.salvage import salvage
from bench.recorder.writer import LogWriter


@pytest.fixture(scope="module", params=["clean", "truncated"])
def whole(request, tmp_path_factory):
    """A log, what was written to it, and what was read; closed, or salvaged after a kill before its index."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    written = write_log(path)
    if request.param == "truncated":
        path.write_bytes(path.read_bytes()[:-200])
        salvage(path)
    return path, written, read_log(path)


def second_chunk(path):
    with path.open("rb") as file:
        return make_reader(file).get_summary().chunk_indexes[1].chunk_start_offset


def test_values_come_back_to_the_last_bit(whole):
    _, written, log = whole

    for name, column in written.items():
        np.testing.assert_array_equal(log.samples[name], column)


def test_time_starts_at_the_first_sample(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.samples(times(10, first=5_000_000_000), values(10))

    samples = read_log(tmp_path / "run.mcap").samples

    assert samples["time"][0] == 0.0
    assert samples["time"][-1] == pytest.approx(0.018)
    assert samples["time_ns"][0] == 5_000_000_000


def test_segment_covers_its_samples(whole):
    segment = whole[2].segments[0]

    assert (segment.start, segment.stop) == (100, 1000)
    assert (segment.name, segment.stretch, segment.amplitude) == ("10mm_1Hz_0.2V", "quick", 0.01)


def test_segment_without_an_end_reaches_to_the_last_sample(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.segment(
            0,
            phase="start",
            index=0,
            name="a",
            stretch="s",
            motion="hold",
            drive="constant",
            amplitude=None,
            frequency=None,
            drive_value=None,
        )
        log.samples(times(10), values(10))

    assert read_log(tmp_path / "run.mcap").segments[0].stop == 10


def test_channel_that_some_samples_lack_is_nan_there(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.samples(times(3), values(3, temperature=[20.0, np.nan, 21.0]))

    np.testing.assert_array_equal(read_log(tmp_path / "run.mcap").samples["temperature"], [20.0, np.nan, 21.0])


def test_metadata_says_how_the_run_was_made(whole):
    metadata = whole[2].metadata

    assert metadata["run"]["specimen"] == "damper 7"
    assert json.loads(metadata["run"]["versions"]) == {"mrbench": "0.1.0"}
    assert metadata["units"]["coil_drive"] == "V"
    assert metadata["units"]["velocity_from"] == "smoothed displacement"
    assert json.loads(metadata["channels"]["force"])["delay_s"] == 0.001


def test_events_and_attachments_come_back(whole):
    log = whole[2]

    assert log.events[0]["text"] == "run finished"
    assert log.events[0]["reason"] == "plan"
    assert log.attachments["method.json"] == b"{}"


def test_outcome_says_how_the_recording_ended(whole, request):
    assert whole[2].outcome == request.node.callspec.params["whole"]


def test_file_of_another_kind_is_refused(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time_s,force_n\n")

    with pytest.raises(LogError, match=r"run\.csv: not an MCAP file"):
        read_log(path)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(LogError, match=r"run\.mcap: no such file"):
        read_log(tmp_path / "run.mcap")


@pytest.mark.parametrize("kept", [8, 0.5, -4])
def test_truncated_log_says_how_to_mend_it(whole, tmp_path, kept):
    data = whole[0].read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(kept * len(data)) if isinstance(kept, float) else kept])

    with pytest.raises(LogError, match=r"truncated.*mrbench salvage"):
        read_log(path)


def test_damaged_chunk_is_noticed(whole, tmp_path):
    data = bytearray(whole[0].read_bytes())
    data[second_chunk(whole[0]) + 200] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)

    with pytest.raises(LogError, match=r"damaged.*mrbench salvage"):
        read_log(path)


def test_log_of_another_profile_is_refused(tmp_path):
    with (tmp_path / "ros.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        writer.finish()

    with pytest.raises(LogError, match="'ros2', not 'mrbench'"):
        read_log(tmp_path / "ros.mcap")


def test_log_without_a_sample_is_refused(tmp_path):
    LogWriter(tmp_path / "run.mcap", header()).close()

    with pytest.raises(LogError, match="holds no sample"):
        read_log(tmp_path / "run.mcap")
