"""pymodbus's blocking clients, with every frame on their wire passed to listeners."""

import logging
import select
from urllib.parse import urlsplit

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from drivers.channel import Frame
from drivers.instrument import Clock, FrameListener
from drivers.transport.modbus_address import ModbusAddress

logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # otherwise it writes to standard error

_UNLIMITED = 2**62
"""Consecutive timeouts after which the library disconnects by itself."""


class FrameTrace:
    """Record of the frames on the wire. pymodbus passes the same growing buffer repeatedly."""

    def __init__(self, clock: Clock) -> None:
        self.listeners: list[FrameListener] = []
        self.sent_ns = self.received_ns = clock()
        self._received = b""
        self._clock = clock

    def __call__(self, sending: bool, data: bytes) -> bytes:
        """Record bytes and return them unchanged."""
        if sending:
            self.flush()
            self.sent_ns = self._clock()
            self._notify_listeners(self.sent_ns, True, data)
            return data
        if not data.startswith(self._received):
            self.flush()
        self.received_ns, self._received = self._clock(), data
        return data

    def flush(self) -> int:
        """Pass the received bytes to the listeners, and return their number."""
        received, self._received = self._received, b""
        if received:
            self._notify_listeners(self.received_ns, False, received)
        return len(received)

    def _notify_listeners(self, now_ns: int, sent: bool, data: bytes) -> None:
        for listener in self.listeners:
            listener(Frame(now_ns, sent, data))


class LowLatencySerialClient(ModbusSerialClient):
    """Serial client that waits for the first byte with ``select``; the library polls once a millisecond."""

    def _wait_for_data(self) -> int:
        if self.socket is None:
            raise ConnectionException(str(self))
        try:
            descriptor = self.socket.fileno()
        except OSError:  # a remote port has no descriptor
            return super()._wait_for_data()
        ready, _, _ = select.select([descriptor], [], [], self.comm_params.timeout_connect)
        return int(self.socket.in_waiting) if ready else 0


Client = ModbusTcpClient | LowLatencySerialClient


def make_client(address: ModbusAddress, timeout: float, trace: FrameTrace) -> Client:
    """Make a client that sends each request once and never disconnects by itself; it is not opened yet.

    A raw ``socket://`` uses the TCP client with RTU framing: through pyserial its bytes would arrive one by one.
    """
    # Without the library's retries: on RTU a late reply to the first attempt would pass for the second's.
    client = _make_tcp_client(address, timeout, trace) or _make_serial_client(address, timeout, trace)
    # By default the library disconnects after a few timeouts; `ModbusLine` decides when to reopen a wire.
    client.set_max_no_responses(_UNLIMITED)
    client.transaction.count_until_disconnect = _UNLIMITED
    return client


def _make_tcp_client(address: ModbusAddress, timeout: float, trace: FrameTrace) -> Client | None:
    parts = urlsplit(address.url)
    if parts.scheme not in {"tcp", "socket"}:
        return None
    framer = FramerType.RTU if address.is_rtu else FramerType.SOCKET
    host, port = parts.hostname or "localhost", parts.port or 502
    return ModbusTcpClient(host, port=port, framer=framer, timeout=timeout, retries=0, trace_packet=trace)


def _make_serial_client(address: ModbusAddress, timeout: float, trace: FrameTrace) -> Client:
    return LowLatencySerialClient(
        address.url,
        baudrate=address.baud or 19200,
        parity=address.parity,
        stopbits=address.stop_bits,
        timeout=timeout,
        retries=0,
        trace_packet=trace,
    )


def is_input_pending(client: Client) -> bool:
    """Return whether bytes, or the end of the connection, wait on the wire before a request."""
    if client.socket is None:
        return False
    if isinstance(client, ModbusSerialClient):
        return bool(client.socket.in_waiting)
    ready, _, _ = select.select([client.socket], [], [], 0)
    return bool(ready)
