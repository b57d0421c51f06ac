"""Where a host finds the instrument's end of a serial line: a pty, or a TCP socket on loopback."""

import contextlib
import os
import select
import socket
import tty


class Pty:
    """A pseudo terminal; its own hold on the slave side keeps it open while no host is there."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        # As it is opened, a terminal sends back what it gets, and changes ends of lines.
        tty.setraw(self._slave)
        # An instrument does not wait for a host that reads nothing.
        os.set_blocking(self._master, False)
        self.address = os.ttyname(self._slave)

    def write(self, data: bytes) -> int:
        """How many bytes it took."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0
        except OSError:  # a cable that was pulled takes everything, and nothing arrives
            return len(data)

    def read(self, timeout: float) -> bytes:
        """What the host has sent, waiting up to ``timeout`` [s] for it; empty if nothing."""
        watched = [self._master] if self._master >= 0 else []
        with contextlib.suppress(OSError):
            if select.select(watched, [], [], timeout)[0]:
                return os.read(self._master, 4096)
        return b""

    def hang_up(self) -> None:
        """Pull the cable: the pty is gone for good."""
        self.close()

    def close(self) -> None:
        """Give both sides back; harmless when repeated."""
        master, self._master = self._master, -1
        if master >= 0:
            os.close(master)
            os.close(self._slave)


class Listener:
    """A TCP socket that serves one host at a time; a new one takes over, as after a broken connection."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._server = socket.create_server((host, int(port)))
        self._host: socket.socket | None = None
        self.address = "socket://{}:{}".format(*self._server.getsockname()[:2])

    def write(self, data: bytes) -> int:
        """How many bytes it took; all of them where nobody listens."""
        try:
            return len(data) if self._host is None else self._host.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            return len(data)

    def read(self, timeout: float) -> bytes:
        """What the host has sent, waiting up to ``timeout`` [s] for it; empty if nothing."""
        watched = [self._server] if self._host is None else [self._server, self._host]
        try:
            ready = select.select(watched, [], [], timeout)[0]
            if self._server in ready:
                self._accept()
            elif ready and self._host is not None:
                return self._heard(self._host)
        except (OSError, ValueError):
            self.hang_up()
        return b""

    def _accept(self) -> None:
        self.hang_up()
        self._host = self._server.accept()[0]
        self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._host.setblocking(False)

    def _heard(self, host: socket.socket) -> bytes:
        data = host.recv(4096)
        if not data:
            self.hang_up()
        return data

    def hang_up(self) -> None:
        """Cut the host off; it may connect again."""
        host, self._host = self._host, None
        if host is not None:
            host.close()

    def close(self) -> None:
        """Cut the host off and listen no more."""
        self.hang_up()
        self._server.close()
