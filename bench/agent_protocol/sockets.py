"""ZeroMQ sockets of agent and clients: bound by the agent, connected by the clients.

Both sockets of an agent are files in a private folder, or TCP with a key, because a message moves the rod
(`bench.agent_protocol.endpoint`, `bench.agent_protocol.curve`).
"""

import contextlib
import socket as unix_socket
from pathlib import Path
from typing import Final, Self

import zmq

from bench.agent_protocol.curve import authenticate_clients, authenticate_server, create_key
from bench.agent_protocol.endpoint import check_socket_path
from bench.errors import AgentUnreachableError, ConfigError, RunError, SecretFileError

POLL_PERIOD: Final = 100
"""[ms] Interval at which a loop checks whether it has to end."""
_QUEUE_LENGTH = 64
"""Number of messages kept for a slow subscriber; older ones are dropped, so that it receives recent ones."""


class BoundSocket:
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
            self._socket = opening.enter_context(open_socket(kind, context))
            if address.startswith("tcp://"):
                opening.enter_context(_require_key(self._socket, address, key))
            self.address = _bind_socket(self._socket, address)
            self._resources = opening.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._resources.close()


def open_socket(kind: int, context: "zmq.Context[zmq.Socket[bytes]] | None" = None) -> "zmq.Socket[bytes]":
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


def connect(socket: "zmq.Socket[bytes]", address: str, key: Path | None) -> None:
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
