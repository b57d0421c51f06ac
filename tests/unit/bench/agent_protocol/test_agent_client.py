"""Commands and publications over real sockets on loopback."""

import json
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq

from bench.agent_protocol import (
    AbortCommand,
    AgentEvent,
    AgentStatus,
    PrepareCommand,
    Reply,
    ResetCommand,
    RunCommand,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
)
from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.command_server import CommandServer
from bench.agent_protocol.publications import Publisher
from bench.errors import AgentUnreachableError, RunError

ANY_PORT = "tcp://127.0.0.1:*"


@pytest.fixture
def address(tmp_path) -> str:
    """Return the address of a socket in a private folder."""
    folder = tmp_path / "sockets"
    folder.mkdir(mode=0o700)
    return f"ipc://{folder}/agent"


@pytest.fixture
def stopping() -> Iterator[threading.Event]:
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def server(stopping: threading.Event, address: str) -> Iterator[CommandServer]:
    def handle(command):
        if isinstance(command, RunCommand):
            return Reply(ok=False, error=f"no {command.method['name']} today")
        return Reply(ok=True, status=AgentStatus(state="idle"))

    with CommandServer(address) as server:
        thread = threading.Thread(target=server.serve, args=(handle, stopping))
        thread.start()
        yield server
        stopping.set()
        thread.join()


def test_every_command_gets_its_own_reply(server):
    client = AgentClient(server.address, "")
    assert client.send(StatusCommand()).status == AgentStatus(state="idle")
    assert client.send(RunCommand(method={"name": "polka"})).error == "no polka today"
    assert client.send(StopCommand()).ok


@pytest.mark.parametrize(
    "request_",
    [
        b"nonsense",
        b'{"command": "explode"}',
        b'{"command": "stop", "now": 1}',
        b'{"command": "prepare", "step": "move"}',
    ],
)
def test_invalid_command_is_answered_with_its_error_and_the_next_one_works(server, request_):
    with zmq.Context.instance().socket(zmq.REQ) as client:
        client.linger = 0
        client.connect(server.address)
        client.send(request_)
        assert client.poll(5000)
        reply = Reply.model_validate_json(client.recv())
    assert not reply.ok
    assert "invalid command" in reply.error
    assert AgentClient(server.address, "").send(StopCommand()).ok


@pytest.mark.parametrize(
    ("late", "executed"),
    [
        (RunCommand(method={"name": "polka"}), False),
        (PrepareCommand(step="home"), False),
        (ResetCommand(), False),
        (ShutDownCommand(), False),
        (StopCommand(), True),
        (AbortCommand(), True),
    ],
)
def test_what_nobody_waits_for_any_more_is_not_begun_but_a_stop_acts(stopping, address, late, executed):
    """The agent reads the command only after its sender was told that no agent replied."""
    handled = []

    def handle(command):
        handled.append(command.command)
        return Reply(ok=True, status=AgentStatus(state="idle"))

    with CommandServer(address) as server:
        with pytest.raises(AgentUnreachableError):
            AgentClient(server.address, "").send(late, timeout=0.1)
        thread = threading.Thread(target=server.serve, args=(handle, stopping))
        thread.start()
        assert AgentClient(server.address, "").send(StatusCommand()).ok
        stopping.set()
        thread.join()
    assert handled == [*[late.command] * executed, "status"]


def test_a_command_that_comes_too_late_is_answered_with_the_reason(server):
    with zmq.Context.instance().socket(zmq.REQ) as client:
        client.linger = 0
        client.connect(server.address)
        client.send(RunCommand(method={"name": "polka"}, valid_until_utc_s=1.0).model_dump_json().encode())
        assert client.poll(5000)
        reply = Reply.model_validate_json(client.recv())
    assert not reply.ok
    assert "nothing was done; repeat it" in reply.error


def test_a_client_of_an_older_version_reads_the_replies_to_its_commands(server):
    with zmq.Context.instance().socket(zmq.REQ) as client:
        client.linger = 0
        client.connect(server.address)
        client.send(b'{"command": "stop"}')
        assert client.poll(5000)
        reply = json.loads(client.recv())
        assert set(reply) == {"ok", "error", "status", "description"}
        assert "lease" not in reply["status"]


def test_missing_agent_is_reported_in_time(address):
    with pytest.raises(AgentUnreachableError, match=r"within 0\.2 s; start one: mrbench rig"):
        AgentClient(address, "").send(StatusCommand(), timeout=0.2)


@pytest.mark.parametrize("scheme", ["ipc", "tcp"])
def test_address_in_use_is_refused(scheme, address, tmp_path):
    key = tmp_path / "agent.key"
    with (
        CommandServer(address if scheme == "ipc" else ANY_PORT, key) as first,
        pytest.raises(RunError, match="cannot listen at"),
    ):
        CommandServer(first.address, key)


def test_the_file_of_a_killed_agent_is_replaced(address):
    left = address.removeprefix("ipc://")
    with socket.socket(socket.AF_UNIX) as killed:
        killed.bind(left)
        killed.listen()
    with CommandServer(address):
        assert Path(left).stat().st_mode & 0o777 == 0o600


def test_publications_arrive_with_their_types(stopping, address):
    with Publisher(address) as publisher:
        messages = AgentClient("", publisher.address).subscribe(stopping)
        event = AgentEvent(time_ns=7, kind="alarm", text="warm")
        received = None
        # A subscriber receives only messages that are sent after it has joined, so the event is repeated.
        for _ in range(200):
            publisher.publish(event)
            received = next(messages)
            if received is not None:
                break
        assert received == event


def test_closed_publisher_drops_messages(address):
    with Publisher(address) as publisher:
        pass
    publisher.publish(AgentStatus(state="idle"))


def test_internal_error_is_a_reply_and_the_next_command_works(stopping, address):
    def handle(command):
        if isinstance(command, RunCommand):
            raise ZeroDivisionError("division by zero")
        return Reply(ok=True)

    with CommandServer(address) as server:
        thread = threading.Thread(target=server.serve, args=(handle, stopping))
        thread.start()
        client = AgentClient(server.address, "")
        reply = client.send(RunCommand(method={}))
        assert not reply.ok
        assert "ZeroDivisionError" in reply.error
        assert client.send(StopCommand()).ok
        stopping.set()
        thread.join()


def test_invalid_address_is_reported(stopping):
    client = AgentClient("localhost:5570", "nowhere")
    with pytest.raises(AgentUnreachableError, match="'localhost:5570' is not an address of a rig agent"):
        client.send(StatusCommand())
    with pytest.raises(AgentUnreachableError, match="'nowhere' is not an address"):
        next(client.subscribe(stopping))


def test_reply_of_another_version_is_reported(address):
    with zmq.Context.instance().socket(zmq.REP) as other:
        other.bind(address)

        def reply():
            other.recv()
            other.send(b'{"fine": true}')

        thread = threading.Thread(target=reply)
        thread.start()
        with pytest.raises(AgentUnreachableError, match=r"not a rig agent of this version \(ok: is missing"):
            AgentClient(address, "").send(StatusCommand())
        thread.join()
