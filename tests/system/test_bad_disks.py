"""Runs on a bad disk: nearly full, full, read-only, or so slow that a second of the log takes eight.

The full disk is a small tmpfs. The read-only one is a mounted tmpfs, or a file layer that fails during the run.
The slow one is a file layer too (`tests.support.faulty_disk`): a mounted file system does not stall when asked to.
"""

import contextlib
import json
import os
import subprocess

import numpy as np
import pytest

from bench.agent_protocol import RunCommand
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
from tests.support.faulty_disk import COMMAND as FAULTY_DISK
from tests.support.live_bench import (
    fetch_status,
    live_bench,
    method,
    served_agent,
    until,
    until_ended,
    until_segment,
)

pytestmark = [pytest.mark.wire, pytest.mark.timeout(240)]

SIZE = 120_000_000
"""[byte] Size of the disk: the reserve, and room for the estimated log."""
ROOM_OF_TRAIL = 10_000_000
"""[byte] Room that suffices for the audit trail and not for a log."""


@pytest.fixture
def disk(tmp_path):
    """Small disk for the logs of a bench; where none can be mounted, the failing file layer remains."""
    folder = tmp_path / "runs"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", folder]
    try:
        mounted = subprocess.run(command, capture_output=True, text=True, timeout=10)
    except FileNotFoundError:
        pytest.skip("there is no mount command; tests/unit/bench/agent/test_run.py has a failing file layer")
    if mounted.returncode:
        pytest.skip(
            f"no disk can be mounted here ({mounted.stderr.strip()}); tests/unit/bench/agent/test_run.py has a "
            "failing file layer"
        )
    yield folder
    subprocess.run(["umount", "--lazy", folder], check=True, timeout=10)


def remount_read_only(folder):
    subprocess.run(["mount", "-o", "remount,ro", folder], check=True, timeout=10)


def lengthen(cycles):
    """Return the method with its first segment alone, of so many cycles."""
    return method(segments=[{**method()["segments"][0], "cycles": cycles}])


def fill(folder):
    """Fill a disk to the last byte."""
    with (folder / "other").open("wb") as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(1_000_000))
            file.flush()
    usage = os.statvfs(folder)
    assert usage.f_bavail * usage.f_frsize == 0


def test_full_disk_ends_a_run_in_order_and_refuses_the_next(tmp_path, disk):
    log = disk / "run.mcap"
    with live_bench(tmp_path) as bench, served_agent(bench) as agent:
        assert agent.send(RunCommand(method=lengthen(40), log=str(log))).ok
        assert any("GB free" in warning for warning in fetch_status(agent).warnings)
        until_segment(agent, "a")
        fill(disk)
        status = until_ended(agent)
        assert (status.state, status.run.outcome, status.run.ending) == ("idle", "incomplete", "tripped")
        assert "no space left on device" in status.run.reason
        until(bench.rests)
        refused = agent.send(RunCommand(method=method(), log=str(disk / "next.mcap")))
        assert not refused.ok
        assert "0 bytes are free for the audit trail" in refused.error
        os.truncate(disk / "other", (disk / "other").stat().st_size - ROOM_OF_TRAIL)
        refused = agent.send(RunCommand(method=method(), log=str(disk / "next.mcap")))
        assert not refused.ok
        assert "GB free, but the log of this run needs up to" in refused.error
        assert not (disk / "next.mcap").exists()
        (disk / "other").unlink()
        assert agent.send(RunCommand(method=method(), log=str(disk / "next.mcap"))).ok
        assert until_ended(agent).run.outcome == "clean"
    salvage_log(log)
    assert len(read_log(log).samples["time"]) > 100


def test_start_on_a_read_only_disk_is_refused(tmp_path, disk):
    remount_read_only(disk)
    with live_bench(tmp_path) as bench, served_agent(bench) as agent:
        refused = agent.send(RunCommand(method=method(), log=str(disk / "run.mcap")))
        assert not refused.ok
        assert "read-only file system" in refused.error.lower()
        status = fetch_status(agent)
        assert status.state == "idle"
        assert any("no run can be recorded" in warning for warning in status.warnings)
        assert bench.rests()


def test_disk_that_becomes_read_only_ends_the_run_in_order_and_the_cause_is_kept(tmp_path):
    log = tmp_path / "run.mcap"
    with live_bench(tmp_path) as bench, served_agent(bench, (*FAULTY_DISK, "read_only")) as agent:
        assert agent.send(RunCommand(method=lengthen(40), log=str(log))).ok
        status = until_ended(agent)
        assert (status.state, status.run.outcome, status.run.ending) == ("idle", "incomplete", "tripped")
        assert "read-only file system" in status.run.reason
        until(bench.rests)
    salvage_log(log)
    assert len(read_log(log).samples["time"]) > 100


def test_run_on_a_disk_that_stalls_for_seconds_keeps_all_samples_and_counts_dropped_frames(tmp_path):
    log = tmp_path / "run.mcap"
    with live_bench(tmp_path) as bench, served_agent(bench, (*FAULTY_DISK, "stalls")) as agent:
        assert agent.send(RunCommand(method=lengthen(24), log=str(log))).ok
        until(bench.strokes)
        status = until_ended(agent)
        assert (status.run.outcome, status.run.ending) == ("lossy", "completed")
    recorded = read_log(log)
    lost = json.loads(recorded.metadata["outcome"]["lost"])
    assert lost
    assert all(content.startswith("/wire/") for content in lost), lost
    gaps = np.diff(recorded.samples["time"])
    assert len(gaps) > 12_000
    assert gaps.max() < 0.0025
