"""Load cell: a serial stream of framed samples at up to 1 kHz, tared in the instrument, both readings kept.

``force`` is what the instrument shows after its tare, ``force_raw`` what the cell carries: taring with the damper
mounted takes its preload out of ``force``, and only ``force_raw`` still knows it.

Two threads may use it: one calls `LoadCell.acquire` again and again, another asks (tare, rate). Whoever reads the
line feeds the one stream; samples that come while an answer is awaited are kept for the next `acquire`.
"""

import contextlib
import threading
import time
from typing import Any, Final

from drivers.beat import FORCE
from drivers.channel import Block, Channel, Reading, Stamp
from drivers.errors import BadReply, DriverError, NoReply, OutOfRange
from drivers.instrument import Clock, Health, Tap
from drivers.load_cell_clock import ClockReader
from drivers.load_cell_dialogue import SLICE, Dialogue
from drivers.load_cell_frames import CONTRACT
from drivers.load_cell_stream import Counts, SampleStream
from drivers.serial_line import SerialLine

_STATUS: Final[dict[str, int]] = CONTRACT["status"]
_INSTRUMENT = CONTRACT["instrument"]
_DEADLINES = CONTRACT["deadlines"]


class LoadCell:
    """A load cell on its serial line."""

    def __init__(self, name: str, port: str, clock: Clock, *, rate: int = 1000, baud: int | None = None) -> None:
        """A load cell that is not connected yet.

        Args:
            name: in configuration, logs and messages.
            port: ``/dev/tty*``, ``socket://host:port`` or ``rfc2217://host:port``.
            clock: the bench clock [ns].
            rate: samples a second [Hz], one of those that the instrument offers.
            baud: [bit/s]; that of the contract if none.

        Raises:
            OutOfRange: the instrument does not offer this rate.
        """
        # A tare of up to full scale moves `force` by as much: its range is twice that of the cell.
        full_scale: float = _INSTRUMENT["full_scale_n"]
        self.name: Final = name
        self.channels: Final = (
            Channel(
                "force", "N", -2 * full_scale, 2 * full_scale, "read", "axial force as tared in the instrument"
            ),
            Channel("force_raw", "N", -full_scale, full_scale, "read", "axial force, never tared"),
        )
        self._clock = clock
        self._rate = self._offered(rate)
        baud = baud or int(CONTRACT["line"]["baud"])
        self._line = SerialLine(name, port, baud, clock, _DEADLINES["write_s"])
        self._stream = SampleStream()
        self._clock_reader = ClockReader(self._stream, clock, baud)
        self._before = Counts()
        self._pending: list[Block] = []
        self._newest: dict[str, Block] = {}
        self._reading = threading.RLock()
        self._dialogue = Dialogue(name, self._stream, self._line.write, self._pump)

    def connect(self) -> None:
        """Open the line, check that a load cell of this calibration answers, and start its stream.

        Raises:
            NotConnected: the line cannot be opened.
            NoReply, BadReply, Refused: it opens, but no such load cell answers.
        """
        self._line.open()
        try:
            self.stop()  # another host may have left its stream on, at a rate that drowns every answer
            self._dialogue.identify()
            self._set_rate(self._rate)
            with self._reading:
                self._pending = []
                self._before = self._stream.counts()
            self.start()
        except DriverError:
            self._line.close()
            raise
        self._clock_reader.restart()

    @property
    def stamp(self) -> Stamp | None:
        """Its clock beside the bench's, the newest reading; none before the first."""
        return self._clock_reader.stamp

    def close(self) -> None:
        """Stop the stream and close the line; harmless when repeated or when never connected."""
        if self._line.is_open:
            # A courtesy: on a line that is dead there is nothing to stop.
            with contextlib.suppress(DriverError):
                self.stop()
        # Not while the other thread reads: a descriptor must not vanish under it.
        with self._reading:
            self._line.close()

    def acquire(self, timeout: float) -> list[Block]:
        """Samples that came since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Both channels come in blocks of their own, cut where samples are missing or the quality changes.

        Raises:
            NotConnected: the line has gone, or was never opened.
        """
        deadline = time.monotonic() + timeout
        time.sleep(min(FORCE.wait(self._clock()), self._clock_reader.idle()))
        while True:
            left = deadline - time.monotonic()
            with self._reading, contextlib.suppress(DriverError):  # of a line that has gone, reading tells
                self._clock_reader.attend(self._dialogue.token, self._line.write)
            self._pump(0.0 if self._pending else max(min(left, self._clock_reader.patience() or SLICE), 0.0))
            if self._pending or left <= 0:
                break
        with self._reading:
            taken, self._pending = self._pending, []
        return taken

    def read(self, channel: str) -> Reading:
        """The next sample of a channel; `acquire` still hands it out.

        Raises:
            NoReply: none came in time; the stream may be stopped.
            OutOfRange: there is no such channel.
        """
        self._known(channel)
        seen = self._newest.get(channel)
        deadline = time.monotonic() + _DEADLINES["reply_s"] + 1 / self._rate
        # Another block, not another value: forces may repeat.
        while (block := self._newest.get(channel)) is seen or block is None:
            if time.monotonic() >= deadline:
                raise NoReply(
                    f"{self.name}: no sample of {channel} within {_DEADLINES['reply_s'] + 1 / self._rate:.3g} s; "
                    "check that the stream has been started and the instrument has power"
                )
            self._pump(SLICE)
        device_ns = None if block.device_ns is None else int(block.device_ns[-1])
        return Reading(float(block.values[-1]), block.received_ns, device_ns, float(block.raw[-1]), block.quality)

    def write(self, channel: str, value: float) -> None:
        """Refuse: a load cell takes no values.

        Raises:
            OutOfRange: always.
        """
        self._known(channel)
        raise OutOfRange(f"{self.name}: {channel} is measured, never set to {value:.6g} N; nothing was sent")

    def describe(self) -> dict[str, Any]:
        """What a replay needs beside the frames from now on, see `drivers.replay`."""
        with self._reading:
            return {"decoder": "load_cell", "state": self._stream.state()}

    def make_safe(self) -> None:
        """Nothing: it moves nothing, and what brings the rest to rest still wants its samples."""

    def start(self) -> None:
        """Start the stream.

        Raises:
            NoReply, BadReply, Refused: it did not start, or not at the rate that was set.
        """
        self._rate_agreed("start", self._dialogue.acknowledged("start"))

    def stop(self) -> None:
        """Stop the stream."""
        self._dialogue.acknowledged("stop")

    def tare(self) -> float:
        """Make the present reading the zero of ``force``.

        Returns:
            What is taken off from now on [N]; ``force_raw`` keeps it.

        Raises:
            Refused: the reading is not steady, or out of range.
        """
        return self._dialogue.acknowledged("tare") / float(_INSTRUMENT["counts_per_newton"])

    def clear_tare(self) -> None:
        """Let ``force`` be ``force_raw`` again."""
        self._dialogue.acknowledged("clear_tare")

    def set_rate(self, rate: int) -> None:
        """Change the samples a second [Hz]; a running stream is stopped for it and starts again.

        Raises:
            OutOfRange: the instrument does not offer this rate; nothing was sent.
        """
        self._offered(rate)
        running = self._stream.rate is not None
        if running:
            self.stop()
        self._set_rate(rate)
        if running:
            self.start()

    def health(self) -> Health:
        """Counts since it was connected, and what is wrong in words."""
        counts = self._stream.counts().since(self._before)
        return Health(self._line.is_open, *counts, self._stream.last_ns, self._words())

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of all bytes from now on; a `SampleStream` given those received repeats the blocks."""
        self._line.listen(tap)

    def _words(self) -> str:
        if not self._line.is_open:
            return "not connected"
        if self._stream.rate is None:
            return "stopped"
        found = [name.replace("_", " ") for name in ("overload", "sensor_fault") if self._status() & _STATUS[name]]
        silent = (self._clock() - (self._stream.last_ns or 0)) * 1e-9
        if silent > max(_DEADLINES["silence_s"], 5 / self._stream.rate):
            found.append(f"silent for {silent:.3g} s")
        if self._stream.unchanged >= _DEADLINES["stuck_samples"]:
            found.append(f"stuck: the same reading {self._stream.unchanged + 1} times")
        return "; ".join(found)

    def _status(self) -> int:
        return 0 if self._stream.latest is None else self._stream.latest.status

    def _known(self, channel: str) -> None:
        names = [known.name for known in self.channels]
        if channel not in names:
            raise OutOfRange(f"{self.name}: no channel {channel!r}, only {', '.join(names)}; nothing was sent")

    def _offered(self, rate: int) -> int:
        offered: list[int] = _INSTRUMENT["rates_hz"]
        if rate not in offered:
            raise OutOfRange(f"{self.name}: {rate} Hz is none of the rates {offered} Hz; nothing was sent")
        return rate

    def _set_rate(self, rate: int) -> None:
        self._rate = rate
        self._rate_agreed("set_rate", self._dialogue.acknowledged("set_rate", rate))

    def _rate_agreed(self, command: str, rate: int) -> None:
        if rate != self._rate:
            raise BadReply(f"{self.name}: {command} gave {rate} Hz, not {self._rate} Hz; set it again")

    def _pump(self, timeout: float) -> None:
        """Read once, or wait as long for the other thread that is reading."""
        if not self._reading.acquire(timeout=timeout):
            return
        try:
            frame = self._line.read(timeout)
            if frame is not None:
                blocks = self._stream.feed(frame.received_ns, frame.data)
                self._pending += blocks
                self._newest.update((block.channel, block) for block in blocks)
        finally:
            self._reading.release()
