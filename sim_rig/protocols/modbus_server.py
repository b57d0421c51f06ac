"""Modbus server that handles one request at a time and injects faults into its replies.

It serves three wires: Modbus TCP, RTU frames on a TCP socket, RTU frames on a pty. As in a small instrument, the
next request is handled only after the last reply was sent; further requests wait on the wire. Serial replies are
delayed by their transmission time. `sim_rig.protocols.modbus_requests` executes the requests.
"""

import contextlib
import os
import selectors
import socket
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from sim_rig.protocols.modbus_frames import MBAP, RTU, Framing, ModbusRequest
from sim_rig.protocols.modbus_requests import ModbusDevice, handle_request
from sim_rig.protocols.serial_endpoint import open_raw_pty
from sim_rig.protocols.serial_port import make_noise

ReplyFaultKind = Literal["delay", "drop", "crc", "exception", "truncate", "unit", "garbage", "stale"]
_REQUEST_TIMEOUT = 0.05
"""[s] after which an incomplete request is discarded."""
_INCOMPLETE_POLL = 0.005
"""[s] between two turns while a request is incomplete or waits."""


class ReplyFault(NamedTuple):
    """Fault of one reply."""

    kind: ReplyFaultKind
    """delay: sent late; drop: not sent; crc: a flipped bit; exception: refused instead; truncate: first half only;
    unit: from another unit; garbage: noise before it; stale: the last reply to such a request again."""
    value: float = 0.0
    """Delay [s], or exception code."""


@dataclass
class _Host:
    """One connected host."""

    handle: int
    connection: socket.socket | None = None
    received: bytes = b""
    received_at: float = 0.0

    def send(self, data: bytes) -> None:
        # The host may have disconnected, which an instrument does not notice.
        with contextlib.suppress(OSError):
            os.write(self.handle, data)


@dataclass
class _PendingReply:
    """A reply that was not sent yet."""

    host: _Host
    frame: bytes
    due: float


# Not the server of pymodbus (3.16.1): it handles several requests of a connection at once and gives every reply
# the transaction number of the last one, so a delayed reply would be taken for that of another request.
@dataclass
class ModbusServer:
    """One instrument on one wire, with its own thread; a context manager."""

    device: ModbusDevice
    unit: int = 1
    framing: Framing = MBAP
    baud: int | None = None
    """[bit/s] of RTU replies; None for no delay."""
    bits_per_character: int = 10
    """[bit] per byte on the line."""
    poll: float = 0.005
    """[s] of real time between two calls of the device's `advance` without requests."""
    silent: bool = False
    """While true, no reply is sent."""
    reply_count: int = 0
    address: str = ""
    """Address for a host: ``tcp://host:port``, ``socket://host:port`` or the pty's path."""
    _faults: deque[tuple[ReplyFault, int | None]] = field(default_factory=deque)
    _hosts: list[_Host] = field(default_factory=list)
    _pending: _PendingReply | None = None
    _last_replies: dict[int, bytes] = field(default_factory=dict)
    _listener: socket.socket | None = None
    _pty: tuple[int, int] | None = None
    _selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
    _stopping: threading.Event = field(default_factory=threading.Event)
    _hang_up_requested: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None

    def listen(self, host: str = "127.0.0.1", port: int = 0) -> "ModbusServer":
        """Open a TCP socket, port 0 for any free one; `start` begins to serve."""
        self._listener = socket.create_server((host, port))
        scheme = "tcp" if self.framing is MBAP else "socket"
        self.address = f"{scheme}://{host}:{self._listener.getsockname()[1]}"
        self._selector.register(self._listener, selectors.EVENT_READ)
        return self

    def listen_pty(self) -> "ModbusServer":
        """Open a new pty, which stays while hosts connect and disconnect; `start` begins to serve."""
        master, slave = open_raw_pty()
        self._pty, self.framing, self.address = (master, slave), RTU, os.ttyname(slave)
        self._add(_Host(master))
        return self

    def inject(self, fault: ReplyFault, times: int = 1, function: int | None = None) -> None:
        """Apply a fault to the next replies, to requests of one function or of any."""
        self._faults.extend([(fault, function)] * times)

    @property
    def pending_faults(self) -> int:
        """Number of replies that still get a fault."""
        return len(self._faults)

    def hang_up(self) -> None:
        """Close the TCP connections; new ones are accepted."""
        self._hang_up_requested.set()

    def start(self) -> "ModbusServer":
        """Start to serve."""
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
        self._selector.close()

    def __enter__(self) -> "ModbusServer":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            # An incomplete request has a deadline of its own.
            wait = _INCOMPLETE_POLL if any(host.received for host in self._hosts) else self.poll
            if self._pending is not None:
                wait = min(wait, max(0.0, self._pending.due - time.monotonic()))
            for key, _ in self._selector.select(wait):
                self._receive(key.data)
            if self._hang_up_requested.is_set():
                self._hang_up_requested.clear()
                for host in [host for host in self._hosts if host.connection is not None]:
                    self._remove(host)
            self.device.advance()
            self._send_pending()
            for host in self._hosts:
                self._handle_next(host)

    def _receive(self, host: _Host | None) -> None:
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
        # On a pty, which stays while hosts connect and disconnect, an empty read is not the end.
        if not data and host.connection is not None:
            self._remove(host)
        host.received, host.received_at = host.received + data, time.monotonic()

    def _add(self, host: _Host) -> None:
        self._hosts.append(host)
        self._selector.register(host.handle, selectors.EVENT_READ, host)

    def _remove(self, host: _Host) -> None:
        self._hosts.remove(host)
        self._selector.unregister(host.handle)
        if self._pending is not None and self._pending.host is host:
            self._pending = None
        if host.connection is not None:
            host.connection.close()

    def _handle_next(self, host: _Host) -> None:
        """Handle the next request, if no reply is pending and the request is complete."""
        if self._pending is not None or not host.received:
            return
        request, remaining = self.framing.extract(host.received)
        if request is None:
            expired = time.monotonic() - host.received_at > _REQUEST_TIMEOUT
            host.received = b"" if expired else remaining
            return
        length, host.received = len(host.received) - len(remaining), remaining
        if request.unit == self.unit:
            self._handle_request(host, request, length)

    def _handle_request(self, host: _Host, request: ModbusRequest, length: int) -> None:
        fault = self._select_fault(request.pdu[0])
        if fault.kind == "exception":
            pdu = bytes([request.pdu[0] | 0x80, int(fault.value)])
        else:
            pdu = handle_request(self.device, request.pdu)
        frame = self._apply_fault(request._replace(pdu=pdu), fault)
        delay = fault.value if fault.kind == "delay" else 0.0
        if self.baud and self.framing is RTU:
            # Request and reply, each with the silent interval of 3.5 characters before it.
            delay += (length + len(frame) + 7) * self.bits_per_character / self.baud
        self._pending = _PendingReply(host, frame, time.monotonic() + delay)
        self._send_pending()

    def _select_fault(self, function: int) -> ReplyFault:
        if self.silent:
            return ReplyFault("drop")
        if self._faults and self._faults[0][1] in {None, function}:
            return self._faults.popleft()[0]
        return ReplyFault("delay", 0.0)

    def _apply_fault(self, reply: ModbusRequest, fault: ReplyFault) -> bytes:
        frame = self.framing.encode(reply)
        previous, self._last_replies[reply.pdu[0]] = self._last_replies.get(reply.pdu[0], b""), frame
        match fault.kind:
            case "drop":
                return b""
            case "crc":
                return self.framing.corrupt(frame)
            case "truncate":
                return frame[: len(frame) // 2]
            case "unit":
                return self.framing.encode(reply._replace(unit=reply.unit + 1))
            case "garbage":
                return make_noise(40) + frame
            case "stale":
                return previous
            case _:
                return frame

    def _send_pending(self) -> None:
        if self._pending is not None and time.monotonic() >= self._pending.due:
            self._pending.host.send(self._pending.frame)
            self._pending = None
            self.reply_count += 1
