"""What the Modbus instruments have in common: a line, named registers, a ring of samples."""

from dataclasses import replace
from typing import Any

import numpy as np

from drivers.channel import Channel, Quality, Reading
from drivers.errors import OutOfRange
from drivers.instrument import Clock
from drivers.modbus_address import ModbusAddress, carried
from drivers.modbus_line import ModbusLine
from drivers.modbus_registers import RegisterMap, Registers, load_map
from drivers.modbus_ring import Ring
from drivers.modbus_samples import Layout

_EVERY = 0.05
"""[s] between two readings of a ring at most, but for an instrument that is slower: it is read once a sample."""
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


class Sampler:
    """One instrument that keeps its samples in a ring."""

    def __init__(
        self,
        name: str,
        instrument: str,
        address: ModbusAddress,
        clock: Clock,
        unit: int | None,
        timeout: float,
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: in configuration, logs and messages.
            instrument: name of its wire file.
            address: of its wire; a baud rate that is left out is that of the wire file.
            clock: the bench clock.
            unit: its Modbus number; the wire file's if none.
            timeout: [s] of silence after which a request has failed.

        Raises:
            OutOfRange: the serial line does not carry the samples that it makes.
        """
        map_ = load_map(instrument)
        address = replace(address, baud=address.baud or map_.document["serial"]["baud"])
        self.rate = check_rate(name, address, map_)
        self.line = ModbusLine(name, address, unit or map_.unit, clock, timeout)
        self.registers = Registers(self.line, map_)
        layout = Layout(map_)
        interval = layout.interval_ns * 1e-9
        every = max(min(_FULL * layout.capacity * interval, _EVERY), interval)
        self.ring = Ring(self.registers, clock, every=every)

    def channels(self) -> tuple[Channel, ...]:
        """The channels of its samples."""
        return tuple(self.registers.map.registers[column.name].channel() for column in self.ring.layout.columns)

    def connect(self) -> None:
        """Open the wire, check who answers, and begin with the next sample.

        Raises:
            NotConnected: the wire cannot be opened.
            NoReply, BadReply, Refused: it opens, but the instrument does not answer as itself.
        """
        self.line.open()
        try:
            self.ring.start()
        except Exception:
            self.line.close()
            raise

    def describe(self) -> dict[str, Any]:
        """What `drivers.replay.decoder` needs beside the frames from now on."""
        return {
            "decoder": "modbus_ring",
            "instrument": self.registers.map.instrument,
            "rtu": self.line.address.rtu,
            "state": self.ring.state(),
        }

    def read(self, channel: str) -> Reading:
        """Its newest sample of a channel, asked for now.

        Raises:
            OutOfRange: it has no such channel.
            NotConnected, NoReply, BadReply, Refused: it did not come.
        """
        names = [column.name for column in self.ring.layout.columns]
        if channel not in names:
            raise OutOfRange(f"{self.line.name}: no channel {channel!r}; it measures {', '.join(names)}")
        doubt = ["status"] if self.ring.layout.uncertain else []
        found, answer = self.registers.read_together(channel, "sampled", *doubt)
        doubtful = any(found[name].raw & self.ring.layout.uncertain for name in doubt)
        quality: Quality = "uncertain" if doubtful else "good"
        value, raw = found[channel]
        return Reading(
            value,
            answer.received_ns,
            self.ring.device_ns(found["sampled"].raw),
            raw,
            "bad" if np.isnan(value) else quality,
        )
