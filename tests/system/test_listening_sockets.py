"""Listening sockets of a running bench: all are on loopback, and none executes a command without the secret."""

import asyncio
import contextlib
import ipaddress
import os
import re
import signal
import ssl
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from distributed.core import rpc
from distributed.protocol.pickle import dumps

from bench.agent_protocol import AgentClient, StatusCommand, find_agent
from bench.jobs.tls import create_security, get_tls_file

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
        # A helper that has ended since has no sockets.
        with contextlib.suppress(psutil.NoSuchProcess):
            for socket in one.net_connections("inet"):
                if socket.status in (psutil.CONN_LISTEN, psutil.CONN_NONE) and socket.laddr:
                    found.append((socket.laddr.ip, socket.laddr.port, " ".join(one.cmdline()[2:5])))
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="module")
def bench(folder):
    """Start the simulated rig, and a service with agent, scheduler and worker."""
    sim = start(["sim", "--out", "bench.toml"], folder, folder / "sim.log")
    processes = [sim]
    try:
        wait_for((folder / "bench.toml").is_file, (folder / "sim.log").read_text)
        log = folder / "service.log"
        words = ["serve", "--config", "bench.toml", "--port", "0", "--data", "runs"]
        processes.append(start(words, folder, log))
        wait_for(lambda: re.search(r"worker_started", log.read_text()), log.read_text)
        yield processes
    finally:
        for process in reversed(processes):
            process.send_signal(signal.SIGINT)
        for process in reversed(processes):
            process.wait(60)


def worker_addresses(service):
    """Return the addresses on which the worker listens."""
    return [(ip, port) for ip, port, command in list_sockets(service) if "worker" in command]


@pytest.fixture(scope="module")
def sockets(bench):
    """Return the listening sockets of all processes."""
    sim, service = bench
    wait_for(lambda: worker_addresses(service), lambda: f"the worker did not listen: {list_sockets(service)}")
    found = [*list_sockets(sim), *list_sockets(service)]
    commands = {command for _, _, command in found}
    assert all(any(word in command for command in commands) for word in ("sim", "serve", "worker"))
    return found


@pytest.mark.timeout(300)
def test_every_socket_of_a_running_bench_is_on_the_loopback_interface(sockets):
    beyond = [socket for socket in sockets if not ipaddress.ip_address(socket[0]).is_loopback]
    assert beyond == []


def make_stranger(folder):
    """Return the TLS of somebody who trusts everybody and shows a certificate of his own."""
    folder.mkdir()
    create_security(folder)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    context.load_cert_chain(get_tls_file(folder))
    return context


def execute(address, context, marker):
    """Let a dask process create a file; return the error of a process that does not."""

    async def call():
        arguments = {"ssl_context": context, "require_encryption": False}
        async with rpc(address, connection_args=arguments, timeout=3) as remote:
            await asyncio.wait_for(remote.run(function=dumps(Path.touch), args=dumps((marker,))), 5)

    try:
        asyncio.run(call())
    except Exception as error:  # a web server answers in another protocol
        return error
    return None


@pytest.mark.timeout(300)
def test_scheduler_and_worker_execute_nothing_without_their_key(bench, sockets, folder, tmp_path):
    _, service = bench
    key = create_security(folder / "runs").get_connection_args("client")["ssl_context"]
    stranger, marker = make_stranger(tmp_path / "stranger"), tmp_path / "executed"
    ports = [f"{ip}:{port}" for ip, port, command in sockets if "sim" not in command]
    assert len(ports) >= 3, sockets
    for port in ports:
        assert execute(f"tcp://{port}", None, marker) is not None
        assert execute(f"tls://{port}", stranger, marker) is not None
    assert not marker.exists()
    # With the key the same call works, so that the refusals above are those of the key.
    ((ip, port), *_) = [
        one for one in worker_addresses(service) if not execute(f"tls://{one[0]}:{one[1]}", key, marker)
    ]
    assert marker.exists(), (ip, port)


@pytest.mark.timeout(300)
def test_the_agent_is_reached_by_its_user_only(bench, sockets, folder):
    _, service = bench
    assert [command for _, _, command in sockets if "bench.cli rig" in command] == []
    (agent,) = [one for one in process_tree(service) if "rig" in one.cmdline()[:5]]
    paths = [Path(one.laddr) for one in agent.net_connections("unix") if str(one.laddr).startswith("/")]
    endpoint = find_agent(folder / "bench.toml")
    assert {f"ipc://{path}" for path in paths} == {endpoint.commands, endpoint.samples}
    for path in set(paths):
        assert (path.stat().st_uid, path.stat().st_mode & 0o777) == (os.getuid(), 0o600)
        assert (path.parent.stat().st_uid, path.parent.stat().st_mode & 0o777) == (os.getuid(), 0o700)
    assert AgentClient(*endpoint).send(StatusCommand()).ok
