"""A socketcand server: the way by which a CAN bus is reached over TCP.

Clients speak raw mode (``< open can0 >``, ``< rawmode >``, then ``< send 181 2 aa bb >`` against
``< frame 181 12.345678 AABB >``); nodes live in this process. All share one `BusTiming`, on the clock of the rig:
a frame is delivered when its last bit has passed. One thread serves everything, so that nodes need no locks.
"""

import contextlib
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

from sim_rig.can_bus import BusTiming, CanFrame
from sim_rig.clock import Clock

_QUIET = 0.02
"""[s] after the last greeting: clients compare it with all that one read brings, so no frame may follow yet."""
_BACKLOG = 1 << 20
"""[bytes] a client may leave unread before it is dropped."""
_LINE_LIMIT = 200
"""[bytes] of one command."""
_STAMPED = 35
"""SO_TIMESTAMPNS, which Python does not name: Linux tells when data came, as two 64 bit numbers."""
_STAMP = struct.Struct("=qq")
_TURN = 1e-3
"""[s] between looks at clock and nodes when nothing else happens."""


class Node(Protocol):
    """A device on the bus."""

    def join(self, send: Callable[[int, bytes, int], None], now_ns: int) -> None:
        """Take part; ``send`` puts a frame on the bus: identifier, data, not before [ns]."""

    def take(self, identifier: int, data: bytes, now_ns: int) -> None:
        """A frame of somebody else has passed."""

    def tick(self, now_ns: int) -> None:
        """Time has passed."""


class _Client:
    """One TCP connection."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self.opened = False
        self.raw = False
        self.received = b""
        self.unsent = b""
        self.quiet_until = 0.0

    def flush(self) -> None:
        if self.unsent and time.monotonic() >= self.quiet_until:
            with contextlib.suppress(BlockingIOError):
                self.unsent = self.unsent[self.socket.send(self.unsent) :]


class SocketcandServer:
    """Serves one bus on loopback until closed."""

    def __init__(
        self,
        nodes: Sequence[Node],
        clock: Clock,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        bus_name: str = "can0",
        bit_rate: int = 1_000_000,
    ) -> None:
        self.timing = BusTiming(bit_rate)
        self.dropped_clients = 0
        """Clients that did not read what they were sent."""
        self._nodes = list(nodes)
        self._now_ns, self._clock = clock.now_ns, clock
        self._bus_name = bus_name
        self._clients: list[_Client] = []
        self._listener = socket.create_server((host, port))
        self._listener.setblocking(False)
        self._started_ns = clock.now_ns()
        self._running = True
        for node in self._nodes:
            node.join(self._sender_for(node), self._started_ns)
        self._thread = threading.Thread(target=self._serve, name="socketcand", daemon=True)

    @property
    def port(self) -> int:
        """TCP port."""
        return int(self._listener.getsockname()[1])

    def start(self) -> "SocketcandServer":
        """Begin to serve."""
        self._thread.start()
        return self

    def close(self) -> None:
        """Close every connection, as if the power had gone."""
        self._running = False
        if self._thread.is_alive():
            self._thread.join(5)
        for client in self._clients:
            client.socket.close()
        self._listener.close()

    def __enter__(self) -> "SocketcandServer":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def load(self) -> float:
        """Share of the time since the start that the bus was taken [1]."""
        return self.timing.load(self._now_ns() - self._started_ns)

    def _sender_for(self, node: Node) -> Callable[[int, bytes, int], None]:
        def send(identifier: int, data: bytes, not_before_ns: int) -> None:
            self.timing.offer(CanFrame(identifier, data, node), not_before_ns)

        return send

    def _serve(self) -> None:
        while self._running:
            now = self._now_ns()
            for node in self._nodes:
                node.tick(now)
            for end_ns, frame in self.timing.passed(now):
                self._deliver(frame, end_ns)
            for client in self._clients:
                self._attend(client, client.flush)
            self._wait(now)

    def _deliver(self, frame: CanFrame, end_ns: int) -> None:
        line = f"< frame {frame.identifier:03X} {end_ns / 1e9:.6f} {frame.data.hex().upper()} >".encode("ascii")
        for node in self._nodes:
            if node is not frame.sender:
                node.take(frame.identifier, frame.data, end_ns)
        for client in self._clients:
            if client.raw and client is not frame.sender:
                client.unsent += line

    def _wait(self, now: int) -> None:
        """Look at the sockets until one is ready or something is due."""
        due = self.timing.next_ns()
        timeout = _TURN if due is None else min(max(due - now, 0) / 1e9, _TURN)
        readable, _, _ = select.select([self._listener, *(c.socket for c in self._clients)], [], [], timeout)
        if self._listener in readable:
            self._accept()
        for client in self._clients[:]:
            if client.socket in readable:
                self._attend(client, partial(self._receive, client))
            if len(client.unsent) > _BACKLOG:
                self.dropped_clients += 1
                self._drop(client)

    def _attend(self, client: _Client, what: Callable[[], None]) -> None:
        try:
            what()
        except OSError:
            self._drop(client)

    def _drop(self, client: _Client) -> None:
        client.socket.close()
        # A new list: whoever drops one may be going through the old.
        self._clients = [other for other in self._clients if other is not client]

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            connection, _ = self._listener.accept()
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with contextlib.suppress(OSError):  # where there are no stamps, a frame counts from its reading
                connection.setsockopt(socket.SOL_SOCKET, _STAMPED, 1)
            connection.setblocking(False)
            client = _Client(connection)
            client.unsent = b"< hi >"  # the protocol greets first
            self._clients.append(client)

    def _receive(self, client: _Client) -> None:
        data, came_ns = self._read(client.socket)
        if not data:
            raise ConnectionResetError
        client.received += data
        while b">" in client.received:
            command, client.received = client.received.split(b">", 1)
            self._obey(client, command.decode("ascii", "replace").strip().removeprefix("<").split(), came_ns)
        if len(client.received) > _LINE_LIMIT:  # no command is so long: it speaks something else
            raise ConnectionResetError

    def _read(self, connection: socket.socket) -> tuple[bytes, int]:
        """What a client has sent, and when it came [ns]: however late this thread is, the bus is not."""
        data, notes, _, _ = connection.recvmsg(4096, socket.CMSG_SPACE(_STAMP.size))
        for level, kind, note in notes:
            if (level, kind) == (socket.SOL_SOCKET, _STAMPED):
                # The kernel stamps by the wall's clock: only how old the stamp is can be used.
                seconds, rest = _STAMP.unpack(note)
                return data, self._clock.before_ns(time.time_ns() - seconds * 1_000_000_000 - rest)
        return data, self._now_ns()

    def _obey(self, client: _Client, words: list[str], came_ns: int) -> None:
        if words[:1] == ["open"] and words[1:] == [self._bus_name]:
            client.opened = True
            client.unsent += b"< ok >"
        elif words == ["rawmode"] and client.opened:
            client.unsent += b"< ok >"
            # By itself: no frame may come in the same read as this answer, see `_QUIET`.
            client.flush()
            client.raw, client.quiet_until = True, time.monotonic() + _QUIET
        elif words[:1] == ["send"] and client.raw:
            self._send(client, words[1:], came_ns)
        elif words == ["echo"]:
            client.unsent += b"< echo >"
        else:
            client.unsent += b"< error unknown command >"

    def _send(self, client: _Client, words: list[str], came_ns: int) -> None:
        try:
            identifier, size = int(words[0], 16), int(words[1])
            data = bytes(int(word, 16) for word in words[2:])
        except (ValueError, IndexError):
            identifier, size, data = -1, -1, b""
        if len(data) != size or size > 8 or not 0 <= identifier <= 0x7FF:
            client.unsent += b"< error in frame >"
            return
        self.timing.offer(CanFrame(identifier, data, client), came_ns)
