"""Listening sockets of a running bench: all are on the loopback interface."""

import ipaddress
import os
import re
import signal
import subprocess
import sys
import time

import psutil
import pytest

MRBENCH = (sys.executable, "-m", "bench.cli")
DEADLINE = 120.0
ENVIRONMENT = os.environ | {"MRBENCH_NICE": "0"}


def start(words, folder, log):
    with log.open("w") as file:
        return subprocess.Popen([*MRBENCH, *words], cwd=folder, stdout=file, stderr=file, env=ENVIRONMENT)


def wait_for(condition, message):
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end, message()
        time.sleep(0.1)


def process_tree(process):
    parent = psutil.Process(process.pid)
    return [parent, *parent.children(recursive=True)]


def list_sockets(process):
    """Return address, port and command of all listening TCP and bound UDP sockets of a process tree."""
    found = []
    for one in process_tree(process):
        for socket in one.net_connections("inet"):
            if socket.status in (psutil.CONN_LISTEN, psutil.CONN_NONE) and socket.laddr:
                found.append((socket.laddr.ip, socket.laddr.port, " ".join(one.cmdline()[2:5])))
    return found


@pytest.fixture
def bench(tmp_path):
    """Start the simulated rig, and a service with agent, scheduler and worker."""
    sim = start(["sim", "--out", "bench.toml"], tmp_path, tmp_path / "sim.log")
    processes = [sim]
    try:
        wait_for((tmp_path / "bench.toml").is_file, (tmp_path / "sim.log").read_text)
        log = tmp_path / "service.log"
        words = ["serve", "--config", "bench.toml", "--port", "0", "--data", "runs"]
        processes.append(start(words, tmp_path, log))
        wait_for(lambda: re.search(r"worker_started", log.read_text()), log.read_text)
        yield processes
    finally:
        for process in reversed(processes):
            process.send_signal(signal.SIGINT)
        for process in reversed(processes):
            process.wait(60)


@pytest.mark.timeout(300)
def test_every_socket_of_a_running_bench_is_on_the_loopback_interface(bench):
    sim, service = bench

    def worker_listens():
        return any("worker" in command for _, _, command in list_sockets(service))

    wait_for(worker_listens, lambda: f"the worker did not listen: {list_sockets(service)}")
    sockets = [*list_sockets(sim), *list_sockets(service)]
    commands = {command for _, _, command in sockets}
    assert any("sim" in command for command in commands)
    assert any("rig" in command for command in commands)
    assert any("serve" in command for command in commands)
    beyond = [socket for socket in sockets if not ipaddress.ip_address(socket[0]).is_loopback]
    assert beyond == []
