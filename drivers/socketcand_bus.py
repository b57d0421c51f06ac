"""python-can's socketcand client with what it lacks: a deadline, an eye on the other end, frames sent as one.

Its socket is private to it, and without that none of the three can be had: this file is the one place that reaches
for it.
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
    """python-can's client with a deadline for the greeting and an eye on the other end."""

    def __init__(self, channel: str, host: str, port: int, timeout: float) -> None:
        """Greet the server.

        Args:
            channel: name of the bus there.
            host: of the server.
            port: of the server.
            timeout: for the greeting, and for each send [s].

        Raises:
            OSError, can.CanError: nobody serves it, or the greeting fails.
        """
        # A refused connection would be tried again in a busy loop for ten seconds.
        socket.create_connection((host, port), timeout).close()
        # The greeting waits without a deadline: only an end of its connection ends it.
        hang_up = threading.Timer(timeout, self._hang_up)
        hang_up.start()
        try:
            client: Any = super()
            client.__init__(channel, host, port, tcp_tune=hasattr(socket, "TCP_QUICKACK"))
        except BaseException:
            self._line().close()
            raise
        finally:
            hang_up.cancel()
        self._line().settimeout(timeout)

    def send_together(self, messages: Sequence[can.Message]) -> None:
        """Several frames in one segment: a call to the system costs more than all else about a frame."""
        self._line().sendall("".join(map(convert_can_message_to_ascii_message, messages)).encode("ascii"))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        client: Any = super()
        message, filtered = client._recv_internal(timeout)  # noqa: SLF001 - the one place where its bus can be seen
        if message is None and self._hung_up():
            raise can.CanOperationError("the server has closed the connection")
        return message, filtered

    def _hung_up(self) -> bool:
        """Whether the other end is gone: readable, and nothing to read."""
        line = self._line()
        return bool(select.select([line], [], [], 0)[0]) and not line.recv(1, socket.MSG_PEEK)

    def _hang_up(self) -> None:
        # Before the library has made its socket, or connected it, there is nothing to end.
        with contextlib.suppress(OSError, KeyError):
            self._line().shutdown(socket.SHUT_RDWR)

    def _line(self) -> socket.socket:
        # The library keeps its socket to itself, and without it neither deadline nor hang-up can be had.
        line = self.__dict__["_SocketCanDaemonBus__socket"]
        assert isinstance(line, socket.socket)  # noqa: S101 - for the type checker
        return line
