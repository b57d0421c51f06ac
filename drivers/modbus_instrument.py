"""What the Modbus instruments have in common: a line, named registers, samples that stand in a ring."""

from dataclasses import replace
from typing import Any

import numpy as np

from drivers.channel import Block, Channel, Quality, Reading, Stamp
from drivers.errors import OutOfRange
from drivers.instrument import Clock, Health, Tap
from drivers.modbus_address import ModbusAddress, carried
from drivers.modbus_line import ModbusLine
from drivers.modbus_registers import RegisterMap, Registers, load_map
from drivers.modbus_ring import Ring
from drivers.modbus_samples import Layout

_EVERY = 0.05
"""[s] between two readings of a ring at most, but for an instrument that is slower."""
_TOGETHER = 4
"""Samples that are read at once at least: what changes slowly may be known a little later."""
_FULL = 0.9
"""Share of a block that is waited for: each reading costs the host as much, however little stands in it."""
_SPARE = 1.1
"""A wire must carry this much more than the samples made, or it never catches up."""


def check_rate(name: str, address: ModbusAddress, map_: RegisterMap) -> float:
    """How many samples a second the wire carries [Hz].

    Raises:
        OutOfRange: fewer than the instrument makes, or a serial line without a baud rate.
    """
    if address.rtu and not address.baud:
        raise OutOfRange(f"{name}: {address.url} is a serial line; say its baud rate")
    layout, serial = Layout(map_), map_.document["serial"]
    made = map_.document["ring"]["rate"]
    exchanges = [(17, 5 + 2 * layout.length)]  # where to begin, answered by the block
    rate = layout.capacity * carried(address, exchanges, serial["reply_delay"])
    if rate < _SPARE * made:
        raise OutOfRange(
            f"{name}: {address.baud} baud carry {rate:.0f} samples/s of the {made} samples/s that it makes, and "
            f"{_SPARE * made:.0f} are needed to catch up after a failure; set a higher baud rate or use Modbus TCP"
        )
    return rate


class ModbusInstrument:
    """One instrument that keeps its samples in a ring; what it is beside that, its own class says."""

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
            name: in configuration, logs and messages.
            kind: name of its wire file.
            address: of its wire; a baud rate that is left out is that of the wire file.
            clock: the bench clock.
            unit: its Modbus number; the wire file's if none.
            timeout: [s] of silence after which a request has failed.

        Raises:
            OutOfRange: the serial line does not carry the samples that it makes.
        """
        map_ = load_map(kind)
        address = replace(address, baud=map_.document["serial"]["baud"] if address.baud is None else address.baud)
        self.rate = check_rate(name, address, map_)
        """Samples a second that the wire carries [Hz]."""
        self._line = ModbusLine(name, address, map_.unit if unit is None else unit, clock, timeout)
        self._registers = Registers(self._line, map_)
        layout = Layout(map_)
        interval = layout.interval_ns * 1e-9
        every = max(min(_FULL * layout.capacity * interval, _EVERY), _TOGETHER * interval)
        self._ring = Ring(self._registers, clock, every=every)

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""
        return self._line.name

    @property
    def address(self) -> ModbusAddress:
        """Of its wire."""
        return self._line.address

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What it measures."""
        registers = self._registers.map.registers
        return tuple(registers[column.name].channel() for column in self._ring.layout.columns)

    @property
    def stamp(self) -> Stamp | None:
        """Its clock beside the bench's, from the newest block."""
        return self._ring.stamp

    def connect(self) -> None:
        """Open the wire, check who answers, and begin with the next sample.

        Raises:
            NotConnected: the wire cannot be opened.
            NoReply, BadReply, Refused: it opens, but the instrument does not answer as itself.
        """
        self._line.open()
        try:
            self._ring.start()
        except Exception:  # not a driver's error alone: whatever it was, the wire must not stay open
            self._line.close()
            raise

    def close(self) -> None:
        """Close the wire."""
        self._line.close()

    def acquire(self, timeout: float) -> list[Block]:
        """Samples since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Raises:
            NotConnected: the wire has gone, or the instrument has restarted.
        """
        return self._ring.acquire(timeout)

    def age(self) -> float | None:
        """[s] since the newest sample that came was made; none before the first."""
        return self._ring.age()

    def read(self, channel: str) -> Reading:
        """Its newest sample of a channel, asked for now.

        Raises:
            OutOfRange: it has no such channel.
            NotConnected, NoReply, BadReply, Refused: it did not come.
        """
        layout = self._ring.layout
        names = [column.name for column in layout.columns]
        if channel not in names:
            raise OutOfRange(f"{self.name}: no channel {channel!r}; it measures {', '.join(names)}")
        doubt = ["status"] if layout.uncertain else []
        found, answer = self._registers.read_together(channel, "sampled", *doubt)
        doubtful = any(found[name].raw & layout.uncertain for name in doubt)
        quality: Quality = "uncertain" if doubtful else "good"
        value, raw = found[channel]
        device_ns = self._ring.device_ns(found["sampled"].raw)
        return Reading(value, answer.received_ns, device_ns, raw, "bad" if np.isnan(value) else quality)

    def describe(self) -> dict[str, Any]:
        """What a replay needs beside the frames from now on, see `drivers.replay`."""
        return {
            "decoder": "modbus_ring",
            "instrument": self._registers.map.instrument,
            "rtu": self.address.rtu,
            "state": self._ring.state(),
        }

    def health(self) -> Health:
        """Counts and state."""
        return self._ring.health()

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of every frame from now on."""
        self._line.listen(tap)
