"""A service keeps the agent of its bench.toml running, and replaces it when the file changes."""

import contextlib
import os
import re
import signal

import psutil
import pytest

from bench.agent_protocol import AgentClient, StatusCommand, find_agent
from bench.errors import AgentUnreachableError, ConfigError
from tests.system.test_listening_sockets import process_tree, start, wait_for

pytestmark = [pytest.mark.wire, pytest.mark.timeout(400)]


def find_agent_pid(service):
    for one in process_tree(service):
        with contextlib.suppress(psutil.Error):  # it has just ended
            if "rig" in one.cmdline()[:5]:
                return one.pid
    return None


def is_ready(config):
    """Return whether the agent answers and has all instruments."""
    try:
        status = AgentClient(*find_agent(config)).send(StatusCommand(), 1.0).status
    except (AgentUnreachableError, ConfigError):
        return False
    return status.state == "idle" and all(one.connected for one in status.instruments)


def test_a_killed_agent_is_started_again_and_one_with_a_former_bench_toml_is_replaced(tmp_path):
    config, log = tmp_path / "bench.toml", tmp_path / "service.log"
    sims = [start(["sim", "--out", "bench.toml"], tmp_path, tmp_path / "sim.log")]
    processes = list(sims)
    try:
        wait_for(config.is_file, (tmp_path / "sim.log").read_text)
        service = start(["serve", "--config", "bench.toml", "--port", "0", "--data", "runs"], tmp_path, log)
        processes.append(service)
        wait_for(lambda: "(the token is new" in log.read_text(), log.read_text)
        first = find_agent_pid(service)
        os.kill(first, signal.SIGKILL)
        wait_for(lambda: find_agent_pid(service) not in (None, first) and is_ready(config), log.read_text)
        assert re.search(rf"agent_ended pid={first} why=.killed by SIGKILL", log.read_text())

        sims[0].send_signal(signal.SIGINT)
        assert sims[0].wait(60) == 0
        assert not config.exists()
        second = find_agent_pid(service)
        processes.append(start(["sim", "--out", "bench.toml"], tmp_path, tmp_path / "sim.log"))
        wait_for(lambda: find_agent_pid(service) not in (None, second) and is_ready(config), log.read_text)
        assert "agent_replaced" in log.read_text()
    finally:
        for process in reversed(processes):
            process.send_signal(signal.SIGINT)
            process.wait(60)
