"""Interface of the two load cell decoders: bytes with their times in, sample blocks out, without any wire."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from drivers.channel import SampleBlock


class StreamStatistics(NamedTuple):
    """Counts of one stream since its decoder was made."""

    received: int = 0
    """Frames or lines."""
    lost: int = 0
    """Samples."""
    corrupted: int = 0
    """Frames or lines."""
    resynchronised: int = 0

    def subtract(self, initial: "StreamStatistics") -> "StreamStatistics":
        """Return the counts added since ``initial``."""
        return StreamStatistics(*(now - then for now, then in zip(self, initial, strict=True)))


class StreamDecoder(Protocol):
    """Decoder of one load cell's bytes and nothing else, so that a replay gives the same blocks bit for bit."""

    last_ns: int | None
    """Bench clock at the last good frame or line [ns]."""

    def feed(self, received_ns: int, data: bytes) -> list[SampleBlock]:
        """Return the blocks of the samples that are complete with ``data``."""

    def get_statistics(self) -> StreamStatistics:
        """Return counts of frames and samples."""

    def snapshot(self) -> dict[str, Any]:
        """Return the state that `restore` needs to decode the bytes after ``at_ns``; JSON."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a snapshot."""
