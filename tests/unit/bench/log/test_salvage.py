import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from typer.testing import CliRunner

from bench.cli import _make_application
from bench.errors import LogError
from bench.log.mcap_file import finish
from bench.log.reader import read_log
from bench.log.salvage import SalvageResult, salvage_log
from bench.log.writer import LogWriter
from tests.support.logs import header, write_log
from tests.support.service_logs import write_complete_log


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    write_log(path)
    return path


def chunk(path, number):
    with path.open("rb") as file:
        return make_reader(file).get_summary().chunk_indexes[number]


def truncate(complete, folder, size):
    path = folder / "run.mcap"
    path.write_bytes(complete.read_bytes()[:size])
    return path


@pytest.fixture
def killed(complete, tmp_path):
    """Return a log whose file ends in the middle of its eighth chunk, after seven complete ones."""
    eighth = chunk(complete, 7)
    return truncate(complete, tmp_path, eighth.chunk_start_offset + eighth.chunk_length // 2)


def test_every_closed_chunk_is_kept(complete, killed):
    result = salvage_log(killed)

    kept, original = read_log(killed).samples, read_log(complete).samples
    samples = len(kept["time"])
    assert result.samples == samples >= 600
    for name, column in kept.items():
        np.testing.assert_array_equal(column, original[name][:samples])


def test_salvaged_log_keeps_attachments_segments_and_metadata(complete, killed):
    salvage_log(killed)

    repaired, original = read_log(killed), read_log(complete)
    assert repaired.attachments == original.attachments
    assert repaired.segments[0].name == original.segments[0].name
    assert {k: v for k, v in repaired.metadata.items() if k != "outcome"} == {
        k: v for k, v in original.metadata.items() if k != "outcome"
    }


def test_salvage_reports_the_losses(complete, killed):
    eighth = chunk(complete, 7)

    result = salvage_log(killed)

    assert result.bytes_dropped == eighth.chunk_length // 2
    assert result.last_time < eighth.message_start_time / 1e9
    assert result.known_until == eighth.message_end_time / 1e9
    assert "dropped" in str(result)
    final = read_log(killed).metadata["outcome"]
    assert final["outcome"] == "truncated"
    assert float(final["seconds_lost"]) == pytest.approx(result.known_until - result.last_time)


def test_length_is_that_of_the_recording_although_the_bench_clock_started_long_before(tmp_path):
    path = write_complete_log(tmp_path / "run.mcap", first_s=3_000_000.0)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    result = salvage_log(path)
    samples = read_log(path).samples["time"]
    assert 1.0 < result.duration < 2.0
    assert result.duration == pytest.approx(samples[-1])
    assert f"{len(samples)} samples kept, {samples[-1]:.1f} s;" in str(result)


def test_truncated_log_is_kept_as_a_backup(killed):
    truncated = killed.read_bytes()

    result = salvage_log(killed)

    assert result.backup.name == "run.mcap.broken"
    assert result.backup.read_bytes() == truncated


def test_truncated_log_is_unchanged_when_the_repaired_one_has_another_name(killed, tmp_path):
    truncated = killed.read_bytes()

    result = salvage_log(killed, tmp_path / "repaired.mcap")

    assert killed.read_bytes() == truncated
    assert result.backup is None
    assert read_log(tmp_path / "repaired.mcap").outcome == "truncated"


def test_complete_log_is_not_changed(complete):
    before = complete.read_bytes()

    result = salvage_log(complete)

    assert result.was_complete
    assert "nothing to repair" in str(result)
    assert complete.read_bytes() == before


def test_log_without_its_index_loses_no_sample(complete, tmp_path):
    path = truncate(complete, tmp_path, -30)

    assert salvage_log(path).samples == len(read_log(complete).samples["time"])


def test_only_the_damaged_chunk_is_dropped(complete, tmp_path):
    third = chunk(complete, 2)
    data = bytearray(complete.read_bytes())
    data[third.chunk_start_offset + 200] ^= 0xFF
    path = tmp_path / "run.mcap"
    path.write_bytes(data)

    result = salvage_log(path)

    assert 0 < len(read_log(complete).samples["time"]) - result.samples <= 101
    assert result.bytes_dropped == third.chunk_length


def test_second_salvage_finds_nothing_to_repair(killed):
    salvage_log(killed)

    assert salvage_log(killed).was_complete


def test_file_of_another_kind_is_refused(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("not a log")

    with pytest.raises(LogError, match="not an MCAP file"):
        salvage_log(path)


def test_log_of_another_profile_is_refused(tmp_path):
    with (tmp_path / "ros.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        finish(writer)

    with pytest.raises(LogError, match="'ros2', not 'mrbench'"):
        salvage_log(tmp_path / "ros.mcap")


def test_log_without_a_sample_cannot_be_salvaged(tmp_path):
    path = tmp_path / "run.mcap"
    LogWriter(path, header()).close()
    path.write_bytes(path.read_bytes()[:600])

    with pytest.raises(LogError, match="nothing to keep"):
        salvage_log(path)

    assert [entry.name for entry in tmp_path.iterdir()] == ["run.mcap"]


def test_existing_backup_is_never_overwritten(killed):
    killed.with_name("run.mcap.broken").write_bytes(b"earlier")

    with pytest.raises(LogError, match="the file exists"):
        salvage_log(killed)


def test_command_prints_the_losses(killed):
    from importlib.metadata import entry_points

    app = _make_application(entry_points(group="mrbench.commands").select(name="salvage"))
    result = CliRunner().invoke(app, ["salvage", str(killed)])

    assert result.exit_code == 0
    assert "samples kept" in result.output


@pytest.mark.parametrize(
    ("known_until", "lost"),
    [(2.75, "0.250 s after them"), (2.5, "0.000 s after them"), (1.0, "0.000 s after them")],
)
def test_description_of_a_repair_gives_the_time_lost_after_the_last_sample(tmp_path, known_until, lost):
    result = SalvageResult(tmp_path, False, 3, duration=2.0, last_time=2.5, known_until=known_until)

    assert f"3 samples kept, 2.0 s; 0 bytes dropped, {lost}" in str(result)
