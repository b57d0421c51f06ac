"""Base class of both load cells: a serial line, two force channels and no values to write."""

import threading
from abc import ABC, abstractmethod
from typing import Any, ClassVar, Final, Generic, TypeVar

from drivers.channel import Channel, SampleBlock
from drivers.errors import OutOfRangeError
from drivers.instrument import Clock, FrameListener, Health
from drivers.load_cell.stream_decoder import StreamDecoder, StreamStatistics
from drivers.transport import SerialLine

_Decoder = TypeVar("_Decoder", bound=StreamDecoder)


class SerialLoadCell(ABC, Generic[_Decoder]):
    """A load cell whose samples a decoder reads from a serial line."""

    decoder_name: ClassVar[str]
    """Name of the decoder in the log, see `drivers.replay`."""

    def __init__(
        self, name: str, channels: tuple[Channel, ...], line: SerialLine, clock: Clock, decoder: _Decoder
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: used in configuration, logs and messages.
            channels: force with the instrument's tare, and force without it.
            line: serial line to the instrument.
            clock: bench clock [ns].
            decoder: decoder of the received bytes.
        """
        self.name: Final = name
        self.channels: Final = channels
        self._line, self._clock, self._decoder = line, clock, decoder
        self._initial_statistics = StreamStatistics()
        self._pending: list[SampleBlock] = []
        self._read_lock = threading.RLock()

    def write(self, channel: str, value: float) -> None:
        """Refuse: a load cell has no writable channel.

        Raises:
            OutOfRangeError: always.
        """
        self._check_channel(channel)
        raise OutOfRangeError(
            f"{self.name}: {channel} is measured and cannot be set to {value:.6g} N; nothing was sent"
        )

    def make_safe(self) -> str:
        """Do nothing: the load cell does not move, and the stop sequence still needs its samples."""
        return ""

    def snapshot_decoder(self) -> dict[str, Any]:
        """Return the decoder's state, from which a replay decodes the frames to come, see `drivers.replay`."""
        with self._read_lock:
            return {"decoder": self.decoder_name, "state": self._decoder.snapshot()}

    def get_health(self) -> Health:
        """Return the counts since the load cell was connected, and the present problems."""
        counts = self._decoder.get_statistics().subtract(self._initial_statistics)
        message = "; ".join(self._find_problems()) if self._line.is_open else "not connected"
        return Health(self._line.is_open, *counts, self._decoder.last_ns, message)

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with all bytes from now on; decoding the received ones repeats the blocks."""
        self._line.add_listener(listener)

    @abstractmethod
    def _find_problems(self) -> list[str]:
        """Return the problems of the stream of an open line."""

    def _find_silence(self, timeout: float) -> list[str]:
        """Return a message if nothing good was received for longer than ``timeout`` [s]."""
        silence = (self._clock() - (self._decoder.last_ns or 0)) * 1e-9
        return [f"silent for {silence:.3g} s"] if silence > timeout else []

    def _check_channel(self, channel: str) -> None:
        names = [known.name for known in self.channels]
        if channel not in names:
            raise OutOfRangeError(
                f"{self.name}: no channel {channel!r}, only {', '.join(names)}; nothing was sent"
            )

    def _pop_pending(self) -> list[SampleBlock]:
        with self._read_lock:
            blocks, self._pending = self._pending, []
        return blocks
