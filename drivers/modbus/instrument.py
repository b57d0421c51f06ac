"""Base class of the Modbus instruments: a line, named registers, and samples in a ring buffer."""

from dataclasses import replace
from typing import Any

import numpy as np

from drivers.channel import Channel, ClockReading, Quality, Reading, SampleBlock
from drivers.errors import OutOfRangeError
from drivers.instrument import Clock, FrameListener, Health
from drivers.modbus.ring_buffer_reader import RingBufferReader
from drivers.modbus.sample_decoder import RingBufferLayout
from drivers.transport import (
    ModbusAddress,
    ModbusLine,
    RegisterMap,
    Registers,
    compute_line_capacity,
    load_register_map,
)

_MAX_POLL_PERIOD = 0.05
"""Largest period of reading a ring buffer [s], except for slow instruments, see `_MIN_BATCH`."""
_MIN_BATCH = 4
"""Smallest number of samples per poll: a slowly changing quantity may be known a little later."""
_FILL_FRACTION = 0.9
"""Filled fraction of a block at which it is read (dimensionless): a poll costs the same however full the block."""
_CAPACITY_MARGIN = 1.1
"""Smallest ratio of line capacity to sample rate (dimensionless), needed to catch up after a failure."""


def check_rate(name: str, address: ModbusAddress, map_: RegisterMap) -> float:
    """Return the sample rate that the wire can transfer [Hz].

    Raises:
        OutOfRangeError: it is too low for the instrument's rate, or a serial line has no baud rate.
    """
    if address.is_rtu and not address.baud:
        raise OutOfRangeError(f"{name}: {address.url} is a serial line; set its baud rate")
    layout, serial = RingBufferLayout(map_), map_.document["serial"]
    instrument_rate = map_.document["ring"]["rate"]
    exchanges = [(17, 5 + 2 * layout.length)]  # a request with the start of the block, and the block
    rate = layout.capacity * compute_line_capacity(address, exchanges, serial["reply_delay"])
    if rate < _CAPACITY_MARGIN * instrument_rate:
        raise OutOfRangeError(
            f"{name}: {address.baud} baud transfer {rate:.0f} samples/s of the {instrument_rate} samples/s that "
            f"it takes, and {_CAPACITY_MARGIN * instrument_rate:.0f} are needed to catch up after a failure; "
            "set a higher baud rate or use Modbus TCP"
        )
    return rate


def _compute_poll_period(layout: RingBufferLayout) -> float:
    """Return the period of reading the ring buffer [s]."""
    interval = layout.interval_ns * 1e-9
    return max(min(_FILL_FRACTION * layout.capacity * interval, _MAX_POLL_PERIOD), _MIN_BATCH * interval)


class ModbusInstrument:
    """An instrument that keeps its samples in a ring buffer; subclasses add everything else."""

    def __init__(
        self,
        name: str,
        kind: str,
        address: ModbusAddress,
        clock: Clock,
        unit: int | None,
        timeout: float,
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: used in configuration, logs and messages.
            kind: name of the wire file.
            address: address of the line; without a baud rate, that of the wire file is used.
            clock: bench clock [ns].
            unit: Modbus unit number; by default that of the wire file.
            timeout: [s] without a reply after which a request has failed.

        Raises:
            OutOfRangeError: the serial line is too slow for the instrument's samples.
        """
        map_ = load_register_map(kind)
        address = replace(address, baud=map_.document["serial"]["baud"] if address.baud is None else address.baud)
        self.rate = check_rate(name, address, map_)
        """Sample rate that the wire can transfer [Hz]."""
        self._line = ModbusLine(name, address, map_.unit if unit is None else unit, clock, timeout)
        self._registers = Registers(self._line, map_)
        poll_period = _compute_poll_period(RingBufferLayout(map_))
        self._reader = RingBufferReader(self._registers, clock, poll_period=poll_period)

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""
        return self._line.name

    @property
    def address(self) -> ModbusAddress:
        """Address of the line."""
        return self._line.address

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels that it measures."""
        registers = self._registers.map.registers
        return tuple(registers[column.name].make_channel() for column in self._reader.layout.columns)

    @property
    def clock_reading(self) -> ClockReading | None:
        """Device clock in the latest block; None before the first."""
        return self._reader.clock_reading

    def connect(self) -> None:
        """Open the line, check the instrument's identity, and begin with its next sample.

        Raises:
            NotConnectedError: the line cannot be opened.
            NoReplyError, InvalidReplyError, RefusedError: the expected instrument does not reply.
        """
        self._line.open()
        try:
            self._reader.start()
        except Exception:  # not only driver errors: the line must not stay open
            self._line.close()
            raise

    def close(self) -> None:
        """Close the line."""
        self._line.close()

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return the samples since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Raises:
            NotConnectedError: the line is gone, or the instrument has restarted.
        """
        return self._reader.acquire(timeout)

    def compute_age(self) -> float | None:
        """Return the time [s] since the latest received sample was taken; None before the first."""
        return self._reader.compute_age()

    def read(self, channel: str) -> Reading:
        """Request the latest sample of a channel.

        Raises:
            OutOfRangeError: there is no such channel.
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the sample was not read.
        """
        layout = self._reader.layout
        names = [column.name for column in layout.columns]
        if channel not in names:
            raise OutOfRangeError(f"{self.name}: no channel {channel!r}; it measures {', '.join(names)}")
        status = ["status"] if layout.uncertain else []
        values, reply = self._registers.read_group(channel, "sampled", *status)
        is_uncertain = any(values[name].raw & layout.uncertain for name in status)
        quality: Quality = "uncertain" if is_uncertain else "good"
        value, raw = values[channel]
        device_ns = self._reader.unwrap_clock(values["sampled"].raw)
        return Reading(value, reply.received_ns, device_ns, raw, "bad" if np.isnan(value) else quality)

    def snapshot_decoder(self) -> dict[str, Any]:
        """Return the decoder's state, from which a replay decodes the frames to come, see `drivers.replay`."""
        return {
            "decoder": "modbus_ring",
            "instrument": self._registers.map.instrument,
            "rtu": self.address.is_rtu,
            "state": self._reader.snapshot(),
        }

    def get_health(self) -> Health:
        """Return counts and state."""
        return self._reader.get_health()

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with every frame from now on."""
        self._line.add_listener(listener)
