"""python-can's socketcand client with three additions: deadlines, detection of a closed connection, batches.

Each of them needs the client's socket, which is private. This module is the only one that accesses it.
"""

import contextlib
import select
import socket
import threading
from collections.abc import Sequence
from typing import Any

import can
from can.interfaces.socketcand import SocketCanDaemonBus
from can.interfaces.socketcand.socketcand import convert_can_message_to_ascii_message


class SocketcandBus(SocketCanDaemonBus):
    """python-can's client with a deadline for the greeting and detection of a closed connection."""

    def __init__(self, channel: str, host: str, port: int, timeout: float) -> None:
        """Connect to the server and exchange greetings.

        Args:
            channel: name of the bus on the server.
            host: host of the server.
            port: port of the server.
            timeout: time limit for the greeting, and for each send [s].

        Raises:
            OSError, can.CanError: there is no server, or the greeting fails.
        """
        # The library retries a refused connection in a busy loop for ten seconds: fail here instead.
        socket.create_connection((host, port), timeout).close()
        # The library's greeting has no deadline: only the end of its connection stops it.
        deadline = threading.Timer(timeout, self._shut_down)
        deadline.start()
        try:
            client: Any = super()
            client.__init__(channel, host, port, tcp_tune=hasattr(socket, "TCP_QUICKACK"))
        except BaseException:
            self._get_socket().close()
            raise
        finally:
            deadline.cancel()
        self._get_socket().settimeout(timeout)

    def send_batch(self, messages: Sequence[can.Message]) -> None:
        """Send several frames in one segment: the system call costs more than everything else about a frame."""
        self._get_socket().sendall("".join(map(convert_can_message_to_ascii_message, messages)).encode("ascii"))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        client: Any = super()
        message, filtered = client._recv_internal(timeout)  # noqa: SLF001 - the library offers no other hook
        if message is None and self._is_peer_closed():
            raise can.CanOperationError("the server has closed the connection")
        return message, filtered

    def _is_peer_closed(self) -> bool:
        """Return whether the connection is closed: readable, but without data."""
        connection = self._get_socket()
        return bool(select.select([connection], [], [], 0)[0]) and not connection.recv(1, socket.MSG_PEEK)

    def _shut_down(self) -> None:
        # Before the library has made or connected its socket, there is nothing to shut down.
        with contextlib.suppress(OSError, KeyError):
            self._get_socket().shutdown(socket.SHUT_RDWR)

    def _get_socket(self) -> socket.socket:
        connection = self.__dict__["_SocketCanDaemonBus__socket"]
        assert isinstance(connection, socket.socket)  # noqa: S101 - for the type checker
        return connection
