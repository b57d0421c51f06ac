import json

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from bench.errors import LogError
from bench.log.chunks import read_chunks
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
from bench.log.writer import LogWriter
from tests.support.logs import header, times, values, write_log


@pytest.fixture(scope="module", params=["clean", "truncated"])
def logged(request, tmp_path_factory):
    """Return path, written values and content of a log; closed, or salvaged after a kill before its index."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    written = write_log(path)
    if request.param == "truncated":
        path.write_bytes(path.read_bytes()[:-200])
        salvage_log(path)
    return path, written, read_log(path)


def second_chunk(path):
    with path.open("rb") as file:
        return make_reader(file).get_summary().chunk_indexes[1].chunk_start_offset


def test_values_are_restored_to_the_last_bit(logged):
    _, written, log = logged

    for name, column in written.items():
        np.testing.assert_array_equal(log.samples[name], column)


def test_time_starts_at_the_first_sample(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_samples(times(10, first=5_000_000_000), values(10))

    samples = read_log(tmp_path / "run.mcap").samples

    assert samples["time"][0] == 0.0
    assert samples["time"][-1] == pytest.approx(0.018)
    assert samples["time_ns"][0] == 5_000_000_000


def test_segment_covers_its_samples(logged):
    segment = logged[2].segments[0]

    assert (segment.start, segment.stop) == (100, 1000)
    assert (segment.name, segment.stretch, segment.amplitude) == ("10mm_1Hz_0.2V", "quick", 0.01)


def test_segment_without_an_end_extends_to_the_last_sample(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_segment(
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
        log.write_samples(times(10), values(10))

    assert read_log(tmp_path / "run.mcap").segments[0].stop == 10


def test_missing_value_of_a_channel_is_nan(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_samples(times(3), values(3, temperature=[20.0, np.nan, 21.0]))

    np.testing.assert_array_equal(read_log(tmp_path / "run.mcap").samples["temperature"], [20.0, np.nan, 21.0])


def test_field_that_only_later_chunks_contain_is_missing_before(tmp_path):
    count = 5000  # samples that need several chunks
    instants = times(count + 3)
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_samples(instants[:count], values(count))
        log.write_samples(instants[count:], values(3, temperature=[20.0, 21.0, 22.0], segment=[0, 0, 1]))

    samples = read_log(tmp_path / "run.mcap").samples

    np.testing.assert_array_equal(samples["temperature"], [np.nan] * count + [20.0, 21.0, 22.0])
    np.testing.assert_array_equal(samples["segment"], [-1] * count + [0, 0, 1])
    assert samples["segment"].dtype == np.int64


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
@pytest.mark.parametrize("is_chunked", [True, False])
def test_chunks_contain_the_messages_that_the_library_reads(tmp_path, compression, is_chunked):
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=200, compression=compression, use_chunking=is_chunked)
        writer.start("mrbench")
        channels = {name: writer.register_channel(name, "json", 0) for name in ("a", "b", "c")}
        for number in range(60):
            topic = "abc"[number % 3]
            writer.add_message(channels[topic], number, f"{topic}{number}".encode(), number)
        writer.finish()
    with path.open("rb") as file:
        expected = [(c.topic, m.data) for _, c, m in make_reader(file).iter_messages(topics=["a", "c"])]
    with path.open("rb") as file:
        chunks = list(read_chunks(file, ("a", "c")))
    assert len(chunks) > 1
    for topic in "ac":
        found = [body for chunk in chunks for body in chunk.get(topic, [])]
        assert found == [body for name, body in expected if name == topic]


def test_metadata_describe_the_run(logged):
    metadata = logged[2].metadata

    assert metadata["run"]["specimen"] == "damper 7"
    assert json.loads(metadata["run"]["versions"]) == {"mrbench": "0.1.0"}
    assert metadata["units"]["coil_drive"] == "V"
    assert metadata["units"]["velocity_from"] == "smoothed displacement"
    assert json.loads(metadata["channels"]["force"])["delay_s"] == 0.001


def test_events_and_attachments_are_restored(logged):
    log = logged[2]

    assert log.events[0]["text"] == "run finished"
    assert log.events[0]["reason"] == "plan"
    assert log.attachments["method.json"] == b"{}"


def test_outcome_is_the_end_of_the_recording(logged, request):
    assert logged[2].outcome == request.node.callspec.params["logged"]


def test_file_of_another_kind_is_refused(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time_s,force_n\n")

    with pytest.raises(LogError, match=r"run\.csv: not an MCAP file"):
        read_log(path)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(LogError, match=r"run\.mcap: no such file"):
        read_log(tmp_path / "run.mcap")


@pytest.mark.parametrize("kept", [8, 0.5, -4])
def test_message_on_a_truncated_log_names_the_repair(logged, tmp_path, kept):
    data = logged[0].read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(kept * len(data)) if isinstance(kept, float) else kept])

    with pytest.raises(LogError, match=r"truncated.*mrbench salvage"):
        read_log(path)


def test_damaged_chunk_is_an_error(logged, tmp_path):
    data = bytearray(logged[0].read_bytes())
    data[second_chunk(logged[0]) + 200] ^= 0xFF
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

    with pytest.raises(LogError, match="contains no sample"):
        read_log(tmp_path / "run.mcap")
