"""One Modbus wire and the instrument at its end: one request, one answer, or a typed error in time.

Two framings share this file, over pymodbus's blocking clients:

- ``tcp://host:port``: Modbus TCP. Its answers carry the number of their request. After a failure the connection is
  opened anew, so that nothing half-read is left in it.
- a serial port, ``rfc2217://`` or ``socket://host:port``: Modbus RTU. Its answers carry no number, and a late one
  would pass for the answer to the next request. So after a failure nothing is asked until the instrument has
  sent back a token that only this moment can have asked for (function 8, return query data): a wire keeps its
  order, and whatever stood before the token is old. An instrument that does not know the function says so, and
  that is a token, too: its refusal is no answer to anything else.
"""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple, cast

from pymodbus import ModbusException
from pymodbus.exceptions import ConnectionException
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.diag_message import ReturnQueryDataRequest

from drivers.errors import BadReply, DriverError, NoReply, NotConnected, Refused
from drivers.instrument import Clock, Tap
from drivers.modbus_address import ModbusAddress
from drivers.modbus_client import Client, Trace, client_for, something_waits

Table = Literal["input", "holding"]
_READ, _WRITE = {"holding": 3, "input": 4}, {False: 6, True: 16}
_WRITE_AND_READ = 23
"""Codes of functions."""
_LONGEST_FRAME = 256
"""[bytes] of a request or an answer on a serial line."""
_DIAGNOSTICS_UNKNOWN = bytes([0x88, 0x01])
"""Answer of an instrument that does not know function 8: exception 1."""
_REFUSALS = {
    1: "it does not know this function",
    2: "there is no such register",
    3: "it does not take this value",
    4: "it cannot do this in its present state",
    5: "it needs more time",
    6: "it is busy",
    10: "the gateway has no path to it",
    11: "the gateway gets no answer from it",
}


class Answer(NamedTuple):
    """What an instrument said, and when."""

    words: list[int]
    """(registers,) as they stood on the wire."""
    sent_ns: int
    """Bench clock when the question went out [ns]."""
    received_ns: int
    """Bench clock when the answer was complete [ns]."""


class ModbusLine:
    """One instrument on its wire. Safe to use from several threads: one request at a time."""

    def __init__(self, name: str, address: ModbusAddress, unit: int, clock: Clock, timeout: float = 0.2) -> None:
        """Remember where it is; nothing is opened yet.

        Args:
            name: of the instrument, for messages.
            address: of its wire.
            unit: its number there, 1 to 247.
            clock: the bench clock.
            timeout: [s] of silence after which a request has failed; the time that the bytes themselves take on a
                serial line comes on top.
        """
        self.name = name
        self.address = address
        self.patience = timeout + address.seconds(2 * _LONGEST_FRAME)
        self.received = self.corrupted = self.resynchronised = 0
        self.last_ns: int | None = None
        self._unit = unit
        self._lock = threading.RLock()
        self._trace = Trace(clock)
        self._client: Client | None = None
        self._wanted_open = self._in_step = False
        self._token = 0

    @property
    def connected(self) -> bool:
        """Whether the wire is open."""
        return self._client is not None

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of every frame from now on."""
        self._trace.taps.append(tap)

    def open(self) -> None:
        """Open the wire; harmless when it is open.

        Raises:
            NotConnected: it cannot be opened.
            NoReply: a serial line is open, but nobody gives its token back.
        """
        with self._lock:
            self._wanted_open = True
            self._ready("opening")

    def close(self) -> None:
        """Close the wire; harmless when it is closed."""
        with self._lock:
            self._wanted_open = False
            self._drop()

    def read(self, table: Table, address: int, count: int) -> Answer:
        """Read registers, 1 to 125.

        Raises:
            NotConnected, NoReply, BadReply, Refused: no registers came.
        """
        what = f"reading {count} registers at {address}"

        def ask(client: Client) -> ModbusPDU:
            read = client.read_holding_registers if table == "holding" else client.read_input_registers
            return read(address, count=count, device_id=self._unit)

        return self._registers(ask, _READ[table], count, what)

    def write_and_read(self, write_at: int, words: Sequence[int], read_at: int, count: int) -> Answer:
        """Write holding registers, then read some, 1 to 125, in one exchange (function 23).

        Raises:
            NotConnected, NoReply, BadReply, Refused: no registers came; it is not known whether any were written.
        """
        what, values = f"writing at {write_at} and reading {count} registers at {read_at}", list(words)

        def ask(client: Client) -> ModbusPDU:
            return client.readwrite_registers(
                read_address=read_at,
                read_count=count,
                write_address=write_at,
                values=values,
                device_id=self._unit,
            )

        return self._registers(ask, _WRITE_AND_READ, count, what)

    def _registers(self, ask: Callable[[Client], ModbusPDU], function: int, count: int, what: str) -> Answer:
        """The registers that a question is answered by, as many as were asked for."""
        with self._lock:
            answer = self._exchange(ask, function, what)
            if len(answer.registers) != count:
                raise self._bad(what, f"{len(answer.registers)} registers came")
            return self._answered([int(word) for word in answer.registers])

    def write(self, address: int, words: Sequence[int]) -> Answer:
        """Write holding registers, 1 to 123. After NoReply it is not known whether they arrived.

        Raises:
            NotConnected, NoReply, BadReply, Refused: not confirmed.
        """
        several, values = len(words) > 1, list(words)
        what = f"writing {len(words)} registers at {address}"

        def ask(client: Client) -> ModbusPDU:
            if several:
                return client.write_registers(address, values, device_id=self._unit)
            return client.write_register(address, values[0], device_id=self._unit)

        with self._lock:
            answer = self._exchange(ask, _WRITE[several], what)
            confirmed = answer.count == len(words) if several else list(answer.registers) == values
            if answer.address != address or not confirmed:
                raise self._bad(what, "it confirmed another request")
            return self._answered(values)

    def _answered(self, words: list[int]) -> Answer:
        self.received += 1
        self.last_ns = self._trace.received_ns
        return Answer(words, self._trace.sent_ns, self._trace.received_ns)

    def _exchange(self, ask: Callable[[Client], ModbusPDU], function: int, what: str) -> ModbusPDU:
        """One request and its answer; the lock is held."""
        client = self._ready(what)
        try:
            answer = ask(client)
        except Exception as error:  # whatever the library makes of what came, it is translated here
            raise self._translated(error, what) from error
        # Told to the taps before it is judged: the log keeps what was refused, too.
        self._trace.flush()
        if answer.function_code & 0x7F != function:
            raise self._bad(what, f"function {answer.function_code} answered, asked was {function}")
        # A refusal is an answer like any other to the library: it is not raised.
        if answer.isError():
            code = answer.exception_code
            raise Refused(f"{self.name}: {what} was refused: {_REFUSALS.get(code, 'reason unknown')} ({code})")
        return answer

    def _translated(self, error: Exception, what: str) -> DriverError:
        heard = self._trace.flush()
        self._in_step = False
        if isinstance(error, ConnectionException | OSError):
            self._drop()
            return NotConnected(
                f"{self.name}: {what}: {self.address.url} has gone; the next request opens it again"
            )
        # The library tells of a wrong checksum as of a silence: that something was heard tells them apart.
        if heard or not isinstance(error, ModbusException):
            return self._bad(what, f"{heard} bytes came that are no whole answer")
        return NoReply(f"{self.name}: {what}: no answer within {self.patience:.3f} s; is it switched on?")

    def _bad(self, what: str, found: str) -> BadReply:
        self.corrupted += 1
        self._in_step = False
        return BadReply(
            f"{self.name}: {what}: {found}; nothing of it was used; see cable, baud rate and unit number"
        )

    def _ready(self, what: str) -> Client:
        """The open client, with nothing old left on its wire."""
        if not self._wanted_open:
            raise NotConnected(f"{self.name}: {what}: connect first")
        # What stands on the wire before the question is no answer to it.
        if self._client is not None and self._in_step and not self._stirs(self._client):
            return self._client
        if not self.address.rtu:
            self._drop()
        if self._client is None:
            self._connect()
        client = cast("Client", self._client)
        if self.address.rtu:
            self._find_step(client, what)
        self._in_step = True
        self.resynchronised += self.received > 0  # to find one's step for the first time is no failure
        return client

    def _stirs(self, client: Client) -> bool:
        try:
            return something_waits(client)
        except OSError:
            self._drop()
            return True

    def _connect(self) -> None:
        try:
            client = client_for(self.address, self.patience, self._trace)
            opened = client.connect()
        except Exception as error:
            raise NotConnected(f"{self.name}: {self.address.url} cannot be opened: {error}") from error
        if not opened:
            raise NotConnected(f"{self.name}: {self.address.url} cannot be opened; is it plugged in, is it free?")
        self._client = client

    def _find_step(self, client: Client, what: str) -> None:
        """Exchange a token: all that came before it is old."""
        self._in_step = False
        self._token = (self._token + 1) & 0xFFFF
        query = ReturnQueryDataRequest(self._token.to_bytes(2, "big"), dev_id=self._unit)
        try:
            found = self._comes_back(client, client.framer.buildFrame(query))
        except Exception as error:
            raise self._translated(error, what) from error
        self._trace.flush()
        if not found:
            raise NoReply(
                f"{self.name}: {what}: not asked, since it did not return its token within {self.patience:.3f} s; "
                "is it switched on, at this baud rate?"
            )

    def _comes_back(self, client: Client, token: bytes) -> bool:
        """Send a frame and wait until it returns, whatever else comes before."""
        unknown = client.framer.encode(_DIAGNOSTICS_UNKNOWN, self._unit, 0)
        deadline = time.monotonic() + self.patience
        client.send(self._trace(True, token))
        heard = b""
        while time.monotonic() < deadline:
            heard += client.recv(None)
            self._trace(False, heard)
            if token in heard or unknown in heard:
                return True
        return False

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]  # the library's TCP client is not annotated there
        self._client, self._in_step = None, False
