"""Load cell with a serial stream of framed samples at up to 1 kHz, tared in the instrument.

``force`` is the reading after the instrument's tare, ``force_raw`` the force on the cell. Taring with the damper
mounted removes its preload from ``force``; only ``force_raw`` still contains it.

Two threads may use a load cell: one calls `LoadCell.acquire` repeatedly, another sends requests (tare, rate).
Whichever thread reads the line feeds the one decoder. Samples that arrive during a request are kept for the next
`acquire`.
"""

import contextlib
import time
from typing import ClassVar, Final

from drivers.channel import Channel, ClockReading, Reading, SampleBlock
from drivers.errors import DriverError, InvalidReplyError, NoReplyError, OutOfRangeError
from drivers.instrument import Clock
from drivers.load_cell.clock_reader import ClockReader
from drivers.load_cell.commands import WAIT_SLICE, CommandChannel
from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.frames import CONTRACT
from drivers.load_cell.serial_load_cell import SerialLoadCell
from drivers.polling import LOAD_CELL_SCHEDULE
from drivers.transport import SerialLine

_STATUS: Final[dict[str, int]] = CONTRACT["status"]
_INSTRUMENT = CONTRACT["instrument"]
_DEADLINES = CONTRACT["deadlines"]


class LoadCell(SerialLoadCell[LoadCellDecoder]):
    """A load cell on its serial line."""

    decoder_name: ClassVar[str] = "load_cell"

    def __init__(self, name: str, port: str, clock: Clock, *, rate: int = 1000, baud: int | None = None) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: used in configuration, logs and messages.
            port: ``/dev/tty*``, ``socket://host:port`` or ``rfc2217://host:port``.
            clock: bench clock [ns].
            rate: sample rate [Hz], one of those that the instrument offers.
            baud: [bit/s]; by default that of the wire file.

        Raises:
            OutOfRangeError: the instrument does not offer this rate.
        """
        # A tare of up to full scale shifts `force` by as much: its range is twice that of the cell.
        full_scale: float = _INSTRUMENT["full_scale_n"]
        channels = (
            Channel(
                "force", "N", -2 * full_scale, 2 * full_scale, "read", "axial force as tared in the instrument"
            ),
            Channel("force_raw", "N", -full_scale, full_scale, "read", "axial force, never tared"),
        )
        baud = baud or int(CONTRACT["line"]["baud"])
        line = SerialLine(name, port, baud, clock, _DEADLINES["write_s"])
        super().__init__(name, channels, line, clock, LoadCellDecoder())
        self._rate = self._check_rate(rate)
        self._clock_reader = ClockReader(self._decoder, clock, baud)
        self._serial: int | None = None
        self._latest_blocks: dict[str, SampleBlock] = {}
        self._commands = CommandChannel(name, self._decoder, line.write, self._read_once)

    def connect(self) -> None:
        """Open the line, check that a load cell of this calibration replies, and start its stream.

        Raises:
            NotConnectedError: the line cannot be opened.
            NoReplyError, InvalidReplyError, RefusedError: no such load cell replies.
        """
        self._line.open()
        try:
            self._begin_stream()
        except DriverError:
            self._line.close()
            raise
        self._clock_reader.restart()

    def _begin_stream(self) -> None:
        self.stop()  # another host may have left the stream on, at a rate that drowns every reply
        self._serial = self._commands.identify()
        self._set_rate(self._rate)
        with self._read_lock:
            self._pending = []
            self._initial_statistics = self._decoder.get_statistics()
        self.start()

    @property
    def clock_reading(self) -> ClockReading | None:
        """Latest reading of the load cell's clock; None before the first."""
        return self._clock_reader.clock_reading

    @property
    def serial(self) -> int | None:
        """Serial number that the instrument reported at `connect`; None before."""
        return self._serial

    def close(self) -> None:
        """Stop the stream and close the line. May be repeated, and called without `connect`."""
        if self._line.is_open:
            # On a dead line there is no stream to stop.
            with contextlib.suppress(DriverError):
                self.stop()
        # The lock keeps the descriptor from vanishing while the other thread reads.
        with self._read_lock:
            self._line.close()

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return the samples since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Each channel has its own blocks, split where samples are missing or the quality changes.

        Raises:
            NotConnectedError: the line is gone, or was never opened.
        """
        deadline = time.monotonic() + timeout
        time.sleep(min(LOAD_CELL_SCHEDULE.compute_wait(self._clock()), self._clock_reader.compute_idle_time()))
        while True:
            remaining = deadline - time.monotonic()
            with self._read_lock, contextlib.suppress(DriverError):  # if the line is gone, reading raises
                self._clock_reader.poll(self._commands.make_token, self._line.write)
            wait = min(remaining, self._clock_reader.compute_wait() or WAIT_SLICE)
            self._read_once(0.0 if self._pending else max(wait, 0.0))
            if self._pending or remaining <= 0:
                break
        return self._pop_pending()

    def read(self, channel: str) -> Reading:
        """Return the next sample of a channel. `acquire` still returns it, too.

        Raises:
            NoReplyError: no sample arrived in time; the stream may be stopped.
            OutOfRangeError: there is no such channel.
        """
        self._check_channel(channel)
        block = self._wait_for_block(channel)
        device_ns = None if block.device_ns is None else int(block.device_ns[-1])
        return Reading(float(block.values[-1]), block.received_ns, device_ns, float(block.raw[-1]), block.quality)

    def _wait_for_block(self, channel: str) -> SampleBlock:
        previous = self._latest_blocks.get(channel)
        deadline = time.monotonic() + _DEADLINES["reply_s"] + 1 / self._rate
        # Compare blocks, not values: forces may repeat.
        while (block := self._latest_blocks.get(channel)) is previous or block is None:
            if time.monotonic() >= deadline:
                raise NoReplyError(
                    f"{self.name}: no sample of {channel} within {_DEADLINES['reply_s'] + 1 / self._rate:.3g} s; "
                    "check that the stream has been started and the instrument has power"
                )
            self._read_once(WAIT_SLICE)
        return block

    def start(self) -> None:
        """Start the stream.

        Raises:
            NoReplyError, InvalidReplyError, RefusedError: it did not start, or at another rate than was set.
        """
        self._confirm_rate("start", self._commands.execute("start"))

    def stop(self) -> None:
        """Stop the stream."""
        self._commands.execute("stop")

    def tare(self) -> float:
        """Make the present reading the zero of ``force``.

        Returns:
            Force [N] that is subtracted from now on; ``force_raw`` keeps it.

        Raises:
            RefusedError: the reading is not steady, or out of range.
        """
        return self._commands.execute("tare") / float(_INSTRUMENT["counts_per_newton"])

    def clear_tare(self) -> None:
        """Make ``force`` equal to ``force_raw`` again."""
        self._commands.execute("clear_tare")

    @property
    def longest_shunt(self) -> float:
        """Longest time for which the shunt can be switched on [s]."""
        return float(_INSTRUMENT["longest_shunt_s"])

    def switch_shunt_on(self, duration: float) -> float | None:
        """Switch the shunt on; it switches itself off after a time. A repetition restarts the time.

        Args:
            duration: time for which it is on [s].

        Returns:
            Force [N] that it adds to both channels by the instrument's calibration; None if not known.

        Raises:
            OutOfRangeError: the instrument does not allow this time; nothing was sent.
            RefusedError: the load cell has no shunt that a command can switch.
        """
        milliseconds = round(duration * 1e3)
        if not 1 <= milliseconds <= self.longest_shunt * 1e3:
            raise OutOfRangeError(
                f"{self.name}: the shunt cannot be on for {duration:g} s, only for 0.001 s to "
                f"{self.longest_shunt:g} s; nothing was sent"
            )
        return self._switch_shunt(milliseconds)

    def switch_shunt_off(self) -> float | None:
        """Switch the shunt off, on or not; result and errors are those of `switch_shunt_on`."""
        return self._switch_shunt(0)

    def _switch_shunt(self, milliseconds: int) -> float | None:
        counts = self._commands.execute("shunt", milliseconds)
        return counts / float(_INSTRUMENT["counts_per_newton"]) if counts else None

    def set_rate(self, rate: int) -> None:
        """Change the sample rate [Hz]; a running stream is stopped and restarted.

        Raises:
            OutOfRangeError: the instrument does not offer this rate; nothing was sent.
        """
        self._check_rate(rate)
        is_running = self._decoder.rate is not None
        if is_running:
            self.stop()
        self._set_rate(rate)
        if is_running:
            self.start()

    def _find_problems(self) -> list[str]:
        decoder = self._decoder
        if decoder.rate is None:
            return ["stopped"]
        status = 0 if decoder.latest is None else decoder.latest.status
        problems = [name.replace("_", " ") for name in ("overload", "sensor_fault") if status & _STATUS[name]]
        if status & _STATUS["shunt"]:
            problems.append("the shunt is on, so the force contains the one that it simulates")
        problems += self._find_silence(max(_DEADLINES["silence_s"], 5 / decoder.rate))
        if decoder.repeat_count >= _DEADLINES["stuck_samples"]:
            problems.append(f"stuck: the same reading {decoder.repeat_count + 1} times")
        return problems

    def _check_rate(self, rate: int) -> int:
        offered: list[int] = _INSTRUMENT["rates_hz"]
        if rate not in offered:
            raise OutOfRangeError(f"{self.name}: {rate} Hz is not one of the rates {offered} Hz; nothing was sent")
        return rate

    def _set_rate(self, rate: int) -> None:
        self._rate = rate
        self._confirm_rate("set_rate", self._commands.execute("set_rate", rate))

    def _confirm_rate(self, command: str, rate: int) -> None:
        if rate != self._rate:
            raise InvalidReplyError(f"{self.name}: {command} gave {rate} Hz, not {self._rate} Hz; set it again")

    def _read_once(self, timeout: float) -> None:
        """Read once, or wait as long [s] for another thread that is reading."""
        if not self._read_lock.acquire(timeout=timeout):
            return
        try:
            frame = self._line.read(timeout)
            if frame is not None:
                blocks = self._decoder.feed(frame.received_ns, frame.data)
                self._pending += blocks
                self._latest_blocks.update((block.channel, block) for block in blocks)
        finally:
            self._read_lock.release()
