import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from recorder_examples import header, write_log
from typer.testing import CliRunner

from bench.cli import _application
from bench.errors import LogError
from bench.recorder.mcap_file import finish
from bench.recorder.reader import read_log
from bench.recorder.salvage import salvage
from bench.recorder.writer import LogWriter


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    write_log(path)
    return path


def chunk(path, number):
    with path.open("rb") as file:
        return make_reader(file).get_summary().chunk_indexes[number]


def cut(whole, folder, size):
    path = folder / "run.mcap"
    path.write_bytes(whole.read_bytes()[:size])
    return path


@pytest.fixture
def killed(whole, tmp_path):
    """A log whose file ends in the middle of its eighth chunk, with seven whole ones."""
    eighth = chunk(whole, 7)
    return cut(whole, tmp_path, eighth.chunk_start_offset + eighth.chunk_length // 2)


def test_every_closed_chunk_is_kept(whole, killed):
    result = salvage(killed)

    kept, all_ = read_log(killed).samples, read_log(whole).samples
    samples = len(kept["time"])
    assert result.samples == samples >= 600
    for name, column in kept.items():
        np.testing.assert_array_equal(column, all_[name][:samples])


def test_salvaged_log_keeps_what_else_stood_in_it(whole, killed):
    salvage(killed)

    mended, original = read_log(killed), read_log(whole)
    assert mended.attachments == original.attachments
    assert mended.segments[0].name == original.segments[0].name
    assert {k: v for k, v in mended.metadata.items() if k != "outcome"} == {
        k: v for k, v in original.metadata.items() if k != "outcome"
    }


def test_salvage_says_what_was_lost(whole, killed):
    eighth = chunk(whole, 7)

    result = salvage(killed)

    assert result.bytes_dropped == eighth.chunk_length // 2
    assert result.last_time < eighth.message_start_time / 1e9
    assert result.known_until == eighth.message_end_time / 1e9
    assert "dropped" in str(result)
    ending = read_log(killed).metadata["outcome"]
    assert ending["outcome"] == "truncated"
    assert float(ending["seconds_lost"]) == pytest.approx(result.known_until - result.last_time)


def test_broken_log_is_kept_beside_the_mended_one(killed):
    broken = killed.read_bytes()

    result = salvage(killed)

    assert result.broken.name == "run.mcap.broken"
    assert result.broken.read_bytes() == broken


def test_broken_log_stays_as_it_is_when_the_mended_one_goes_elsewhere(killed, tmp_path):
    broken = killed.read_bytes()

    result = salvage(killed, tmp_path / "mended.mcap")

    assert killed.read_bytes() == broken
    assert result.broken is None
    assert read_log(tmp_path / "mended.mcap").outcome == "truncated"


def test_log_that_is_whole_is_left_untouched(whole):
    before = whole.read_bytes()

    result = salvage(whole)

    assert result.was_whole
    assert "nothing to mend" in str(result)
    assert whole.read_bytes() == before


def test_log_without_its_index_loses_no_sample(whole, tmp_path):
    path = cut(whole, tmp_path, -30)

    assert salvage(path).samples == len(read_log(whole).samples["time"])


def test_damaged_chunk_is_left_out_and_the_rest_kept(whole, tmp_path):
    third = chunk(whole, 2)
    data = bytearray(whole.read_bytes())
    data[third.chunk_start_offset + 200] ^= 0xFF
    path = tmp_path / "run.mcap"
    path.write_bytes(data)

    result = salvage(path)

    assert 0 < len(read_log(whole).samples["time"]) - result.samples <= 101
    assert result.bytes_dropped == third.chunk_length


def test_salvage_twice_finds_nothing_to_mend(killed):
    salvage(killed)

    assert salvage(killed).was_whole


def test_file_of_another_kind_is_refused(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("no log")

    with pytest.raises(LogError, match="not an MCAP file"):
        salvage(path)


def test_log_of_another_profile_is_refused(tmp_path):
    with (tmp_path / "ros.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        finish(writer)

    with pytest.raises(LogError, match="'ros2', not 'mrbench'"):
        salvage(tmp_path / "ros.mcap")


def test_log_killed_before_its_first_sample_has_nothing_to_keep(tmp_path):
    path = tmp_path / "run.mcap"
    LogWriter(path, header()).close()
    path.write_bytes(path.read_bytes()[:600])

    with pytest.raises(LogError, match="nothing to keep"):
        salvage(path)

    assert [entry.name for entry in tmp_path.iterdir()] == ["run.mcap"]


def test_earlier_broken_log_is_never_overwritten(killed):
    killed.with_name("run.mcap.broken").write_bytes(b"earlier")

    with pytest.raises(LogError, match="stands there already"):
        salvage(killed)


def test_command_prints_what_was_lost(killed):
    from importlib.metadata import entry_points

    app = _application(entry_points(group="mrbench.commands").select(name="salvage"))
    result = CliRunner().invoke(app, ["salvage", str(killed)])

    assert result.exit_code == 0
    assert "samples kept" in result.output
