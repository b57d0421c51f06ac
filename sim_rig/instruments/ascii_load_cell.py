"""Simulated weighing indicator on a serial line, after ``drivers/wire/ascii_load_cell.toml``.

It reads the newest force several times per second and sends every reading as a line of text, without requests.
"""

import math
from typing import Any

from sim_rig.instruments.wire_files import load_wire_file
from sim_rig.live import RigInterface
from sim_rig.protocols import SerialAdapter, SerialPort

CONTRACT: dict[str, Any] = load_wire_file("ascii_load_cell")

_READING, _STATE, _ZERO = CONTRACT["reading"], CONTRACT["state"], CONTRACT["zero"]
_FULL_SCALE: float = CONTRACT["instrument"]["full_scale_n"]
_DECIMALS = {"N": 1, "kN": 4, "kg": 2, "lb": 2}


class AsciiLoadCellDevice:
    """Behaviour of the indicator, without its line; faults may be injected from any thread."""

    def __init__(self, signals: RigInterface, unit: str = "kg", rate: int = 10) -> None:
        """Switch the indicator on, untared.

        Args:
            signals: the rig's force.
            unit: of its readings: N, kN, kg or lb.
            rate: readings per second [Hz].
        """
        self.stuck = False
        """While true, it repeats its last reading."""
        self._signals = signals
        self._unit = unit
        self._period_ns = round(1e9 / rate)
        self._due_ns = signals.now_ns()
        self._force = 0.0
        self._tare: float | None = None

    def press_tare(self) -> None:
        """Press the front-panel button: subtract the present reading from now on, or show gross values again."""
        self._tare = self._force if self._tare is None else None

    def receive(self, data: bytes, now_ns: int) -> list[bytes]:
        """Ignore the data: the indicator has no commands."""
        return []

    def poll(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Return the lines due until ``now_ns`` [ns], each with its time [ns]."""
        lines = []
        while self._due_ns <= now_ns:
            lines.append((self._due_ns, self._format_line(self._due_ns)))
            self._due_ns += self._period_ns
        return lines

    def _format_line(self, at_ns: int) -> bytes:
        _, values = self._signals.read_latest("force", 1, at_ns)
        previous = self._force
        if len(values) and not self.stuck:
            self._force = float(values[-1])
        width, unit = _READING["value_width"], f"{self._unit:>{_READING['unit_width']}}"
        zero = _ZERO["gross"] if self._tare is None else _ZERO["net"]
        if not math.isfinite(self._force) or abs(self._force) > _FULL_SCALE:
            return f"{_STATE['overload']},{zero},+{'-' * width} {unit}\r\n".encode("ascii")
        reading = (self._force - (self._tare or 0.0)) / CONTRACT["units"][self._unit]
        state = _STATE["stable"] if abs(self._force - previous) < 1e-3 * _FULL_SCALE else _STATE["moving"]
        digits = f"{abs(reading):0{width}.{_DECIMALS[self._unit]}f}"
        return f"{state},{zero},{'-' if reading < 0 else '+'}{digits} {unit}\r\n".encode("ascii")


def make_ascii_load_cell(
    signals: RigInterface, address: str = "pty", unit: str = "kg", rate: int = 10
) -> tuple[SerialAdapter, AsciiLoadCellDevice]:
    """Return the indicator on its line, not serving yet, and the device for the injection of faults.

    Args:
        signals: the rig's force.
        address: ``pty``, or ``host:port`` with port 0 for any free one.
        unit: of its readings.
        rate: readings per second [Hz].
    """
    device = AsciiLoadCellDevice(signals, unit, rate)
    port = SerialPort(address, CONTRACT["line"]["baud"], buffer=1024, batch=0.0)
    return SerialAdapter(port, device, signals.now_ns), device
