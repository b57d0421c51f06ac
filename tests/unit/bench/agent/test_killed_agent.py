"""Log of a run whose agent was killed: recognised as truncated, and salvaged with the samples before the kill."""

import signal
import subprocess
import sys

import numpy as np
import pytest

from bench.agent.ownership import acquire_agent_lock
from bench.catalogue import Catalogue, make_sqlite_url, open_database, scan_logs
from bench.catalogue.log_summary import read_log_summary
from bench.errors import LogError
from bench.log.chunked_writer import CHUNK_TIME
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
from tests.support.agent_killed_during_run import FIRST_IN_SEGMENT
from tests.support.logs import RATE, times, values

CHUNK_SAMPLES = round(CHUNK_TIME * RATE)
SAMPLES = 10 * CHUNK_SAMPLES + CHUNK_SAMPLES // 2
"""Samples that the agent recorded: ten chunks and a half."""


def kill_during_run(folder, *options):
    """Let an agent record and die; return its log."""
    command = [sys.executable, "-m", "tests.support.agent_killed_during_run", str(folder), str(SAMPLES), *options]
    process = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert process.returncode == -signal.SIGKILL, process.stderr
    return folder / "run.mcap"


def scan(folder):
    """Return the catalogued runs of a folder; none of their logs is being written."""
    catalogue = Catalogue(open_database(make_sqlite_url(folder / "catalogue.db")), folder)
    try:
        return scan_logs(catalogue, lambda path: False)
    finally:
        catalogue.close()


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """Return the log of an agent that was killed in the middle of a chunk."""
    return kill_during_run(tmp_path_factory.mktemp("killed"))


@pytest.fixture
def truncated(killed, tmp_path):
    """Return a copy of that log, which a test may repair."""
    path = tmp_path / "run.mcap"
    path.write_bytes(killed.read_bytes())
    return path


def test_log_is_recognised_as_truncated(truncated):
    with pytest.raises(LogError, match=r"the log is truncated, its recorder was killed; run `mrbench salvage"):
        read_log(truncated)
    summary = read_log_summary(truncated)
    assert (summary.method, summary.outcome, summary.duration_s) == ("test_method", None, None)


def test_run_is_catalogued_as_truncated_until_its_log_is_salvaged(truncated):
    (row,) = scan(truncated.parent)
    assert (row.state, row.outcome, "mrbench salvage" in row.reason) == ("truncated", None, True)
    salvage_log(truncated)
    (repaired,) = scan(truncated.parent)
    assert (repaired.id, repaired.state, repaired.outcome) == (row.id, "ended", "truncated")


def test_salvaged_log_contains_all_samples_but_those_of_the_open_chunk(truncated):
    result = salvage_log(truncated)
    log = read_log(truncated)
    kept = len(log.samples["time"])
    assert log.outcome == "truncated"
    assert SAMPLES - CHUNK_SAMPLES <= result.samples == kept < SAMPLES
    expected = values(SAMPLES)
    np.testing.assert_array_equal(log.samples["time_ns"], times(SAMPLES)[:kept])
    for name in ("displacement", "velocity", "force", "coil_drive"):
        np.testing.assert_array_equal(log.samples[name], expected[name][:kept])


def test_salvaged_log_contains_every_sample_that_was_synced(tmp_path):
    path = kill_during_run(tmp_path, "synced")
    assert salvage_log(path).samples == SAMPLES
    np.testing.assert_array_equal(read_log(path).samples["time_ns"], times(SAMPLES))


def test_salvaged_log_keeps_what_describes_the_run(truncated):
    salvage_log(truncated)
    log = read_log(truncated)
    assert log.metadata["run"]["method"] == "test_method"
    assert {"method.json", "bench.toml"} <= log.attachments.keys()
    assert [event["text"] for event in log.events] == ["first stroke"]
    (segment,) = log.segments
    assert (segment.name, segment.start, segment.stop) == ("a", FIRST_IN_SEGMENT, len(log.samples["time"]))
    assert set(log.samples["segment"][FIRST_IN_SEGMENT:]) == {0}


def test_bench_is_free_for_the_next_agent(killed):
    with acquire_agent_lock(killed.with_name("bench.toml")):
        pass
