"""Commands and what the agent publishes, over real sockets on loopback."""

import threading
from collections.abc import Iterator

import pytest
import zmq

from bench.agent.link import AgentClient, CommandServer, Publisher
from bench.agent.messages import AgentEvent, AgentStatus, Answer, RunCommand, StatusCommand, StopCommand
from bench.errors import AgentUnreachable, RunError

ANYWHERE = "tcp://127.0.0.1:*"


@pytest.fixture
def stopping() -> Iterator[threading.Event]:
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def server(stopping: threading.Event) -> Iterator[CommandServer]:
    def handle(command):
        if isinstance(command, RunCommand):
            return Answer(ok=False, error=f"no {command.method['name']} today")
        return Answer(ok=True, status=AgentStatus(state="idle"))

    with CommandServer(ANYWHERE) as made:
        thread = threading.Thread(target=made.serve, args=(handle, stopping))
        thread.start()
        yield made
        stopping.set()
        thread.join()


def test_every_command_gets_the_answer_of_its_own(server):
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
def test_what_is_no_command_is_answered_with_what_is_wrong_and_the_next_one_works(server, request_):
    with zmq.Context.instance().socket(zmq.REQ) as socket:
        socket.linger = 0
        socket.connect(server.address)
        socket.send(request_)
        assert socket.poll(5000)
        answer = Answer.model_validate_json(socket.recv())
    assert not answer.ok
    assert "no command" in answer.error
    assert AgentClient(server.address, "").send(StopCommand()).ok


def test_an_agent_that_is_not_there_is_said_in_time():
    with CommandServer(ANYWHERE) as bound:
        address = bound.address
    with pytest.raises(AgentUnreachable, match=r"within 0\.2 s; start one: mrbench rig"):
        AgentClient(address, "").send(StatusCommand(), timeout=0.2)


def test_an_address_that_is_taken_is_refused_in_words():
    with CommandServer(ANYWHERE) as first, pytest.raises(RunError, match="cannot listen at"):
        CommandServer(first.address)


def test_what_is_published_arrives_typed(stopping):
    with Publisher(ANYWHERE) as publisher:
        heard = AgentClient("", publisher.address).subscribe(stopping)
        event = AgentEvent(time_ns=7, kind="alarm", text="warm")
        found = None
        # A subscriber hears only what is sent once it has joined, so it is said until it has been heard.
        for _ in range(200):
            publisher.publish(event)
            found = next(heard)
            if found is not None:
                break
        assert found == event


def test_a_closed_publisher_drops_what_comes_late():
    with Publisher(ANYWHERE) as publisher:
        pass
    publisher.publish(AgentStatus(state="idle"))


def test_a_defect_in_a_command_is_answered_and_the_next_one_works(stopping):
    def handle(command):
        if isinstance(command, RunCommand):
            raise ZeroDivisionError("division by zero")
        return Answer(ok=True)

    with CommandServer(ANYWHERE) as made:
        thread = threading.Thread(target=made.serve, args=(handle, stopping))
        thread.start()
        client = AgentClient(made.address, "")
        answer = client.send(RunCommand(method={}))
        assert not answer.ok
        assert "ZeroDivisionError" in answer.error
        assert client.send(StopCommand()).ok
        stopping.set()
        thread.join()


def test_an_address_that_is_none_is_said_in_words(stopping):
    client = AgentClient("localhost:5570", "nowhere")
    with pytest.raises(AgentUnreachable, match="'localhost:5570' is no address of a rig agent"):
        client.send(StatusCommand())
    with pytest.raises(AgentUnreachable, match="'nowhere' is no address"):
        next(client.subscribe(stopping))


def test_an_answer_of_another_version_is_said_in_words(stopping):
    with zmq.Context.instance().socket(zmq.REP) as other:
        port = other.bind_to_random_port("tcp://127.0.0.1")

        def answer():
            other.recv()
            other.send(b'{"fine": true}')

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(AgentUnreachable, match=r"no rig agent of this version \(ok: Field required\)"):
            AgentClient(f"tcp://127.0.0.1:{port}", "").send(StatusCommand())
        thread.join()
