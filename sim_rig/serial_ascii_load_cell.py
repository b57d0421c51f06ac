"""A weighing indicator on its serial line: ``drivers/wire/ascii_load_cell.toml``, from the instrument's side.

It shows the newest force some times a second, in its own unit, and sends every reading as a line of text, unasked.
"""

import math
import tomllib
from pathlib import Path
from typing import Any

from sim_rig.serial_adapter import SerialAdapter
from sim_rig.serial_port import SerialPort
from sim_rig.signals import Signals

CONTRACT: dict[str, Any] = tomllib.loads(
    (Path(__file__).parents[1] / "drivers" / "wire" / "ascii_load_cell.toml").read_text("utf-8")
)
"""The wire contract; the only thing that this file and the driver have in common."""

_FORM, _STATE, _ZERO = CONTRACT["reading"], CONTRACT["state"], CONTRACT["zero"]
_FULL_SCALE: float = CONTRACT["instrument"]["full_scale_n"]
_DECIMALS = {"N": 1, "kN": 4, "kg": 2, "lb": 2}


class AsciiLoadCellDevice:
    """What the indicator does, without its line; injected faults may be set from any thread."""

    def __init__(self, signals: Signals, unit: str = "kg", rate: int = 10) -> None:
        """An indicator that has just been switched on, untared.

        Args:
            signals: the rig's force.
            unit: that it shows: N, kN, kg or lb.
            rate: readings a second [Hz].
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
        """The button at its front: net of the present reading from now on; pressed again, gross."""
        self._tare = self._force if self._tare is None else None

    def hear(self, data: bytes, now_ns: int) -> list[bytes]:
        """Nothing: it takes no orders."""
        return []

    def speak(self, now_ns: int) -> list[tuple[int, bytes]]:
        """The lines due until ``now_ns`` [ns], each with its time [ns]."""
        lines = []
        while self._due_ns <= now_ns:
            lines.append((self._due_ns, self._line(self._due_ns)))
            self._due_ns += self._period_ns
        return lines

    def _line(self, at_ns: int) -> bytes:
        _, values = self._signals.latest("force", 1, at_ns)
        before = self._force
        if len(values) and not self.stuck:
            self._force = float(values[-1])
        width, unit = _FORM["value_width"], f"{self._unit:>{_FORM['unit_width']}}"
        zero = _ZERO["gross"] if self._tare is None else _ZERO["net"]
        if not math.isfinite(self._force) or abs(self._force) > _FULL_SCALE:
            return f"{_STATE['overload']},{zero},+{'-' * width} {unit}\r\n".encode("ascii")
        shown = (self._force - (self._tare or 0.0)) / CONTRACT["units"][self._unit]
        state = _STATE["stable"] if abs(self._force - before) < 1e-3 * _FULL_SCALE else _STATE["moving"]
        digits = f"{abs(shown):0{width}.{_DECIMALS[self._unit]}f}"
        return f"{state},{zero},{'-' if shown < 0 else '+'}{digits} {unit}\r\n".encode("ascii")


def serial_ascii_load_cell(
    signals: Signals, address: str = "pty", unit: str = "kg", rate: int = 10
) -> tuple[SerialAdapter, AsciiLoadCellDevice]:
    """The indicator on its line, not serving yet, and the device itself for what is injected into it.

    Args:
        signals: the rig's force.
        address: ``pty``, or ``host:port`` with port 0 for any free one.
        unit: that it shows.
        rate: readings a second [Hz].
    """
    device = AsciiLoadCellDevice(signals, unit, rate)
    port = SerialPort(address, CONTRACT["line"]["baud"], buffer=1024, batch=0.0)
    return SerialAdapter(port, device, signals.now_ns), device
