"""pymodbus's blocking clients, opened for an address, with what passes on their wire told to taps."""

import logging
import select
from urllib.parse import urlsplit

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from drivers.channel import Frame
from drivers.instrument import Clock, Tap
from drivers.modbus_address import ModbusAddress

logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # or it writes on standard error

_NEVER = 2**62
"""Silences in a row after which the library hangs up by itself."""


class Trace:
    """Follows what passes on the wire: pymodbus shows the same growing buffer again and again."""

    def __init__(self, clock: Clock) -> None:
        self.taps: list[Tap] = []
        self.sent_ns = self.received_ns = clock()
        self._heard = b""
        self._clock = clock

    def __call__(self, sending: bool, data: bytes) -> bytes:
        """Take note of bytes on their way, and let them pass unchanged."""
        if sending:
            self.flush()
            self.sent_ns = self._clock()
            self._tell(self.sent_ns, True, data)
            return data
        if not data.startswith(self._heard):
            self.flush()
        self.received_ns, self._heard = self._clock(), data
        return data

    def flush(self) -> int:
        """Tell of what has been heard; returns how many bytes it was."""
        heard, self._heard = self._heard, b""
        if heard:
            self._tell(self.received_ns, False, heard)
        return len(heard)

    def _tell(self, at: int, sent: bool, data: bytes) -> None:
        for tap in self.taps:
            tap(Frame(at, sent, data))


class PromptSerialClient(ModbusSerialClient):
    """Waits for the first byte with ``select``, where the library looks once a millisecond."""

    def _wait_for_data(self) -> int:
        if self.socket is None:
            raise ConnectionException(str(self))
        try:
            handle = self.socket.fileno()
        except OSError:  # a remote port has none
            return super()._wait_for_data()
        ready, _, _ = select.select([handle], [], [], self.comm_params.timeout_connect)
        return int(self.socket.in_waiting) if ready else 0


Client = ModbusTcpClient | PromptSerialClient


def client_for(address: ModbusAddress, timeout: float, trace: Trace) -> Client:
    """A client that asks once and never closes its wire by itself; not yet opened.

    A raw ``socket://`` goes through the TCP client with RTU framing: through pyserial it would come byte by byte.
    """
    # No retries of the library's own: on RTU a late answer to the first would pass for the second's.
    client = _tcp(address, timeout, trace) or _serial(address, timeout, trace)
    # By itself the library hangs up after a few silences; when a wire is to be opened anew is our decision.
    client.set_max_no_responses(_NEVER)
    client.transaction.count_until_disconnect = _NEVER
    return client


def _tcp(address: ModbusAddress, timeout: float, trace: Trace) -> Client | None:
    parts = urlsplit(address.url)
    if parts.scheme not in {"tcp", "socket"}:
        return None
    framer = FramerType.RTU if address.rtu else FramerType.SOCKET
    host, port = parts.hostname or "localhost", parts.port or 502
    return ModbusTcpClient(host, port=port, framer=framer, timeout=timeout, retries=0, trace_packet=trace)


def _serial(address: ModbusAddress, timeout: float, trace: Trace) -> Client:
    return PromptSerialClient(
        address.url,
        baudrate=address.baud or 19200,
        parity=address.parity,
        stopbits=address.stop_bits,
        timeout=timeout,
        retries=0,
        trace_packet=trace,
    )


def something_waits(client: Client) -> bool:
    """Whether bytes, or the end of the connection, stand on the wire before anything has been asked."""
    if client.socket is None:
        return False
    if isinstance(client, ModbusSerialClient):
        return bool(client.socket.in_waiting)
    ready, _, _ = select.select([client.socket], [], [], 0)
    return bool(ready)
