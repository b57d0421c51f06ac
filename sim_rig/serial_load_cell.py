"""The load cell amplifier on its serial line: ``drivers/wire/load_cell.toml``, from the instrument's side.

Samples of the rig's force become counts of the instrument's converter, stamped with its own clock. It tares by
itself and refuses to while the reading moves.
"""

import math
import struct
import tomllib
from collections import deque
from pathlib import Path
from typing import Any

from sim_rig.device_clock import TRUE_CLOCK, DeviceClock
from sim_rig.serial_adapter import SerialAdapter
from sim_rig.serial_port import SerialPort
from sim_rig.signals import Signals

CONTRACT: dict[str, Any] = tomllib.loads(
    (Path(__file__).parents[1] / "drivers" / "wire" / "load_cell.toml").read_text("utf-8")
)
"""The wire contract; the only thing that this file and the driver have in common."""

_INSTRUMENT, _STATUS = CONTRACT["instrument"], CONTRACT["status"]
_COMMANDS = {code: name for name, code in CONTRACT["commands"].items()}
_CODES, _FRAMES = CONTRACT["codes"], CONTRACT["frames"]
_FULL_SCALE: float = _INSTRUMENT["full_scale_n"]
_COUNTS: int = _INSTRUMENT["counts_per_newton"]
_HEADER = bytes(CONTRACT["framing"]["sync"])


def _crc_table(polynomial: int) -> list[int]:
    table = []
    for byte in range(256):
        remainder = byte << 8
        for _ in range(8):
            remainder = (remainder << 1) ^ (polynomial if remainder & 0x8000 else 0)
        table.append(remainder & 0xFFFF)
    return table


_TABLE = _crc_table(CONTRACT["checksum"]["polynomial"])


def checksum(data: bytes) -> int:
    """CRC-16 of the contract, byte by byte."""
    remainder: int = CONTRACT["checksum"]["start"]
    for byte in data:
        remainder = (remainder << 8 & 0xFFFF) ^ _TABLE[remainder >> 8 ^ byte]
    return remainder


def _layout(kind: str) -> struct.Struct:
    letters = {"u8": "B", "u16": "H", "u32": "I", "i32": "i"}
    return struct.Struct("<" + "".join(letters[field["format"]] for field in _FRAMES[kind]["fields"]))


_LAYOUTS = {kind: _layout(kind) for kind in _FRAMES}
_REQUEST = _LAYOUTS["request"]


def framed(kind: str, *fields: int) -> bytes:
    """One frame of a kind that the contract names."""
    payload = _LAYOUTS[kind].pack(*fields)
    covered = bytes([len(payload), _FRAMES[kind]["type"]]) + payload
    return _HEADER + covered + struct.pack("<H", checksum(covered))


class LoadCellDevice:
    """What the instrument does, without its line; injected faults may be set from any thread."""

    def __init__(self, signals: Signals, clock: DeviceClock = TRUE_CLOCK, serial: int = 1) -> None:
        """An instrument that has just been switched on: silent, untared, at its highest rate.

        Args:
            signals: the rig's force.
            clock: its own clock.
            serial: its serial number.
        """
        self.stuck = False
        """While true, the converter repeats its last counts."""
        self.broken = False
        """While true, the bridge is open: the status says so."""
        self._signals = signals
        self._clock = clock
        self._serial = serial
        self._heard = b""
        self._rate: int = max(_INSTRUMENT["rates_hz"])
        self._running = False
        self._sequence = 0
        self._tare: int | None = None
        self._counts = 0
        self._seen_ns = signals.now_ns()
        self._tick = 0
        self._recent: deque[tuple[int, int]] = deque()

    def jump(self, samples: int) -> None:
        """Let the sequence jump by so many, as if they had been lost inside the instrument."""
        self._sequence = (self._sequence + samples) % 65536

    def hear(self, data: bytes, now_ns: int) -> list[bytes]:
        """Answers to the requests that are complete with ``data``; what is no good request is left unanswered."""
        self._heard += data
        kind = bytes([_REQUEST.size, _FRAMES["request"]["type"]])
        size = CONTRACT["framing"]["overhead"] + _REQUEST.size
        answers = []
        while (start := self._heard.find(_HEADER)) >= 0 and len(self._heard) >= start + size:
            frame = self._heard[start : start + size]
            good = frame[2:4] == kind and checksum(frame[2:-2]).to_bytes(2, "little") == frame[-2:]
            self._heard = self._heard[start + (size if good else 1) :]
            if good:
                token, command, argument = _REQUEST.unpack(frame[4:-2])
                answers.append(self._answer(token, command, argument, now_ns))
        # What may be part of a request, and no more: noise must not pile up.
        self._heard = self._heard[-size:]
        return answers

    def speak(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Frames of the samples up to ``now_ns`` [ns] that are new, each with its time on the rig's clock [ns]."""
        # Twice what can have come: what is asked for too often is passed over below, what is not is lost.
        window = int((now_ns - self._seen_ns) * 1e-9 * 2 * max(_INSTRUMENT["rates_hz"])) + 2
        times, values = self._signals.latest("force", window, now_ns)
        frames = []
        for at_ns, newtons in zip(times.tolist(), values.tolist(), strict=True):
            if at_ns > self._seen_ns:
                frames += [(at_ns, frame) for frame in self._sampled(at_ns, newtons)]
                self._seen_ns = at_ns
        return frames

    def _sampled(self, at_ns: int, newtons: float) -> list[bytes]:
        status = self._converted(newtons)
        self._recent.append((at_ns, self._counts))
        while self._recent[0][0] < at_ns - _INSTRUMENT["tare_time_s"] * 1e9:
            self._recent.popleft()
        # A quarter off: no instant of the rig's samples lies where rounding could turn either way.
        tick = round(at_ns * self._rate * 1e-9 - 0.25)
        due, self._tick = tick != self._tick, tick
        if not (self._running and due):
            return []
        status |= _STATUS["tared"] * (self._tare is not None) | _STATUS["stable"] * self._stable()
        micros = self._clock.ns(at_ns) // 1000 % (1 << 32)
        frame = framed("sample", self._sequence, micros, self._counts, self._tare or 0, status)
        self._sequence = (self._sequence + 1) % 65536
        return [frame]

    def _converted(self, newtons: float) -> int:
        """Take the reading into the converter's counts; the status bits that it causes."""
        fault = _STATUS["sensor_fault"] * (self.broken or not math.isfinite(newtons))
        if not (fault or self.stuck):
            self._counts = round(min(max(newtons, -_FULL_SCALE), _FULL_SCALE) * _COUNTS)
        return int(fault | _STATUS["overload"] * (abs(self._counts) >= _FULL_SCALE * _COUNTS))

    def _stable(self) -> bool:
        counts = [counts for _, counts in self._recent]
        full = bool(counts) and self._recent[-1][0] - self._recent[0][0] >= 0.9e9 * _INSTRUMENT["tare_time_s"]
        return full and max(counts) - min(counts) <= _INSTRUMENT["tare_band_n"] * _COUNTS

    def _answer(self, token: int, command: int, argument: int, now_ns: int) -> bytes:
        name = _COMMANDS.get(command)
        if name == "identify":
            return framed("identity", token, command, _INSTRUMENT["protocol"], self._serial, _COUNTS)
        code, value = self._done(name, argument) if name != "read_clock" else ("done", self._micros(now_ns))
        return framed("acknowledgement", token, command, _CODES[code], value)

    def _done(self, name: str | None, argument: int) -> tuple[str, int]:
        """Carry a command out; code and value of the answer."""
        if name == "start":
            self._running, self._sequence = True, 0
            return "done", self._rate
        if name == "stop":
            self._running = False
            return "done", 0
        if name == "set_rate":
            return self._set_rate(argument)
        if name in ("tare", "clear_tare"):
            return self._set_tare(name == "tare")
        return "unknown_command", 0

    def _micros(self, now_ns: int) -> int:
        """All 32 bits of its clock [us], as the signed number that the answer has room for."""
        micros = self._clock.ns(now_ns) // 1000 % (1 << 32)
        return micros - (1 << 32) if micros >= 1 << 31 else micros

    def _set_rate(self, rate: int) -> tuple[str, int]:
        if self._running:
            return "not_now", self._rate
        if rate not in _INSTRUMENT["rates_hz"]:
            return "bad_argument", self._rate
        self._rate = rate
        return "done", rate

    def _set_tare(self, wanted: bool) -> tuple[str, int]:
        overloaded = abs(self._counts) >= _FULL_SCALE * _COUNTS
        if wanted and (overloaded or self.broken or not self._stable()):
            return "not_now", 0
        counts = [counts for _, counts in self._recent]
        self._tare = round(sum(counts) / len(counts)) if wanted else None
        return "done", self._tare or 0


def serial_load_cell(
    signals: Signals, address: str = "pty", clock: DeviceClock = TRUE_CLOCK, batch: float = 0.004
) -> tuple[SerialAdapter, LoadCellDevice]:
    """The instrument on its line, not serving yet, and the device itself for what is injected into it.

    Args:
        signals: the rig's force.
        address: ``pty``, or ``host:port`` with port 0 for any free one.
        clock: its own clock.
        batch: [s] that its USB adapter collects bytes.
    """
    device = LoadCellDevice(signals, clock)
    port = SerialPort(address, CONTRACT["line"]["baud"], _INSTRUMENT["transmit_buffer_bytes"], batch)
    return SerialAdapter(port, device, signals.now_ns), device
