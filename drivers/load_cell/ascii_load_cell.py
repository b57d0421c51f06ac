"""Load cell on a plain weighing indicator: one line of text per reading, such as ``ST,GS,+0012.34 kg``.

The protocol has no checksum, no sequence and no clock. The decoder checks the format of the line, the range, and
agreement with an earlier reading. The quality of every reading is therefore ``uncertain``. Times are those of the
bench when the line ended.
"""

import time
from typing import ClassVar, NoReturn

from drivers.channel import Channel, Reading, SampleBlock
from drivers.errors import NoReplyError, RefusedError
from drivers.instrument import Clock
from drivers.load_cell.ascii_decoder import CONTRACT, FULL_SCALE, AsciiLoadCellDecoder
from drivers.load_cell.serial_load_cell import SerialLoadCell
from drivers.transport import SerialLine

_LIMITS = CONTRACT["limits"]


class AsciiLoadCell(SerialLoadCell[AsciiLoadCellDecoder]):
    """A weighing indicator that sends its readings without requests."""

    decoder_name: ClassVar[str] = "ascii_load_cell"

    def __init__(
        self,
        name: str,
        port: str,
        clock: Clock,
        *,
        baud: int | None = None,
        max_step: float = _LIMITS["max_step_n"],
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: used in configuration, logs and messages.
            port: ``/dev/tty*``, ``socket://host:port`` or ``rfc2217://host:port``.
            clock: bench clock [ns].
            baud: [bit/s]; by default that of the wire file.
            max_step: largest step between readings that is accepted at once [N].
        """
        channels = (
            Channel("force", "N", -FULL_SCALE, FULL_SCALE, "read", "axial force as the indicator shows it"),
            Channel("force_raw", "N", -FULL_SCALE, FULL_SCALE, "read", "axial force while it shows gross"),
        )
        line = SerialLine(name, port, baud or CONTRACT["line"]["baud"], clock)
        super().__init__(name, channels, line, clock, AsciiLoadCellDecoder(max_step))

    def connect(self) -> None:
        """Open the line and wait for two readings that agree.

        Raises:
            NotConnectedError: the line cannot be opened.
            NoReplyError: no reading arrived in time.
        """
        self._line.open()
        self._pending, self._initial_statistics = [], self._decoder.get_statistics()
        if not self._wait_for_readings(2 * _LIMITS["silence_s"]):
            refused = self._decoder.corrupted - self._initial_statistics.corrupted
            self._line.close()
            raise NoReplyError(
                f"{self.name}: no reading within {2 * _LIMITS['silence_s']:.3g} s, {refused} lines refused; "
                "check that the indicator sends continuously, its line format and its baud rate"
            )

    def close(self) -> None:
        """Close the line. May be repeated, and called without `connect`."""
        self._line.close()

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return the readings since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Raises:
            NotConnectedError: the line is gone, or was never opened.
        """
        with self._read_lock:
            self._wait_for_readings(timeout)
            return self._pop_pending()

    def read(self, channel: str) -> Reading:
        """Return the next reading of a channel. `acquire` still returns it, too.

        Raises:
            NoReplyError: no reading arrived in time.
            OutOfRangeError: there is no such channel.
        """
        self._check_channel(channel)
        block = self._wait_for_block(channel)
        if block is None:
            raise NoReplyError(
                f"{self.name}: no reading of {channel} within {_LIMITS['silence_s']:.3g} s; check that the "
                "indicator sends, and shows gross if the untared force is requested"
            )
        return Reading(float(block.values[-1]), block.received_ns, None, float(block.raw[-1]), block.quality)

    @property
    def longest_shunt(self) -> float:
        """Longest time for which the shunt can be switched on [s]: none."""
        return 0.0

    def switch_shunt_on(self, duration: float) -> NoReturn:
        """Refuse: an indicator has no commands.

        Raises:
            RefusedError: always.
        """
        self.switch_shunt_off()

    def switch_shunt_off(self) -> NoReturn:
        """Refuse, as `switch_shunt_on` does."""
        raise RefusedError(
            f"{self.name}: a weighing indicator has no shunt that a command can switch; nothing was sent; "
            "use a load cell with driver load_cell"
        )

    def _wait_for_block(self, channel: str) -> SampleBlock | None:
        """Return the first new reading of a channel; None if it does not arrive in time."""
        with self._read_lock:
            # Set aside: only a reading from now on counts, and `acquire` needs all of them in their order.
            earlier = self._pop_pending()
            try:
                self._wait_for_readings(_LIMITS["silence_s"])
                return next((block for block in self._pending if block.channel == channel), None)
            finally:
                self._pending = earlier + self._pending

    def _find_problems(self) -> list[str]:
        return ["overload"] if self._decoder.overload else self._find_silence(_LIMITS["silence_s"])

    def _wait_for_readings(self, timeout: float) -> bool:
        """Read until there are blocks, or ``timeout`` [s] is over."""
        deadline = time.monotonic() + timeout
        while True:
            remaining = deadline - time.monotonic()
            frame = self._line.read(0.0 if self._pending else max(remaining, 0.0))
            if frame is not None:
                self._pending += self._decoder.feed(frame.received_ns, frame.data)
            if self._pending or remaining <= 0:
                return bool(self._pending)
