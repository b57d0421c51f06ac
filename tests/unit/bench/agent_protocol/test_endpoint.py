"""Addresses of the agent, and who reaches them."""

import os
import socket
import tempfile
import threading
from pathlib import Path

import pytest
import zmq

from bench.agent_protocol import AgentEvent, AgentStatus, Reply, StatusCommand
from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.command_server import CommandServer
from bench.agent_protocol.endpoint import check_socket_path, derive_samples_address, find_agent
from bench.agent_protocol.publications import Publisher
from bench.errors import AgentUnreachableError, ConfigError, RunError
from tests.support.fake_rig import BENCH_TOML

FORMER = '\n[agent]\ncommands = "tcp://127.0.0.1:5570"\nsamples = "tcp://127.0.0.1:5580"\n'
"""Section of a bench.toml that was written before sockets needed a secret."""


@pytest.fixture
def sockets(tmp_path, monkeypatch):
    folder = tmp_path / "sockets"
    monkeypatch.setenv("MRBENCH_SOCKETS", str(folder))
    return folder


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(BENCH_TOML)
    return path


class TestAddresses:
    """Addresses that follow from bench.toml."""

    def test_by_default_they_are_sockets_in_a_private_folder(self, config, sockets):
        endpoint = find_agent(config)
        assert endpoint.commands.startswith(f"ipc://{sockets}/")
        assert endpoint.samples == f"{endpoint.commands}.samples"
        assert sockets.stat().st_mode & 0o777 == 0o700

    def test_every_way_to_the_file_gives_the_same_and_another_file_another(self, config, sockets, tmp_path):
        link = tmp_path / "link.toml"
        link.symlink_to(config)
        other = tmp_path / "other.toml"
        other.write_text(BENCH_TOML)
        assert find_agent(link).commands == find_agent(config).commands
        assert find_agent(other).commands != find_agent(config).commands

    def test_without_a_folder_of_its_own_it_is_that_of_the_user_in_the_temporary_folder(
        self, config, tmp_path, monkeypatch
    ):
        monkeypatch.delenv("MRBENCH_SOCKETS", raising=False)
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        assert find_agent(config).commands.startswith(f"ipc://{tmp_path}/mrbench-{os.getuid()}/")

    def test_addresses_of_a_former_file_stay_with_a_key_beside_it(self, config):
        config.write_text(BENCH_TOML + FORMER)
        assert find_agent(config) == ("tcp://127.0.0.1:5570", "tcp://127.0.0.1:5580", config.parent / "agent.key")

    def test_samples_are_published_beside_the_commands(self):
        assert derive_samples_address("tcp://rig:5570") == "tcp://rig:5571"
        assert derive_samples_address("tcp://[::1]:5570") == "tcp://[::1]:5571"
        assert derive_samples_address("ipc:///run/rig") == "ipc:///run/rig.samples"

    def test_an_address_given_for_commands_moves_the_samples_too(self, config):
        config.write_text(BENCH_TOML + FORMER)
        assert find_agent(config, "tcp://rig:7000").samples == "tcp://rig:7001"

    @pytest.mark.parametrize("address", ["5570", "tcp://rig", "http://rig:1", "tcp://rig:port"])
    def test_another_address_is_refused(self, address):
        with pytest.raises(ConfigError, match="not an address of a rig agent"):
            derive_samples_address(address)


class TestSocketFiles:
    """Folder of the sockets."""

    def test_a_path_that_is_too_long_is_refused_with_its_length(self, tmp_path):
        address = f"ipc://{tmp_path}/{'x' * 107}"
        with pytest.raises(
            ConfigError, match=rf"a path of {len(str(tmp_path)) + 108} bytes, allowed 107; set MRBENCH"
        ):
            check_socket_path(address)

    @pytest.mark.parametrize("address", ["ipc://rig", "ipc://@rig"])
    def test_a_socket_without_a_folder_is_refused(self, address):
        with pytest.raises(ConfigError, match="not the absolute path"):
            check_socket_path(address)

    @pytest.mark.parametrize("mode", [0o770, 0o701, 0o755])
    def test_a_folder_that_others_reach_is_refused_by_agent_and_client(self, mode, tmp_path):
        folder = tmp_path / "open"
        folder.mkdir()
        folder.chmod(mode)
        with pytest.raises(ConfigError, match=rf"other users can reach .* mode {mode:04o}\)"):
            CommandServer(f"ipc://{folder}/agent")
        with pytest.raises(AgentUnreachableError, match="other users can reach"):
            AgentClient(f"ipc://{folder}/agent", "").send(StatusCommand())

    def test_a_link_instead_of_the_folder_is_refused(self, tmp_path):
        (tmp_path / "link").symlink_to(tmp_path)
        with pytest.raises(ConfigError, match="not a folder"):
            check_socket_path(f"ipc://{tmp_path}/link/agent")

    @pytest.mark.skipif(os.getuid() != 0, reason="needs the rights to become another user")
    def test_another_user_does_not_reach_the_socket(self, config, monkeypatch):
        with tempfile.TemporaryDirectory(dir="/tmp") as folder, socket.socket(socket.AF_UNIX) as client:
            Path(folder).chmod(0o755)
            monkeypatch.setenv("MRBENCH_SOCKETS", f"{folder}/sockets")
            with CommandServer(find_agent(config).commands) as server:
                path = server.address.removeprefix("ipc://")
                os.seteuid(65534)
                try:
                    with pytest.raises(PermissionError):
                        client.connect(path)
                finally:
                    os.seteuid(0)
                client.connect(path)


@pytest.fixture
def tcp_server(tmp_path):
    """Serve commands at a TCP address whose key is in the test's folder."""
    stopping = threading.Event()
    with CommandServer("tcp://127.0.0.1:*", tmp_path / "agent.key") as server:
        thread = threading.Thread(
            target=server.serve, args=(lambda command: Reply(ok=True, status=AgentStatus(state="idle")), stopping)
        )
        thread.start()
        yield server
        stopping.set()
        thread.join()


class TestKey:
    """TCP addresses, which others can reach."""

    def test_the_key_is_created_for_its_owner_only_and_admits(self, tcp_server, tmp_path):
        key = tmp_path / "agent.key"
        assert key.stat().st_mode & 0o777 == 0o600
        assert AgentClient(tcp_server.address, "", key).send(StatusCommand()).status.state == "idle"

    def test_a_client_with_another_key_gets_no_reply(self, tcp_server, tmp_path):
        other = tmp_path / "other.key"
        with Publisher("tcp://127.0.0.1:*", other):
            pass
        with pytest.raises(AgentUnreachableError, match=r"or check that .*other\.key is its key"):
            AgentClient(tcp_server.address, "", other).send(StatusCommand(), timeout=0.5)

    @pytest.mark.parametrize("knows_public_key", [True, False])
    def test_a_stranger_gets_no_reply(self, tcp_server, tmp_path, knows_public_key):
        with zmq.Context.instance().socket(zmq.REQ) as requests:
            requests.linger = 0
            if knows_public_key:
                public = zmq.curve_public((tmp_path / "agent.key").read_bytes())
                requests.curve_serverkey = public
                requests.curve_publickey, requests.curve_secretkey = zmq.curve_keypair()
            requests.connect(tcp_server.address)
            requests.send(b'{"command": "status"}')
            assert not requests.poll(500)

    def test_a_missing_key_is_named(self, tmp_path):
        client = AgentClient("tcp://127.0.0.1:1", "", tmp_path / "agent.key")
        with pytest.raises(AgentUnreachableError, match=r"copy it from beside its bench\.toml"):
            client.send(StatusCommand())
        with pytest.raises(AgentUnreachableError, match="needs the agent's key file"):
            AgentClient("tcp://127.0.0.1:1", "").send(StatusCommand())
        with pytest.raises(RunError, match="needs a key file"):
            CommandServer("tcp://127.0.0.1:*")

    def test_publications_need_the_key_too(self, tmp_path):
        stopping, key = threading.Event(), tmp_path / "agent.key"
        event = AgentEvent(time_ns=7, kind="alarm", text="warm")
        with Publisher("tcp://127.0.0.1:*", key) as publisher, zmq.Context.instance().socket(zmq.SUB) as stranger:
            stranger.subscribe(b"")
            stranger.connect(publisher.address)
            messages = AgentClient("", publisher.address, key).subscribe(stopping)
            received = []
            for _ in range(200):
                publisher.publish(event)
                received.append(next(messages))
                if received[-1] is not None:
                    break
            assert received[-1] == event
            assert not stranger.poll(200)
