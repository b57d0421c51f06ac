"""ZeroMQ sockets of the rig agent: requests with replies, and publications.

The agent binds two sockets. The first answers each command with one reply. The second publishes and never waits:
a slow subscriber loses messages, but the rig loses nothing. `bench.agent_protocol.messages` defines the messages.
"""

import threading
from collections.abc import Callable, Iterator
from typing import Final, Self, TypeAlias

import zmq
from pydantic import TypeAdapter, ValidationError

from bench.agent_protocol.messages import (
    EVENT,
    SAMPLES,
    STATUS,
    AgentEvent,
    AgentStatus,
    Command,
    Message,
    Reply,
    Samples,
)
from bench.errors import AgentUnreachableError, RunError
from bench.validation import describe_validation_error

CommandHandler = Callable[[Command], Reply]
Publication: TypeAlias = AgentStatus | Samples | AgentEvent
"""Message that the agent publishes."""

_COMMAND_ADAPTER: TypeAdapter[Command] = TypeAdapter(Command)
_MESSAGE_TYPES: Final[dict[bytes, type[Publication]]] = {
    STATUS: AgentStatus,
    SAMPLES: Samples,
    EVENT: AgentEvent,
}
_TOPICS: Final = {type_: topic for topic, type_ in _MESSAGE_TYPES.items()}
_POLL_PERIOD = 100
"""[ms] Interval at which a loop checks whether it has to end."""
_QUEUE_LENGTH = 64
"""Number of messages kept for a slow subscriber; older ones are dropped, so that it receives recent ones."""


class _SocketOwner:
    """Context manager of one bound socket."""

    def __init__(self, kind: int, address: str) -> None:
        """Bind the socket.

        Args:
            kind: type of the ZeroMQ socket.
            address: such as ``tcp://127.0.0.1:5570``, or ``tcp://127.0.0.1:*`` for any free port.

        Raises:
            RunError: the address is not available.
        """
        self._socket, self.address = _bind_socket(kind, address)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()


class CommandServer(_SocketOwner):
    """Server that answers commands in the order of arrival, in the thread that calls `serve`."""

    def __init__(self, address: str) -> None:
        """Listen for commands; raises RunError if the address is not available."""
        super().__init__(zmq.REP, address)

    def serve(self, handle: CommandHandler, stopping: threading.Event) -> None:
        """Answer until ``stopping`` is set; an invalid command is answered with its error."""
        while not stopping.is_set():
            if self._socket.poll(_POLL_PERIOD):
                self._socket.send(_handle_request(self._socket.recv(), handle).model_dump_json().encode())


class Publisher(_SocketOwner):
    """Publisher of the agent's messages, from any thread, without waiting."""

    def __init__(self, address: str) -> None:
        """Listen for subscribers; raises RunError if the address is not available."""
        super().__init__(zmq.PUB, address)
        # A ZeroMQ socket must not be used by two threads at once.
        self._lock = threading.Lock()

    def publish(self, message: Publication) -> None:
        """Send a message to all subscribers; dropped for slow ones, and after the publisher is closed."""
        frames = [_TOPICS[type(message)], message.model_dump_json().encode()]
        with self._lock:
            if not self._socket.closed:
                self._socket.send_multipart(frames)

    def __exit__(self, *error: object) -> None:
        with self._lock:
            super().__exit__(*error)


class AgentClient:
    """Client of the agent; may be used from any thread, and created before the agent is running."""

    def __init__(self, commands: str, samples: str) -> None:
        """Store the addresses; nothing is sent.

        Args:
            commands: address of the agent's request socket.
            samples: address of the agent's publishing socket.
        """
        self._commands, self._samples = commands, samples

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Send one command and wait for its reply.

        Args:
            command: one of `bench.agent_protocol.messages.Command`.
            timeout: [s]

        Raises:
            AgentUnreachableError: the address is invalid, or no valid reply came in time.
        """
        # One socket per command, because a request socket without its reply cannot be used again.
        with _open_socket(zmq.REQ) as socket:
            _connect(socket, self._commands)
            socket.send(command.model_dump_json().encode())
            if not socket.poll(round(timeout * 1e3)):
                raise AgentUnreachableError(
                    f"no rig agent replied at {self._commands} within {timeout:g} s; start one: mrbench rig"
                )
            try:
                return Reply.model_validate_json(socket.recv())
            except ValidationError as error:
                raise AgentUnreachableError(
                    f"the process at {self._commands} is not a rig agent of this version "
                    f"({describe_validation_error(error, 'the reply')}); end it and start one: mrbench rig"
                ) from error

    def subscribe(self, stopping: threading.Event) -> Iterator[Publication | None]:
        """Yield the agent's publications until ``stopping`` is set, and None after each 0.1 s of silence.

        Raises:
            AgentUnreachableError: the address is invalid.
        """
        with _open_socket(zmq.SUB) as socket:
            socket.subscribe(b"")
            _connect(socket, self._samples)
            while not stopping.is_set():
                if not socket.poll(_POLL_PERIOD):
                    yield None
                    continue
                topic, content = socket.recv_multipart()
                yield _MESSAGE_TYPES[topic].model_validate_json(content)


def _open_socket(kind: int) -> "zmq.Socket[bytes]":
    """Open a socket that drops messages instead of waiting, and discards unsent ones when it is closed."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context.instance()
    socket = context.socket(kind)
    # High-water marks apply only to addresses that are bound or connected afterwards.
    socket.linger, socket.sndhwm, socket.rcvhwm = 0, _QUEUE_LENGTH, _QUEUE_LENGTH
    return socket


def _bind_socket(kind: int, address: str) -> tuple["zmq.Socket[bytes]", str]:
    """Return a bound socket and its address, with the port that replaces ``*``.

    Raises:
        RunError: the address is not available.
    """
    socket = _open_socket(kind)
    try:
        socket.bind(address)
    except zmq.ZMQError as error:
        socket.close()
        raise RunError(
            f"the agent cannot listen at {address}: {error}; end another agent there, or use another address"
        ) from error
    return socket, socket.getsockopt_string(zmq.LAST_ENDPOINT)


def _connect(socket: "zmq.Socket[bytes]", address: str) -> None:
    """Connect a socket; a missing agent shows only when a reply is awaited.

    Raises:
        AgentUnreachableError: the address is invalid.
    """
    try:
        socket.connect(address)
    except zmq.ZMQError as error:
        raise AgentUnreachableError(
            f"{address!r} is not an address of a rig agent ({error}); give one such as tcp://127.0.0.1:5570"
        ) from error


def _handle_request(request: bytes, handle: CommandHandler) -> Reply:
    try:
        command = _COMMAND_ADAPTER.validate_json(request)
    except ValidationError as error:
        return Reply(ok=False, error=f"invalid command: {describe_validation_error(error, 'the message')}")
    try:
        return handle(command)
    except Exception as error:  # one faulty command must not end the agent
        return Reply(
            ok=False, error=f"{command.command} failed: {error!r}; internal error of the agent, please report"
        )
