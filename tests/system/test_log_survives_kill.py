import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bench.errors import LogError
from bench.log.reader import read_log

RECORDER = Path(__file__).with_name("record_in_real_time.py")


def record_and_kill(log, moment):
    """Record until the bench clock has passed a moment [s], then kill; return the last sample's time [s]."""
    with subprocess.Popen(
        [sys.executable, str(RECORDER), str(log)], stdout=subprocess.PIPE, text=True
    ) as recorder:
        last = 0
        for line in recorder.stdout:
            if last < moment * 1e9 <= int(line):
                recorder.send_signal(signal.SIGKILL)
            if line.endswith("\n"):
                last = int(line)
    assert recorder.returncode == -signal.SIGKILL
    return last * 1e-9


def mrbench(*words):
    command = [sys.executable, "-m", "bench.cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture(scope="module", params=[0.31, 0.64, 1.0, 1.73])
def killed(request, tmp_path_factory):
    """Return a salvaged log, the time of the last sample written [s], and the result of the salvage."""
    log = tmp_path_factory.mktemp("killed") / "run.mcap"
    last = record_and_kill(log, request.param)
    with pytest.raises(LogError, match="mrbench salvage"):
        read_log(log)
    return log, last, mrbench("salvage", log)


def test_kill_loses_at_most_half_a_second(killed):
    log, last, _ = killed

    assert 0 <= last - read_log(log).samples["time_ns"][-1] * 1e-9 <= 0.5


def test_kept_samples_have_no_gap(killed):
    samples = read_log(killed[0]).samples

    np.testing.assert_array_equal(samples["force"], samples["time_ns"] * 1e-9)
    assert set(samples["segment"]) == {0}


def test_salvage_reports_the_loss(killed):
    log, _, result = killed

    kept = len(read_log(log).samples["time"])
    assert result.returncode == 0
    assert f"{kept} samples kept" in result.stdout
    assert "bytes dropped" in result.stdout


def test_salvaged_log_is_marked_as_truncated(killed):
    log = read_log(killed[0])

    assert log.outcome == "truncated"
    # Of the samples whose times are known from the file, at most those of the open chunk are lost.
    assert 0 <= float(log.metadata["outcome"]["seconds_lost"]) < 0.5
    assert log.metadata["run"]["id"] == "endless"


def test_salvaged_log_can_be_exported_and_needs_no_further_repair(killed):
    assert mrbench("export", killed[0], "--format", "csv").returncode == 0
    assert "nothing to repair" in mrbench("salvage", killed[0]).stdout
