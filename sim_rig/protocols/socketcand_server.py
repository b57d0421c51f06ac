"""Socketcand server: access to a simulated CAN bus over TCP.

Clients use raw mode: ``< open can0 >``, ``< rawmode >``, then ``< send 181 2 aa bb >`` to send and ``< frame 181
12.345678 AABB >`` as received frames. The nodes are in this process. All share one `BusTiming` on the clock of the
rig: a frame is delivered when its last bit was transmitted, and frames without a pause between them together, when
the last of them was. One thread serves all, so that nodes need no locks.
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

from sim_rig.live import RigClock
from sim_rig.protocols.can_bus import BusTiming, CanFrame

_GREETING_PAUSE = 0.02
"""[s] without frames after the last greeting: clients compare it with all data of one read."""
_MAX_BACKLOG = 1 << 20
"""Limit on the bytes that a client leaves unread: beyond it, the client is dropped."""
_LINE_LIMIT = 200
"""Limit on the length of one command [bytes]."""
_SO_TIMESTAMPNS = 35
"""SO_TIMESTAMPNS, which Python does not name: Linux reports the arrival of data as two 64 bit numbers."""
_TIMESTAMP = struct.Struct("=qq")
_TICK_PERIOD = 1e-3
"""[s] between two ticks of the nodes without other events, while one of them acts by itself."""
_IDLE_TICK_PERIOD = 4e-3
"""[s] the same while none of them does. Waking the thread costs more than a tick."""


class CanNode(Protocol):
    """A device on the bus."""

    def join(self, send: Callable[[int, bytes, int], None], now_ns: int) -> None:
        """Join the bus; ``send`` sends a frame: identifier, data, earliest instant [ns]."""

    def receive(self, identifier: int, data: bytes, now_ns: int) -> None:
        """Process a frame of another node or client."""

    def tick(self, now_ns: int) -> None:
        """Advance to the present instant."""

    def acts_by_itself(self, now_ns: int) -> bool:
        """Return whether its behaviour depends on ticks, and not only on frames."""


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
        nodes: Sequence[CanNode],
        clock: RigClock,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        bus_name: str = "can0",
        bit_rate: int = 1_000_000,
    ) -> None:
        self.timing = BusTiming(bit_rate)
        self.dropped_clients = 0
        """Number of clients dropped because they did not read."""
        self._nodes = list(nodes)
        self._now_ns, self._clock = clock.now_ns, clock
        self._bus_name = bus_name
        self._clients: list[_Client] = []
        self._listener = socket.create_server((host, port))
        self._listener.setblocking(False)
        self._started_ns = clock.now_ns()
        self._running = True
        for node in self._nodes:
            node.join(self._make_sender(node), self._started_ns)
        self._thread = threading.Thread(target=self._serve, name="socketcand", daemon=True)

    @property
    def port(self) -> int:
        """TCP port."""
        return int(self._listener.getsockname()[1])

    def start(self) -> "SocketcandServer":
        """Start to serve."""
        self._thread.start()
        return self

    def close(self) -> None:
        """Close every connection, as at a power loss."""
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

    def compute_load(self) -> float:
        """Return the part of the time since the start in which the bus was busy [1]."""
        return self.timing.compute_load(self._now_ns() - self._started_ns)

    def _make_sender(self, node: CanNode) -> Callable[[int, bytes, int], None]:
        def send(identifier: int, data: bytes, not_before_ns: int) -> None:
            self.timing.enqueue(CanFrame(identifier, data, node), not_before_ns)

        return send

    def _serve(self) -> None:
        while self._running:
            now = self._now_ns()
            while (transmitted := self.timing.pop_next(now)) is not None:
                self._deliver(*transmitted)
            for node in self._nodes:
                node.tick(now)
            for client in self._clients:
                self._run_guarded(client, client.flush)
            self._wait(now)

    def _deliver(self, end_ns: int, frame: CanFrame) -> None:
        line = f"< frame {frame.identifier:03X} {end_ns / 1e9:.6f} {frame.data.hex().upper()} >".encode("ascii")
        for node in self._nodes:
            if node is not frame.sender:
                node.receive(frame.identifier, frame.data, end_ns)
        for client in self._clients:
            if client.raw and client is not frame.sender:
                client.unsent += line

    def _wait(self, now: int) -> None:
        """Wait until a socket is ready or an event is due, then handle the sockets."""
        due = self.timing.find_idle_instant()
        period = _TICK_PERIOD if any(node.acts_by_itself(now) for node in self._nodes) else _IDLE_TICK_PERIOD
        timeout = period if due is None else min(max(due - now, 0) / 1e9, period)
        readable, _, _ = select.select([self._listener, *(c.socket for c in self._clients)], [], [], timeout)
        if self._listener in readable:
            self._accept()
        for client in self._clients[:]:
            if client.socket in readable:
                self._run_guarded(client, partial(self._receive, client))
            if len(client.unsent) > _MAX_BACKLOG:
                self.dropped_clients += 1
                self._drop_client(client)

    def _run_guarded(self, client: _Client, action: Callable[[], None]) -> None:
        try:
            action()
        except OSError:
            self._drop_client(client)

    def _drop_client(self, client: _Client) -> None:
        client.socket.close()
        # A new list, as a caller may be iterating over the old one.
        self._clients = [other for other in self._clients if other is not client]

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            connection, _ = self._listener.accept()
            # Otherwise a small frame could wait until the client has acknowledged the one before.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with contextlib.suppress(OSError):  # without stamps, a frame counts from its reading
                connection.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            connection.setblocking(False)
            client = _Client(connection)
            client.unsent = b"< hi >"  # the protocol greets first
            self._clients.append(client)

    def _receive(self, client: _Client) -> None:
        data, arrival_ns = self._read(client.socket)
        if not data:
            raise ConnectionResetError
        client.received += data
        while b">" in client.received:
            command, client.received = client.received.split(b">", 1)
            self._execute(client, command.decode("ascii", "replace").strip().removeprefix("<").split(), arrival_ns)
        if len(client.received) > _LINE_LIMIT:  # longer than any command: another protocol
            raise ConnectionResetError

    def _read(self, connection: socket.socket) -> tuple[bytes, int]:
        """Return data from a client and its arrival [ns], so that a late thread does not delay the bus."""
        data, ancillary, _, _ = connection.recvmsg(4096, socket.CMSG_SPACE(_TIMESTAMP.size))
        for level, kind, content in ancillary:
            if (level, kind) == (socket.SOL_SOCKET, _SO_TIMESTAMPNS):
                # The kernel stamps by the system clock, so only the age of the stamp can be used.
                seconds, nanoseconds = _TIMESTAMP.unpack(content)
                return data, self._clock.read_past_ns(time.time_ns() - seconds * 1_000_000_000 - nanoseconds)
        return data, self._now_ns()

    def _execute(self, client: _Client, words: list[str], arrival_ns: int) -> None:
        if words[:1] == ["open"] and words[1:] == [self._bus_name]:
            client.opened = True
            client.unsent += b"< ok >"
        elif words == ["rawmode"] and client.opened:
            client.unsent += b"< ok >"
            # Sent separately: no frame may be in the same read as this reply, see `_GREETING_PAUSE`.
            client.flush()
            client.raw, client.quiet_until = True, time.monotonic() + _GREETING_PAUSE
        elif words[:1] == ["send"] and client.raw:
            self._send(client, words[1:], arrival_ns)
        elif words == ["echo"]:
            client.unsent += b"< echo >"
        else:
            client.unsent += b"< error unknown command >"

    def _send(self, client: _Client, words: list[str], arrival_ns: int) -> None:
        try:
            identifier, size = int(words[0], 16), int(words[1])
            data = bytes(int(word, 16) for word in words[2:])
        except (ValueError, IndexError):
            identifier, size, data = -1, -1, b""
        if len(data) != size or size > 8 or not 0 <= identifier <= 0x7FF:
            client.unsent += b"< error in frame >"
            return
        self.timing.enqueue(CanFrame(identifier, data, client), arrival_ns)
