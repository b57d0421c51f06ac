"""ZeroMQ between the rig agent and those who use it: requests with answers, and what the agent publishes.

The agent binds two sockets. On the first, each command gets one answer; on the second it publishes and never
waits: a subscriber that is too slow loses messages, the rig loses nothing. What the messages mean stands in
`bench.agent.messages`.
"""

import threading
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Final, Self

import zmq
from pydantic import TypeAdapter, ValidationError

from bench.agent.messages import (
    EVENT,
    SAMPLES,
    STATUS,
    AgentEvent,
    AgentStatus,
    Answer,
    Command,
    Message,
    Samples,
)
from bench.errors import AgentUnreachable, RunError

Handler = Callable[[Command], Answer]

_COMMANDS: TypeAdapter[Command] = TypeAdapter(Command)
_TYPES: Final[dict[bytes, type[AgentStatus | Samples | AgentEvent]]] = {
    STATUS: AgentStatus,
    SAMPLES: Samples,
    EVENT: AgentEvent,
}
_TOPICS: Final = {type_: topic for topic, type_ in _TYPES.items()}
_LOOK_EVERY = 100
"""[ms] between two looks whether a loop is to end."""
_QUEUED = 64
"""Messages kept for a slow subscriber; older ones are dropped, so that it sees the present."""


def _socket(kind: int) -> "zmq.Socket[bytes]":
    """A socket that drops rather than waits, and never outlives what it has not sent."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context.instance()
    socket = context.socket(kind)
    # High-water marks count only for what is bound or connected after them.
    socket.linger, socket.sndhwm, socket.rcvhwm = 0, _QUEUED, _QUEUED
    return socket


def _bound(kind: int, address: str) -> tuple["zmq.Socket[bytes]", str]:
    """A socket bound to ``address``, and the address by which it is reached (its port where ``*`` was asked).

    Raises:
        RunError: the address cannot be had.
    """
    socket = _socket(kind)
    try:
        socket.bind(address)
    except zmq.ZMQError as error:
        socket.close()
        raise RunError(
            f"the agent cannot listen at {address}: {error}; another agent may be there, or take another address"
        ) from error
    return socket, socket.getsockopt_string(zmq.LAST_ENDPOINT)


def _connect(socket: "zmq.Socket[bytes]", address: str) -> None:
    """Connect a socket; whether anybody listens there shows only when something is asked.

    Raises:
        AgentUnreachable: it is no address.
    """
    try:
        socket.connect(address)
    except zmq.ZMQError as error:
        raise AgentUnreachable(
            f"{address!r} is no address of a rig agent ({error}); give one such as tcp://127.0.0.1:5570"
        ) from error


def _first_fault(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    place = ".".join(str(step) for step in first["loc"]) or "the message"
    return f"{place}: {first['msg']}"


class CommandServer:
    """Answers commands in the order they come, in the thread that calls `serve`; a context manager."""

    def __init__(self, address: str) -> None:
        """Listen.

        Args:
            address: such as ``tcp://127.0.0.1:5570``, or ``tcp://127.0.0.1:*`` for any free port.

        Raises:
            RunError: the address cannot be had.
        """
        self._socket, self.address = _bound(zmq.REP, address)

    def serve(self, handle: Handler, stopping: threading.Event) -> None:
        """Answer until ``stopping`` is set; what is no command is answered by what is wrong with it."""
        while not stopping.is_set():
            if self._socket.poll(_LOOK_EVERY):
                self._socket.send(_answered(self._socket.recv(), handle).model_dump_json().encode())

    def __enter__(self) -> Self:
        """The server itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the socket."""
        self._socket.close()


def _answered(request: bytes, handle: Handler) -> Answer:
    try:
        command = _COMMANDS.validate_json(request)
    except ValidationError as error:
        return Answer(ok=False, error=f"that is no command: {_first_fault(error)}")
    try:
        return handle(command)
    except Exception as error:  # or one bad command would take the agent, and everybody's rig, with it
        return Answer(ok=False, error=f"{command.command} ended: {error!r}; this is a defect of the agent")


class Publisher:
    """Publishes what the agent has to say, from any thread, without ever waiting; a context manager."""

    def __init__(self, address: str) -> None:
        """Listen for subscribers.

        Args:
            address: such as ``tcp://127.0.0.1:5571``, or ``tcp://127.0.0.1:*`` for any free port.

        Raises:
            RunError: the address cannot be had.
        """
        self._socket, self.address = _bound(zmq.PUB, address)
        # A ZeroMQ socket must not be used by two threads at once.
        self._lock = threading.Lock()

    def publish(self, message: AgentStatus | Samples | AgentEvent) -> None:
        """Hand one message to whoever listens; dropped for those that cannot follow, and once it is closed."""
        frames = [_TOPICS[type(message)], message.model_dump_json().encode()]
        with self._lock:
            if not self._socket.closed:
                self._socket.send_multipart(frames)

    def __enter__(self) -> Self:
        """The publisher itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the socket."""
        with self._lock:
            self._socket.close()


class AgentClient:
    """The agent as seen by others; may be used from any thread, and made before the agent is there."""

    def __init__(self, commands: str, samples: str) -> None:
        """Know where it is; nothing is sent yet.

        Args:
            commands: address of its request socket.
            samples: address of its publishing socket.
        """
        self._commands, self._samples = commands, samples

    def send(self, command: Message, timeout: float = 5.0) -> Answer:
        """Send one command and wait for its answer.

        Args:
            command: one of `bench.agent.messages.Command`.
            timeout: [s]

        Raises:
            AgentUnreachable: there is no such address, no answer came in time, or none that can be understood.
        """
        # A request socket that waits for an answer can do nothing else: one for each command outlives no failure.
        with _socket(zmq.REQ) as socket:
            _connect(socket, self._commands)
            socket.send(command.model_dump_json().encode())
            if not socket.poll(round(timeout * 1e3)):
                raise AgentUnreachable(
                    f"no rig agent answered at {self._commands} within {timeout:g} s; start one: mrbench rig"
                )
            try:
                return Answer.model_validate_json(socket.recv())
            except ValidationError as error:
                raise AgentUnreachable(
                    f"what answers at {self._commands} is no rig agent of this version ({_first_fault(error)}); "
                    "end it and start one: mrbench rig"
                ) from error

    def subscribe(self, stopping: threading.Event) -> Iterator[AgentStatus | Samples | AgentEvent | None]:
        """What the agent publishes, until ``stopping`` is set; None whenever it was silent for 0.1 s.

        Raises:
            AgentUnreachable: there is no such address.
        """
        with _socket(zmq.SUB) as socket:
            socket.subscribe(b"")
            _connect(socket, self._samples)
            while not stopping.is_set():
                if not socket.poll(_LOOK_EVERY):
                    yield None
                    continue
                topic, content = socket.recv_multipart()
                yield _TYPES[topic].model_validate_json(content)
