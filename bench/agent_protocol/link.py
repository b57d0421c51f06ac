"""ZeroMQ sockets of the rig agent: requests with replies, and publications.

The agent binds two sockets. Both are files in a private folder, or TCP with a key, because a message moves the rod
(`bench.agent_protocol.endpoint`, `bench.agent_protocol.curve`). The first answers each command with one reply.
The second publishes and never waits: a slow subscriber loses messages, but the rig loses nothing.
`bench.agent_protocol.messages` defines the messages.
"""

import contextlib
import socket as unix_socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final, Protocol, Self, TypeAlias

import orjson
import zmq
from pydantic import TypeAdapter, ValidationError

from bench.agent_protocol.curve import authenticate_clients, authenticate_server, create_key
from bench.agent_protocol.endpoint import check_socket_path
from bench.agent_protocol.messages import (
    EVENT,
    SAMPLES,
    STATUS,
    AbortCommand,
    AgentEvent,
    AgentStatus,
    Command,
    Message,
    PauseCommand,
    Reply,
    Sender,
    SentCommand,
    StopCommand,
    TimedCommand,
)
from bench.agent_protocol.sender import describe_peer, get_sender
from bench.errors import AgentUnreachableError, ConfigError, RunError, SecretFileError
from bench.live import LiveBatch, decode_batch, describe_channels, parse_channels
from bench.validation import describe_validation_error

CommandHandler = Callable[[Command], Reply]
Publication: TypeAlias = AgentStatus | LiveBatch | AgentEvent
"""Message that the agent publishes."""


class CommandAudit(Protocol):
    """Audit trail of the commands that reach the agent."""

    def find_obstacle(self, command: SentCommand) -> str:
        """Return why a command must not be executed, because it could not be recorded; empty if it may."""

    def record(self, command: SentCommand | bytes, peer: str, reply: Reply, *, wait: bool) -> None:
        """Record a command with its reply.

        Args:
            command: the command, or a message that is not one.
            peer: its sender as seen at the socket.
            reply: its reply.
            wait: wait a moment until it is on the disk.
        """


_INVALID: Final = "invalid command"
"""Beginning of the reply to a message that is not a command of this version."""
_COMMAND_ADAPTER: TypeAdapter[Command] = TypeAdapter(Command)
_MESSAGE_TYPES: Final[dict[bytes, type[AgentStatus | AgentEvent]]] = {STATUS: AgentStatus, EVENT: AgentEvent}
_TOPICS: Final = {type_: topic for topic, type_ in _MESSAGE_TYPES.items()}
_POLL_PERIOD = 100
"""[ms] Interval at which a loop checks whether it has to end."""
_QUEUE_LENGTH = 64
"""Number of messages kept for a slow subscriber; older ones are dropped, so that it receives recent ones."""


class _SocketOwner:
    """Context manager of one bound socket."""

    def __init__(self, kind: int, address: str, key: Path | None = None) -> None:
        """Bind the socket.

        Args:
            kind: type of the ZeroMQ socket.
            address: such as ``ipc:///run/bench/agent``, or ``tcp://127.0.0.1:*`` for any free port.
            key: key file for TCP, created unless it exists.

        Raises:
            RunError: the address is not available, or TCP without a key file.
            ConfigError: other users could reach the socket.
            SecretFileError: the key file cannot be created, or other users may read it.
        """
        with contextlib.ExitStack() as opening:
            # A context of its own, because it answers for all its sockets which clients are accepted.
            context: zmq.Context[zmq.Socket[bytes]] = opening.enter_context(zmq.Context())
            self._socket = opening.enter_context(_open_socket(kind, context))
            if address.startswith("tcp://"):
                opening.enter_context(_require_key(self._socket, address, key))
            self.address = _bind_socket(self._socket, address)
            self._resources = opening.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._resources.close()


class CommandServer(_SocketOwner):
    """Server that answers commands in the order of arrival, in the thread that calls `serve`."""

    def __init__(self, address: str, key: Path | None = None) -> None:
        """Listen for commands; arguments and errors as those of every bound socket."""
        super().__init__(zmq.REP, address, key)

    def serve(self, handle: CommandHandler, stopping: threading.Event, audit: CommandAudit | None = None) -> None:
        """Answer until ``stopping`` is set; an invalid command is answered with its error.

        Args:
            handle: executes a command.
            stopping: ends the server.
            audit: records the commands; None for no record.
        """
        while not stopping.is_set():
            if self._socket.poll(_POLL_PERIOD):
                self._answer(self._socket.recv(copy=False), handle, audit)

    def _answer(self, frame: zmq.Frame, handle: CommandHandler, audit: CommandAudit | None) -> None:
        """Execute a command and reply; what ends a motion is answered before it is recorded."""
        command, reply = _parse_command(frame.bytes)
        if command is not None:
            reply = _execute(command, handle, audit)
        is_urgent = isinstance(command, StopCommand | AbortCommand | PauseCommand)
        if is_urgent:
            self._send(reply)
        if audit is not None and (command is None or isinstance(command, SentCommand)):
            peer = describe_peer(self.address, _get_peer(frame))
            audit.record(frame.bytes if command is None else command, peer, reply, wait=not is_urgent)
        if not is_urgent:
            self._send(reply)

    def _send(self, reply: Reply) -> None:
        # Clients of an older version refuse a field that they do not know, also that of a stop.
        unknown = {"audit"} if reply.audit is None else None
        self._socket.send(reply.model_dump_json(exclude=unknown).encode())


class Publisher(_SocketOwner):
    """Publisher of the agent's messages, from any thread, without waiting."""

    def __init__(self, address: str, key: Path | None = None) -> None:
        """Listen for subscribers; arguments and errors as those of every bound socket."""
        super().__init__(zmq.PUB, address, key)
        # A ZeroMQ socket must not be used by two threads at once.
        self._lock = threading.Lock()

    def publish(self, message: Publication) -> None:
        """Send a message to all subscribers; dropped for slow ones, and after the publisher is closed."""
        frames = _serialise(message)
        with self._lock:
            if not self._socket.closed:
                self._socket.send_multipart(frames)

    def __exit__(self, *error: object) -> None:
        with self._lock:
            super().__exit__(*error)


class AgentClient:
    """Client of the agent; may be used from any thread, and created before the agent is running."""

    def __init__(self, commands: str, samples: str, key: Path | None = None, sender: Sender | None = None) -> None:
        """Store the addresses; nothing is sent.

        Args:
            commands: address of the agent's request socket.
            samples: address of the agent's publishing socket.
            key: file with the agent's key, needed for TCP; it is read for each connection.
            sender: on whose behalf commands are sent outside of `send_as`; by default the account of this process.
        """
        self._commands, self._samples, self._key, self._sender = commands, samples, key, sender

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Send one command and wait for its reply.

        Args:
            command: one of `bench.agent_protocol.messages.Command`.
            timeout: [s]

        Raises:
            AgentUnreachableError: address or key is invalid, or no valid reply came in time.
        """
        if isinstance(command, SentCommand) and command.sender is None:
            stated = command.model_copy(update={"sender": get_sender(self._sender)})
            reply = self._exchange(_limit_validity(stated, timeout), timeout)
            # An agent that was started by an older version knows no senders, and must still stop.
            if reply.ok or not (reply.error.startswith(_INVALID) and ".sender: no such key" in reply.error):
                return reply
        return self._exchange(_limit_validity(command, timeout), timeout)

    def _exchange(self, command: Message, timeout: float) -> Reply:
        # One socket per command, because a request socket without its reply cannot be used again.
        with _open_socket(zmq.REQ) as socket:
            _connect(socket, self._commands, self._key)
            socket.send(command.model_dump_json().encode())
            if not socket.poll(round(timeout * 1e3)):
                key = f", or check that {self._key} is its key" if self._commands.startswith("tcp://") else ""
                raise AgentUnreachableError(
                    f"no rig agent replied at {self._commands} within {timeout:g} s; start one: mrbench rig{key}"
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
            AgentUnreachableError: address or key is invalid.
            LiveDataError: samples of another version.
        """
        with _open_socket(zmq.SUB) as socket:
            socket.subscribe(b"")
            _connect(socket, self._samples, self._key)
            while not stopping.is_set():
                if not socket.poll(_POLL_PERIOD):
                    yield None
                    continue
                yield _parse(socket.recv_multipart())


def _serialise(message: Publication) -> list[bytes]:
    """Return the parts of a publication: topic, then JSON, or list of channels and binary batch."""
    if isinstance(message, LiveBatch):
        return [SAMPLES, orjson.dumps(describe_channels(message.channels)), message.encode()]
    return [_TOPICS[type(message)], message.model_dump_json().encode()]


def _parse(parts: list[bytes]) -> Publication:
    if parts[0] == SAMPLES:
        _, channels, content = parts
        return decode_batch(content, parse_channels(channels))
    topic, content = parts
    return _MESSAGE_TYPES[topic].model_validate_json(content)


def _open_socket(kind: int, context: "zmq.Context[zmq.Socket[bytes]] | None" = None) -> "zmq.Socket[bytes]":
    """Open a socket that drops messages instead of waiting, and discards unsent ones when it is closed."""
    shared: zmq.Context[zmq.Socket[bytes]] = zmq.Context.instance() if context is None else context
    socket = shared.socket(kind)
    # High-water marks apply only to addresses that are bound or connected afterwards.
    socket.linger, socket.sndhwm, socket.rcvhwm = 0, _QUEUE_LENGTH, _QUEUE_LENGTH
    return socket


def _require_key(
    socket: "zmq.Socket[bytes]", address: str, key: Path | None
) -> contextlib.AbstractContextManager[None]:
    if key is None:
        raise RunError(f"{address}: a TCP address needs a key file, because others can reach it; give one")
    create_key(key)
    return authenticate_clients(socket, key)


def _bind_socket(socket: "zmq.Socket[bytes]", address: str) -> str:
    """Bind a socket, and return its address, with the port that replaces ``*``.

    Raises:
        RunError: the address is not available.
        ConfigError: other users could reach the socket.
    """
    path = check_socket_path(address) if address.startswith("ipc://") else None
    advice = "end another agent there, or use another address"
    # ZeroMQ would take the file from another process without a word.
    if path is not None and _is_listening(path):
        raise RunError(f"the agent cannot listen at {address}: another process does; {advice}")
    try:
        socket.bind(address)
    except zmq.ZMQError as error:
        raise RunError(f"the agent cannot listen at {address}: {error}; {advice}") from error
    if path is not None:
        path.chmod(0o600)
    return socket.getsockopt_string(zmq.LAST_ENDPOINT)


def _is_listening(path: Path) -> bool:
    """Return whether a process listens at a socket file; a killed one leaves its file."""
    with unix_socket.socket(unix_socket.AF_UNIX) as probe:
        return probe.connect_ex(str(path)) == 0


def _connect(socket: "zmq.Socket[bytes]", address: str, key: Path | None) -> None:
    """Connect a socket; a missing agent shows only when a reply is awaited.

    Raises:
        AgentUnreachableError: the address is invalid, the key of a TCP address is missing, or another user could
            have taken the agent's place.
    """
    try:
        if address.startswith("ipc://"):
            check_socket_path(address)
        elif address.startswith("tcp://"):
            if key is None:
                raise AgentUnreachableError(f"{address}: a TCP address needs the agent's key file; give one")
            authenticate_server(socket, key)
        socket.connect(address)
    except (ConfigError, SecretFileError) as error:
        raise AgentUnreachableError(str(error)) from error
    except zmq.ZMQError as error:
        raise AgentUnreachableError(
            f"{address!r} is not an address of a rig agent ({error}); give one such as tcp://127.0.0.1:5570"
        ) from error


def _limit_validity(command: Message, timeout: float) -> Message:
    """Return a command that is not executed after its sender has given up."""
    if not isinstance(command, TimedCommand):
        return command
    return command.model_copy(update={"valid_until_utc_s": time.time() + timeout})


def _find_refusal(command: Command) -> str:
    """Return why a command is no longer executed; empty if it is."""
    if not isinstance(command, TimedCommand) or command.valid_until_utc_s is None:
        return ""
    delay = time.time() - command.valid_until_utc_s
    if delay <= 0:
        return ""
    return (
        f"{command.command} was read {delay:.1f} s after its sender gave up; nothing was done; repeat it, and "
        "check the clocks if the sender is on another machine"
    )


def _parse_command(request: bytes) -> tuple[Command | None, Reply]:
    """Return the command in a message; None and the reply if it is not one."""
    try:
        return _COMMAND_ADAPTER.validate_json(request), Reply(ok=True)
    except ValidationError as error:
        fault = describe_validation_error(error, "the message")
        return None, Reply(ok=False, error=f"{_INVALID}: {fault}")


def _execute(command: Command, handle: CommandHandler, audit: CommandAudit | None) -> Reply:
    """Execute a command, unless its sender has given up or it could not be recorded."""
    refusal = _find_refusal(command)
    if not refusal and audit is not None and isinstance(command, SentCommand):
        refusal = audit.find_obstacle(command)
    if refusal:
        return Reply(ok=False, error=refusal)
    try:
        return handle(command)
    except Exception as error:  # one faulty command must not end the agent
        return Reply(
            ok=False, error=f"{command.command} failed: {error!r}; internal error of the agent, please report"
        )


def _get_peer(frame: zmq.Frame) -> str:
    try:
        return str(frame.get("Peer-Address"))
    except zmq.ZMQError:  # a transport without addresses
        return ""
