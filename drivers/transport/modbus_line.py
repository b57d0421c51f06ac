"""One Modbus line and the instrument at its end: each request gets its reply, or a typed error in time.

The module uses pymodbus's blocking clients with two framings:

- ``tcp://host:port``: Modbus TCP. Replies carry the number of their request. After a failure the connection is
  reopened, so that no partly read reply remains in it.
- a serial port, ``rfc2217://`` or ``socket://host:port``: Modbus RTU. Replies carry no number, and a late one
  would pass for the reply to the next request. After a failure the line is therefore synchronised first: the
  instrument has to return a token of this moment (function 8, return query data). A wire keeps its order, so
  everything before the token is old. If the instrument does not know the function, its refusal serves as the
  token, since it cannot be the reply to any other request.
"""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple, cast

from pymodbus import ModbusException
from pymodbus.exceptions import ConnectionException
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.diag_message import ReturnQueryDataRequest

from drivers.errors import DriverError, InvalidReplyError, NoReplyError, NotConnectedError, RefusedError
from drivers.instrument import Clock, FrameListener
from drivers.transport.modbus_address import ModbusAddress
from drivers.transport.modbus_client import Client, FrameTrace, is_input_pending, make_client

RegisterTable = Literal["input", "holding"]
_READ_FUNCTIONS, _WRITE_FUNCTIONS = {"holding": 3, "input": 4}, {False: 6, True: 16}
_READ_WRITE_FUNCTION = 23
"""Function codes."""
_MAX_FRAME_BYTES = 256
"""Largest frame on a serial line [bytes]."""
_DIAGNOSTICS_UNKNOWN = bytes([0x88, 0x01])
"""Reply of an instrument that does not know function 8: exception 1."""
_EXCEPTION_TEXTS = {
    1: "it does not support this function",
    2: "the register does not exist",
    3: "it does not accept this value",
    4: "it cannot do this in its present state",
    5: "it needs more time",
    6: "it is busy",
    10: "the gateway has no route to it",
    11: "the gateway receives no reply from it",
}


class RegisterReply(NamedTuple):
    """Registers in a reply, with its times."""

    words: list[int]
    """Registers as on the wire, (registers,)."""
    sent_ns: int
    """Bench clock when the request was sent [ns]."""
    received_ns: int
    """Bench clock when the reply was complete [ns]."""


class ModbusLine:
    """One instrument on its line. Several threads may use it: requests are sent one at a time."""

    def __init__(self, name: str, address: ModbusAddress, unit: int, clock: Clock, timeout: float = 0.2) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: name of the instrument, for messages.
            address: address of the line.
            unit: unit number of the instrument, 1 to 247.
            clock: bench clock [ns].
            timeout: [s] without a reply after which a request has failed; on a serial line, the transfer time
                of the largest request and reply is added.
        """
        self.name, self.address, self._unit = name, address, unit
        self.timeout = timeout + address.compute_transfer_time(2 * _MAX_FRAME_BYTES)
        self.received = self.corrupted = self.resynchronised = self._token = 0
        self.last_ns: int | None = None
        self._lock, self._trace = threading.RLock(), FrameTrace(clock)
        self._client: Client | None = None
        self._open_requested = self._synchronised = False

    @property
    def connected(self) -> bool:
        """True if the line is open."""
        return self._client is not None

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with every frame from now on."""
        self._trace.listeners.append(listener)

    def open(self) -> None:
        """Open the line. May be repeated.

        Raises:
            NotConnectedError: the line cannot be opened.
            NoReplyError: a serial line is open, but the instrument does not return the token.
        """
        with self._lock:
            self._open_requested = True
            self._prepare_client("opening")

    def close(self) -> None:
        """Close the line. May be repeated."""
        with self._lock:
            self._open_requested = False
            self._disconnect()

    def read(self, table: RegisterTable, address: int, count: int) -> RegisterReply:
        """Read registers, 1 to 125.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: no registers were read.
        """
        action = f"reading {count} registers at {address}"

        def request(client: Client) -> ModbusPDU:
            read = client.read_holding_registers if table == "holding" else client.read_input_registers
            return read(address, count=count, device_id=self._unit)

        return self._request_registers(request, _READ_FUNCTIONS[table], count, action)

    def write_and_read(
        self, write_address: int, words: Sequence[int], read_address: int, count: int
    ) -> RegisterReply:
        """Write holding registers, then read 1 to 125 of them, in one exchange (function 23).

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: no registers were read. Whether any
                were written is unknown.
        """
        action = f"writing at {write_address} and reading {count} registers at {read_address}"

        def request(client: Client) -> ModbusPDU:
            return client.readwrite_registers(
                read_address=read_address,
                read_count=count,
                write_address=write_address,
                values=list(words),
                device_id=self._unit,
            )

        return self._request_registers(request, _READ_WRITE_FUNCTION, count, action)

    def _request_registers(
        self, request: Callable[[Client], ModbusPDU], function: int, count: int, action: str
    ) -> RegisterReply:
        """Send a request and return the registers in its reply, exactly ``count``."""
        with self._lock:
            reply = self._exchange(request, function, action)
            if len(reply.registers) != count:
                raise self._make_invalid_reply(
                    action, f"{len(reply.registers)} registers arrived instead of {count}"
                )
            return self._make_reply([int(word) for word in reply.registers])

    def write(self, address: int, words: Sequence[int]) -> RegisterReply:
        """Write holding registers, 1 to 123. After NoReplyError it is unknown whether they arrived.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the write was not confirmed.
        """
        several, values = len(words) > 1, list(words)
        action = f"writing {len(words)} registers at {address}"

        def request(client: Client) -> ModbusPDU:
            if several:
                return client.write_registers(address, values, device_id=self._unit)
            return client.write_register(address, values[0], device_id=self._unit)

        with self._lock:
            reply = self._exchange(request, _WRITE_FUNCTIONS[several], action)
            confirmed = reply.count == len(words) if several else list(reply.registers) == values
            if reply.address != address or not confirmed:
                raise self._make_invalid_reply(action, "it confirmed another request")
            return self._make_reply(values)

    def _make_reply(self, words: list[int]) -> RegisterReply:
        self.received += 1
        self.last_ns = self._trace.received_ns
        return RegisterReply(words, self._trace.sent_ns, self._trace.received_ns)

    def _exchange(self, request: Callable[[Client], ModbusPDU], function: int, action: str) -> ModbusPDU:
        """Send one request and return its reply. The caller holds the lock."""
        client = self._prepare_client(action)
        try:
            reply = request(client)
        except Exception as error:  # the library raises many kinds of errors; all are translated here
            raise self._translate_error(error, action) from error
        # Before the checks: the log keeps refused replies, too.
        self._trace.flush()
        self._check_reply(reply, function, action)
        return reply

    def _check_reply(self, reply: ModbusPDU, function: int, action: str) -> None:
        """Check that a reply is for the requested function, and not a refusal."""
        # The highest bit marks a refusal, so it does not belong to the function.
        if reply.function_code & 0x7F != function:
            raise self._make_invalid_reply(
                action, f"function {reply.function_code} is in the reply, {function} was requested"
            )
        # The library returns a refusal like any other reply.
        if reply.isError():
            code = reply.exception_code
            raise RefusedError(
                f"{self.name}: {action} was refused: {_EXCEPTION_TEXTS.get(code, 'reason unknown')} ({code})"
            )

    def _translate_error(self, error: Exception, action: str) -> DriverError:
        received = self._trace.flush()
        self._synchronised = False
        if isinstance(error, ConnectionException | OSError):
            self._disconnect()
            return NotConnectedError(
                f"{self.name}: {action}: {self.address.url} is gone; the next request opens it again"
            )
        # The library reports a wrong checksum as a timeout; the number of received bytes distinguishes them.
        if received or not isinstance(error, ModbusException):
            return self._make_invalid_reply(action, f"{received} bytes arrived that are not a complete reply")
        return NoReplyError(
            f"{self.name}: {action}: no reply within {self.timeout:.3f} s; check that it is switched on"
        )

    def _make_invalid_reply(self, action: str, reason: str) -> InvalidReplyError:
        self.corrupted += 1
        self._synchronised = False
        return InvalidReplyError(
            f"{self.name}: {action}: {reason}; nothing of it was used; check cable, baud rate and unit number"
        )

    def _prepare_client(self, action: str) -> Client:
        """Return the open client, with no stale input on its wire."""
        if not self._open_requested:
            raise NotConnectedError(f"{self.name}: {action}: connect first")
        if self._client is not None and self._synchronised and not self._has_stale_input(self._client):
            return self._client
        if not self.address.is_rtu:
            self._disconnect()
        if self._client is None:
            self._connect()
        client = cast("Client", self._client)
        if self.address.is_rtu:
            self._synchronise(client, action)
        self._synchronised = True
        self.resynchronised += self.received > 0  # the first synchronisation does not follow a failure
        return client

    def _has_stale_input(self, client: Client) -> bool:
        """Return whether input waits before the request, which cannot be the reply to it."""
        try:
            return is_input_pending(client)
        except OSError:
            self._disconnect()
            return True

    def _connect(self) -> None:
        try:
            client = make_client(self.address, self.timeout, self._trace)
            opened = client.connect()
        except Exception as error:
            raise NotConnectedError(f"{self.name}: {self.address.url} cannot be opened: {error}") from error
        if not opened:
            raise NotConnectedError(
                f"{self.name}: {self.address.url} cannot be opened; check that it is plugged in and not in use"
            )
        self._client = client

    def _synchronise(self, client: Client, action: str) -> None:
        """Exchange a new token: all input before it is stale, late returns of earlier tokens included."""
        self._synchronised = False
        self._token = (self._token + 1) & 0xFFFF
        query = ReturnQueryDataRequest(self._token.to_bytes(2, "big"), dev_id=self._unit)
        try:
            returned = self._is_token_returned(client, client.framer.buildFrame(query))
        except Exception as error:
            raise self._translate_error(error, action) from error
        self._trace.flush()
        if not returned:
            raise NoReplyError(
                f"{self.name}: {action}: not requested, since it did not return its token within "
                f"{self.timeout:.3f} s; check that it is switched on and uses this baud rate"
            )

    def _is_token_returned(self, client: Client, token: bytes) -> bool:
        """Send a frame and wait until it returns, whatever arrives before it."""
        unknown = client.framer.encode(_DIAGNOSTICS_UNKNOWN, self._unit, 0)
        deadline = time.monotonic() + self.timeout
        client.send(self._trace(True, token))
        received = b""
        while time.monotonic() < deadline:
            received += client.recv(None)
            self._trace(False, received)
            if token in received or unknown in received:
                return True
        return False

    def _disconnect(self) -> None:
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]  # the library's TCP client is not annotated there
        self._client, self._synchronised = None, False
