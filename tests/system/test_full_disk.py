"""Runs on a disk that is nearly full, or fills while they are recorded: a small tmpfs, mounted for the test."""

import contextlib
import os
import subprocess

import pytest

from bench.agent_protocol.messages import RunCommand
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
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
        cycles = [{**segment, "cycles": 40} for segment in method()["segments"]]
        assert agent.send(RunCommand(method=method(segments=cycles[:1]), log=str(log))).ok
        assert any("GB free" in warning for warning in fetch_status(agent).warnings)
        until_segment(agent, "a")
        fill(disk)
        status = until_ended(agent)
        assert (status.state, status.run.outcome, status.run.ending) == ("idle", "incomplete", "tripped")
        assert "no space left on device" in status.run.reason
        until(bench.rests)
        refused = agent.send(RunCommand(method=method(), log=str(disk / "next.mcap")))
        assert not refused.ok
        assert "0.000 GB free, but the log of this run needs up to" in refused.error
        assert not (disk / "next.mcap").exists()
        (disk / "other").unlink()
        assert agent.send(RunCommand(method=method(), log=str(disk / "next.mcap"))).ok
        assert until_ended(agent).run.outcome == "clean"
    salvage_log(log)
    assert len(read_log(log).samples["time"]) > 100
