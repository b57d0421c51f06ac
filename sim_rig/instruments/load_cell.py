"""Simulated load cell amplifier on a serial line, after ``drivers/wire/load_cell.toml``.

It converts samples of the rig's force to counts and stamps them with its own clock. It tares on command and
refuses to tare while the reading moves. Its shunt adds a force to that of the rig, before filter and gain.
"""

import math
import struct
from collections import deque
from typing import Any

from sim_rig.instruments.wire_files import load_wire_file
from sim_rig.live import TRUE_CLOCK, DeviceClock, RigInterface
from sim_rig.protocols import SerialAdapter, SerialPort

CONTRACT: dict[str, Any] = load_wire_file("load_cell")

_INSTRUMENT, _STATUS = CONTRACT["instrument"], CONTRACT["status"]
_COMMANDS = {code: name for name, code in CONTRACT["commands"].items()}
_CODES, _FRAMES = CONTRACT["codes"], CONTRACT["frames"]
_FULL_SCALE: float = _INSTRUMENT["full_scale_n"]
_COUNTS_PER_NEWTON: int = _INSTRUMENT["counts_per_newton"]
_MIN_POLL = 0.002
"""[s] Shortest interval of polls."""
_HEADER = bytes(CONTRACT["framing"]["sync"])


def _make_crc_table(polynomial: int) -> list[int]:
    table = []
    for byte in range(256):
        remainder = byte << 8
        for _ in range(8):
            remainder = (remainder << 1) ^ (polynomial if remainder & 0x8000 else 0)
        table.append(remainder & 0xFFFF)
    return table


_CRC_TABLE = _make_crc_table(CONTRACT["checksum"]["polynomial"])


def compute_checksum(data: bytes) -> int:
    """Return the CRC-16 of the contract."""
    remainder: int = CONTRACT["checksum"]["start"]
    for byte in data:
        remainder = (remainder << 8 & 0xFFFF) ^ _CRC_TABLE[remainder >> 8 ^ byte]
    return remainder


def _make_layout(kind: str) -> struct.Struct:
    letters = {"u8": "B", "u16": "H", "u32": "I", "i32": "i"}
    return struct.Struct("<" + "".join(letters[field["format"]] for field in _FRAMES[kind]["fields"]))


_LAYOUTS = {kind: _make_layout(kind) for kind in _FRAMES}
_REQUEST = _LAYOUTS["request"]


def encode_frame(kind: str, *fields: int) -> bytes:
    """Return one frame of a kind that the contract names."""
    payload = _LAYOUTS[kind].pack(*fields)
    covered = bytes([len(payload), _FRAMES[kind]["type"]]) + payload
    return _HEADER + covered + struct.pack("<H", compute_checksum(covered))


class _RecentCounts:
    """Counts of the latest samples, with their spread; samples older than a window are discarded."""

    def __init__(self, window_ns: int) -> None:
        self._window_ns = window_ns
        self._samples: deque[tuple[int, int]] = deque()
        # Candidates for the lowest and the highest: each is more extreme than all later ones. Otherwise every
        # sample would need a search of the whole window.
        self._lows: deque[tuple[int, int]] = deque()
        self._highs: deque[tuple[int, int]] = deque()

    def add(self, at_ns: int, counts: int) -> None:
        """Add a sample, and discard those that are too old by then."""
        self._samples.append((at_ns, counts))
        while self._lows and self._lows[-1][1] >= counts:
            self._lows.pop()
        while self._highs and self._highs[-1][1] <= counts:
            self._highs.pop()
        self._lows.append((at_ns, counts))
        self._highs.append((at_ns, counts))
        for samples in (self._samples, self._lows, self._highs):
            while samples[0][0] < at_ns - self._window_ns:
                samples.popleft()

    def compute_span(self) -> int:
        """Return the time between the oldest and the newest sample [ns]."""
        return self._samples[-1][0] - self._samples[0][0] if self._samples else 0

    def compute_spread(self) -> int:
        """Return the difference of the highest and the lowest counts."""
        return self._highs[0][1] - self._lows[0][1]

    def compute_mean(self) -> float:
        """Return the mean of the counts."""
        return sum(counts for _, counts in self._samples) / len(self._samples)


class LoadCellDevice:
    """Behaviour of the instrument, without its line; faults may be injected from any thread."""

    def __init__(
        self, signals: RigInterface, clock: DeviceClock = TRUE_CLOCK, serial: int = 1, shunt: float = 0.0
    ) -> None:
        """Switch the instrument on: not streaming, untared, at its highest rate, with its shunt off.

        Args:
            signals: the rig's force.
            clock: the instrument's clock.
            serial: its serial number.
            shunt: force [N] that its shunt simulates; 0 if it has none.
        """
        self.stuck = False
        """While true, the converter repeats its last counts."""
        self.bridge_open = False
        """While true, the bridge is open, which the status reports."""
        self._signals = signals
        self._clock = clock
        self._serial = serial
        self._received = b""
        self._rate: int = max(_INSTRUMENT["rates_hz"])
        self._running = False
        self._sequence = 0
        self._tare: int | None = None
        self._shunt, self._shunt_end_ns = shunt, 0
        self._counts = 0
        self._last_sample_ns = signals.now_ns()
        self._tick = 0
        self._recent_counts = _RecentCounts(round(_INSTRUMENT["tare_time_s"] * 1e9))

    def skip_samples(self, samples: int) -> None:
        """Advance the sequence number, as if samples had been lost inside the instrument."""
        self._sequence = (self._sequence + samples) % 65536

    def receive(self, data: bytes, now_ns: int) -> list[bytes]:
        """Return the replies to the requests that ``data`` completes; invalid requests get no reply."""
        self._received += data
        kind = bytes([_REQUEST.size, _FRAMES["request"]["type"]])
        size = CONTRACT["framing"]["overhead"] + _REQUEST.size
        replies = []
        while (start := self._received.find(_HEADER)) >= 0 and len(self._received) >= start + size:
            frame = self._received[start : start + size]
            valid = frame[2:4] == kind and compute_checksum(frame[2:-2]).to_bytes(2, "little") == frame[-2:]
            self._received = self._received[start + (size if valid else 1) :]
            if valid:
                token, command, argument = _REQUEST.unpack(frame[4:-2])
                replies.append(self._make_reply(token, command, argument, now_ns))
        # Only what may be part of a request is kept, so that noise does not accumulate.
        self._received = self._received[-size:]
        return replies

    def poll(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Return frames of the new samples up to ``now_ns`` [ns], each with its time on the rig's clock [ns]."""
        if self._shunt_end_ns and now_ns >= self._shunt_end_ns:
            self._set_shunt(0, now_ns)
        # Twice the expected number: repeated samples are skipped below, but missed ones would be lost.
        window = int((now_ns - self._last_sample_ns) * 1e-9 * 2 * max(_INSTRUMENT["rates_hz"])) + 2
        times, values = self._signals.read_latest("force", window, now_ns)
        frames = []
        for at_ns, newtons in zip(times.tolist(), values.tolist(), strict=True):
            if at_ns > self._last_sample_ns:
                frames += [(at_ns, frame) for frame in self._make_frames(at_ns, newtons)]
                self._last_sample_ns = at_ns
        return frames

    def _make_frames(self, at_ns: int, newtons: float) -> list[bytes]:
        status = self._convert(newtons)
        self._recent_counts.add(at_ns, self._counts)
        # The offset of a quarter keeps the rig's sample instants away from the rounding edges.
        tick = round(at_ns * self._rate * 1e-9 - 0.25)
        due, self._tick = tick != self._tick, tick
        if not (self._running and due):
            return []
        status |= _STATUS["tared"] * (self._tare is not None) | _STATUS["stable"] * self._is_stable()
        status |= _STATUS["shunt"] * (self._shunt_end_ns > 0)
        micros = self._clock.read_ns(at_ns) // 1000 % (1 << 32)
        frame = encode_frame("sample", self._sequence, micros, self._counts, self._tare or 0, status)
        self._sequence = (self._sequence + 1) % 65536
        return [frame]

    def _convert(self, newtons: float) -> int:
        """Convert the reading to counts; return the status bits that it causes."""
        fault = _STATUS["sensor_fault"] * (self.bridge_open or not math.isfinite(newtons))
        if not (fault or self.stuck):
            self._counts = round(min(max(newtons, -_FULL_SCALE), _FULL_SCALE) * _COUNTS_PER_NEWTON)
        return int(fault | _STATUS["overload"] * (abs(self._counts) >= _FULL_SCALE * _COUNTS_PER_NEWTON))

    def _is_stable(self) -> bool:
        is_full = self._recent_counts.compute_span() >= 0.9e9 * _INSTRUMENT["tare_time_s"]
        band = _INSTRUMENT["tare_band_n"] * _COUNTS_PER_NEWTON
        return bool(is_full and self._recent_counts.compute_spread() <= band)

    def _make_reply(self, token: int, command: int, argument: int, now_ns: int) -> bytes:
        name = _COMMANDS.get(command)
        if name == "identify":
            return encode_frame(
                "identity", token, command, _INSTRUMENT["protocol"], self._serial, _COUNTS_PER_NEWTON
            )
        code, value = self._execute(name, argument, now_ns)
        return encode_frame("acknowledgement", token, command, _CODES[code], value)

    def _execute(self, name: str | None, argument: int, now_ns: int) -> tuple[str, int]:
        """Execute a command; return code and value of the reply."""
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
        if name == "read_clock":
            return "done", self._read_clock(now_ns)
        if name == "shunt" and self._shunt:
            return self._set_shunt(argument, now_ns)
        return "unknown_command", 0

    def _read_clock(self, now_ns: int) -> int:
        """Return all 32 bits of its clock [us], as the signed number of the reply."""
        micros = self._clock.read_ns(now_ns) // 1000 % (1 << 32)
        return micros - (1 << 32) if micros >= 1 << 31 else micros

    def _set_rate(self, rate: int) -> tuple[str, int]:
        if self._running:
            return "not_now", self._rate
        if rate not in _INSTRUMENT["rates_hz"]:
            return "bad_argument", self._rate
        self._rate = rate
        return "done", rate

    def _set_tare(self, tared: bool) -> tuple[str, int]:
        overloaded = abs(self._counts) >= _FULL_SCALE * _COUNTS_PER_NEWTON
        if tared and (overloaded or self.bridge_open or not self._is_stable()):
            return "not_now", 0
        self._tare = round(self._recent_counts.compute_mean()) if tared else None
        return "done", self._tare or 0

    def _set_shunt(self, milliseconds: int, now_ns: int) -> tuple[str, int]:
        if milliseconds > _INSTRUMENT["longest_shunt_s"] * 1000:
            return "bad_argument", 0
        self._shunt_end_ns = now_ns + milliseconds * 1_000_000 if milliseconds else 0
        self._signals.command("shunt", self._shunt if milliseconds else 0.0)
        return "done", round(self._shunt * _COUNTS_PER_NEWTON)


def make_load_cell(
    signals: RigInterface,
    address: str = "pty",
    clock: DeviceClock = TRUE_CLOCK,
    batch: float = 0.004,
    shunt: float = 0.0,
) -> tuple[SerialAdapter, LoadCellDevice]:
    """Return the instrument on its line, not serving yet, and the device for the injection of faults.

    Args:
        signals: the rig's force.
        address: ``pty``, or ``host:port`` with port 0 for any free one.
        clock: the instrument's clock.
        batch: [s] for which its USB adapter collects bytes.
        shunt: force [N] that its shunt simulates; 0 if it has none.
    """
    device = LoadCellDevice(signals, clock, shunt=shunt)
    port = SerialPort(address, CONTRACT["line"]["baud"], _INSTRUMENT["transmit_buffer_bytes"], batch)
    # Between two batches nothing reaches the host, so the device is polled once for each.
    return SerialAdapter(port, device, signals.now_ns, max(batch, _MIN_POLL)), device
