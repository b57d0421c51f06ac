"""Endpoints of a simulated serial line: a pty, or a TCP socket on loopback."""

import contextlib
import os
import select
import socket
import tty


def open_raw_pty() -> tuple[int, int]:
    """Open a pseudo terminal in raw mode, without echo and conversion of line ends; return master and slave."""
    master, slave = os.openpty()
    tty.setraw(slave)
    return master, slave


class Pty:
    """A pseudo terminal; the slave side is kept open, so it exists without a host."""

    def __init__(self) -> None:
        self._master, self._slave = open_raw_pty()
        # Non-blocking, as an instrument does not wait for a host that does not read.
        os.set_blocking(self._master, False)
        self.address = os.ttyname(self._slave)

    def write(self, data: bytes) -> int:
        """Send data; return the number of bytes accepted."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0
        except OSError:  # a disconnected cable accepts everything, and nothing arrives
            return len(data)

    def read(self, timeout: float) -> bytes:
        """Return data from the host, waiting up to ``timeout`` [s] for it; empty if none arrived."""
        watched = [self._master] if self._master >= 0 else []
        with contextlib.suppress(OSError):
            if select.select(watched, [], [], timeout)[0]:
                return os.read(self._master, 4096)
        return b""

    def hang_up(self) -> None:
        """Disconnect the host: the pty is closed permanently."""
        self.close()

    def close(self) -> None:
        """Close both sides; harmless when repeated."""
        master, self._master = self._master, -1
        if master >= 0:
            os.close(master)
            os.close(self._slave)


class TcpEndpoint:
    """A TCP socket for one host at a time; a new host replaces the last, as after a broken connection."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._server = socket.create_server((host, int(port)))
        self._host: socket.socket | None = None
        self.address = "socket://{}:{}".format(*self._server.getsockname()[:2])

    def write(self, data: bytes) -> int:
        """Send data; return the number of bytes accepted, all of them without a host."""
        try:
            return len(data) if self._host is None else self._host.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            return len(data)

    def read(self, timeout: float) -> bytes:
        """Return data from the host, waiting up to ``timeout`` [s] for it; empty if none arrived."""
        watched = [self._server] if self._host is None else [self._server, self._host]
        try:
            ready = select.select(watched, [], [], timeout)[0]
            if self._server in ready:
                self._accept()
            elif ready and self._host is not None:
                return self._receive(self._host)
        except (OSError, ValueError):
            self.hang_up()
        return b""

    def _accept(self) -> None:
        self.hang_up()
        self._host = self._server.accept()[0]
        self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._host.setblocking(False)

    def _receive(self, host: socket.socket) -> bytes:
        data = host.recv(4096)
        if not data:
            self.hang_up()
        return data

    def hang_up(self) -> None:
        """Disconnect the host; it may connect again."""
        host, self._host = self._host, None
        if host is not None:
            host.close()

    def close(self) -> None:
        """Disconnect the host and close the socket."""
        self.hang_up()
        self._server.close()
