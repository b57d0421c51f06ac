"""A Modbus server thin enough to be seen through: one request at a time, and every way to fail.

Three wires: Modbus TCP, RTU frames on a TCP socket, RTU frames on a pty. A request is taken only when the answer
before it has left, as in a small instrument; what comes meanwhile waits in the wire. Serial answers leave when the
line could have carried them. What a request means stands in `sim_rig.modbus_requests`.
"""

import contextlib
import os
import selectors
import socket
import threading
import time
import tty
from collections import deque
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from sim_rig.modbus_frames import MBAP, RTU, Framing, Request
from sim_rig.modbus_requests import Device, answer

Kind = Literal["delay", "drop", "crc", "exception", "truncate", "unit", "garbage", "stale"]
_LOOK = 0.005
"""[s] of real time between two looks at a device that nobody asks."""
_QUIET = 0.05
"""[s] after which half a request is forgotten."""


class WireFault(NamedTuple):
    """What becomes of one answer."""

    kind: Kind
    """delay: leaves late; drop: never; crc: a bit is turned; exception: refused instead; truncate: half of it;
    unit: from another unit; garbage: noise before it; stale: the last answer to such a request again."""
    value: float = 0.0
    """[s] of delay, or the exception's code."""


@dataclass
class _Host:
    """One who may ask."""

    handle: int
    connection: socket.socket | None = None
    heard: bytes = b""
    heard_at: float = 0.0

    def send(self, data: bytes) -> None:
        # Whoever asked may have gone: an instrument does not mind.
        with contextlib.suppress(OSError):
            os.write(self.handle, data)


@dataclass
class _Pending:
    """An answer that has not left."""

    host: _Host
    frame: bytes
    due: float


# Not pymodbus's own server (3.16.1): it works on several requests of a connection at once and gives every answer
# the number of the last, so that a delayed answer would pass for another one's.
@dataclass
class ModbusServer:
    """One instrument on one wire, in a thread of its own; a context manager."""

    device: Device
    unit: int = 1
    framing: Framing = MBAP
    baud: int | None = None
    """[bit/s] at which RTU answers leave; at once if none."""
    character: int = 10
    """[bit] for a byte."""
    silent: bool = False
    """While true, every answer is lost."""
    answered: int = 0
    address: str = ""
    """What a host opens: ``tcp://host:port``, ``socket://host:port`` or the pty's path."""
    _faults: deque[tuple[WireFault, int | None]] = field(default_factory=deque)
    _hosts: list[_Host] = field(default_factory=list)
    _pending: _Pending | None = None
    _last: dict[int, bytes] = field(default_factory=dict)
    _listener: socket.socket | None = None
    _pty: tuple[int, int] | None = None
    _watched: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
    _stopping: threading.Event = field(default_factory=threading.Event)
    _cut: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None

    def listen(self, host: str = "127.0.0.1", port: int = 0) -> "ModbusServer":
        """Serve on a TCP socket; port 0 for any free one. `start` begins."""
        self._listener = socket.create_server((host, port))
        scheme = "tcp" if self.framing is MBAP else "socket"
        self.address = f"{scheme}://{host}:{self._listener.getsockname()[1]}"
        self._watched.register(self._listener, selectors.EVENT_READ)
        return self

    def listen_pty(self) -> "ModbusServer":
        """Serve on a new pty, which stays while its hosts come and go. `start` begins."""
        master, slave = os.openpty()
        # As it is opened, a terminal sends back what it gets, and changes ends of lines.
        tty.setraw(slave)
        self._pty, self.framing, self.address = (master, slave), RTU, os.ttyname(slave)
        self._add(_Host(master))
        return self

    def inject(self, fault: WireFault, times: int = 1, function: int | None = None) -> None:
        """Let the next answers (to requests of one function, or to any) suffer a fault."""
        self._faults.extend([(fault, function)] * times)

    @property
    def pending_faults(self) -> int:
        """Answers that are still to suffer."""
        return len(self._faults)

    def hang_up(self) -> None:
        """Cut the TCP connections; new ones are taken."""
        self._cut.set()

    def start(self) -> "ModbusServer":
        """Serve from now on."""
        self._thread = threading.Thread(target=self._serve, name=f"modbus {self.address}", daemon=True)
        self._thread.start()
        return self

    def stop(self) -> None:
        """Stop serving and close the wire; harmless when repeated."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
        for host in list(self._hosts):
            self._remove(host)
        if self._listener is not None:
            self._listener.close()
        if self._pty is not None:
            os.close(self._pty[0])
            os.close(self._pty[1])
        self._listener = self._pty = None
        self._watched.close()

    def __enter__(self) -> "ModbusServer":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            wait = _LOOK if self._pending is None else min(_LOOK, max(0.0, self._pending.due - time.monotonic()))
            for key, _ in self._watched.select(wait):
                self._hear(key.data)
            if self._cut.is_set():
                self._cut.clear()
                for host in [host for host in self._hosts if host.connection is not None]:
                    self._remove(host)
            self.device.advance()
            self._send_due()
            for host in self._hosts:
                self._take(host)

    def _hear(self, host: _Host | None) -> None:
        if host is None:
            if self._listener is not None:
                connection, _ = self._listener.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._add(_Host(connection.fileno(), connection))
            return
        try:
            data = os.read(host.handle, 4096)
        except OSError:
            data = b""
        # A pty stays while its hosts come and go: on it, nothing to read is no end.
        if not data and host.connection is not None:
            self._remove(host)
        host.heard, host.heard_at = host.heard + data, time.monotonic()

    def _add(self, host: _Host) -> None:
        self._hosts.append(host)
        self._watched.register(host.handle, selectors.EVENT_READ, host)

    def _remove(self, host: _Host) -> None:
        self._hosts.remove(host)
        self._watched.unregister(host.handle)
        if self._pending is not None and self._pending.host is host:
            self._pending = None
        if host.connection is not None:
            host.connection.close()

    def _take(self, host: _Host) -> None:
        """Take the next request, if no answer is on its way and the request is whole."""
        if self._pending is not None or not host.heard:
            return
        request, rest = self.framing.take(host.heard)
        if request is None:
            forgotten = time.monotonic() - host.heard_at > _QUIET
            host.heard = b"" if forgotten else rest
            return
        length, host.heard = len(host.heard) - len(rest), rest
        if request.unit == self.unit:
            self._answer(host, request, length)

    def _answer(self, host: _Host, request: Request, length: int) -> None:
        fault = self._fault_for(request.pdu[0])
        if fault.kind == "exception":
            pdu = bytes([request.pdu[0] | 0x80, int(fault.value)])
        else:
            pdu = answer(self.device, request.pdu)
        frame = self._suffered(request._replace(pdu=pdu), fault)
        delay = fault.value if fault.kind == "delay" else 0.0
        if self.baud and self.framing is RTU:
            # Request and answer, and before each the 3.5 characters of silence that tell frames apart.
            delay += (length + len(frame) + 7) * self.character / self.baud
        self._pending = _Pending(host, frame, time.monotonic() + delay)
        self._send_due()

    def _fault_for(self, function: int) -> WireFault:
        if self.silent:
            return WireFault("drop")
        if self._faults and self._faults[0][1] in {None, function}:
            return self._faults.popleft()[0]
        return WireFault("delay", 0.0)

    def _suffered(self, reply: Request, fault: WireFault) -> bytes:
        good = self.framing.wrap(reply)
        before, self._last[reply.pdu[0]] = self._last.get(reply.pdu[0], b""), good
        match fault.kind:
            case "drop":
                return b""
            case "crc":
                return self.framing.corrupt(good)
            case "truncate":
                return good[: len(good) // 2]
            case "unit":
                return self.framing.wrap(reply._replace(unit=reply.unit + 1))
            case "garbage":
                return bytes((37 * place + 11) % 256 for place in range(40)) + good
            case "stale":
                return before
            case _:
                return good

    def _send_due(self) -> None:
        if self._pending is not None and time.monotonic() >= self._pending.due:
            self._pending.host.send(self._pending.frame)
            self._pending = None
            self.answered += 1
