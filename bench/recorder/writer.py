"""Writes a log: what each message says, what stands at its beginning and at its end.

When things reach the disk is the business of `bench.recorder.paced_file`; what a kill leaves there, ``mrbench
salvage`` mends.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, NotRequired, Self, TypedDict, Unpack

import numpy as np
import numpy.typing as npt
import orjson

from bench.errors import LogError
from bench.recorder.columns import SECOND, checked_fields, not_finite, not_increasing, sample_messages
from bench.recorder.header import RunHeader, text_values
from bench.recorder.mcap_file import file_errors
from bench.recorder.messages import (
    EVENT,
    MESSAGES,
    REQUIRED_FIELDS,
    SAMPLE,
    SEGMENT,
    Event,
    Outcome,
    Phase,
    Segment,
    Timestamp,
)
from bench.recorder.paced_file import PacedFile

_README = """This is a log of a damper test in the MCAP format, profile mrbench (https://mcap.dev).

/bench/sample   one message a sample: displacement, velocity, force, drive and what else was measured
/bench/segment  where each segment of the test starts and ends
/bench/event    changes of state, commands, alarms
/instrument/*   where the log was made on a rig: each instrument's own readings with its own clock and raw counts
/wire/*         and what passed on its wire, byte by byte

Messages are JSON; the schema beside each topic says the unit of every field. The metadata records `run`,
`units`, `calibration`, `clocks` and `channels` say how the recording was made, `outcome` how it ended.
Log time and publish time are the bench clock. Positive displacement extends the damper; positive force is
tension.
"""


_WITHOUT_SIZE: dict[str, Any] = {"amplitude": None, "frequency": None, "drive_value": None}
"""Of a segment whose motion or drive varies."""


class SegmentEnd(TypedDict):
    """What a log says where a segment starts, and again where it ends."""

    phase: Phase
    index: int
    """Place of the segment in the log, from 0."""
    name: str
    stretch: str
    """Name of the continuous recording that it stands in."""
    motion: str
    """Kind of motion."""
    drive: str
    """Kind of drive programme."""
    amplitude: NotRequired[float | None]
    """[m]; none where the motion has none."""
    frequency: NotRequired[float | None]
    """[Hz]; none where the motion has none."""
    drive_value: NotRequired[float | None]
    """[V or A]; none where the drive varies."""


class LogWriter:
    """One log while it is being written; use it in a ``with`` block.

    Leaving the block closes the log as ``clean``, or as ``lossy`` where samples were lost; leaving it by an
    exception closes it as ``incomplete``.
    """

    def __init__(self, path: Path | str, header: RunHeader, clock: Callable[[], float] = time.monotonic) -> None:
        """Open the log and write what is known before the first sample.

        Args:
            path: the log; a file there is replaced.
            header: what the log says of itself.
            clock: wall time [s]; paces chunks and syncs.

        Raises:
            LogError: the file cannot be written.
        """
        self.path = Path(path)
        self._lost: Counter[str] = Counter()
        self._last = -1
        self._closed = False
        with file_errors(self.path):
            self._file = PacedFile(self.path, clock)
            try:
                self._begin(header)
            except BaseException:
                self._file.abandon()
                raise

    def _begin(self, header: RunHeader) -> None:
        """What stands before the first sample, so that a log cut off there still says whose it is."""
        for topic in MESSAGES:
            self._file.register(topic)
        for name, record in header.records().items():
            self._file.record(name, record)
        self.attach("README.txt", "text/plain", _README.encode())
        self._file.to_disk()

    def __enter__(self) -> Self:
        """The writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the log; after an exception as ``incomplete``, with its reason."""
        if not self._closed:
            if kind is None:
                self.close()
            else:
                self.close("incomplete", f"{kind.__name__}: {error}")

    def sample(self, time_ns: int, values: Mapping[str, float | int]) -> None:
        """Write one sample.

        Args:
            time_ns: bench clock [ns], later than the sample before.
            values: by field of a sample, in its unit.

        Raises:
            LogError: a field is unknown, missing or not finite, time does not increase, or writing fails.
        """
        names = checked_fields(values)
        for name in REQUIRED_FIELDS:
            # So written, for no comparison with NaN is true.
            if not abs(values[name]) < float("inf"):
                raise not_finite(name, values[name], time_ns)
        message = {"timestamp": _clock_fields(time_ns), **_given(names, values)}
        with file_errors(self.path):
            self._put_sample(time_ns, orjson.dumps(message, option=orjson.OPT_SERIALIZE_NUMPY))

    def samples(self, time_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]) -> None:
        """Write many samples at once.

        Args:
            time_ns: bench clock [ns], increasing, shape (samples,).
            values: by field, each of shape (samples,); a NaN in an optional field, or a negative segment,
                leaves the field out of that sample.

        Raises:
            LogError: as for `sample`; nothing is written then.
        """
        messages = sample_messages(np.asarray(time_ns, dtype=np.int64), values)
        with file_errors(self.path):
            for moment, message in messages:
                self._put_sample(moment, message)

    def segment(self, time_ns: int, **end: Unpack[SegmentEnd]) -> None:
        """Mark one end of a segment; ``time_ns`` is the bench clock [ns] of its first sample, or of its last."""
        mark = Segment(timestamp=Timestamp(**_clock_fields(time_ns)), **{**_WITHOUT_SIZE, **end})
        with file_errors(self.path):
            self._file.put(SEGMENT, time_ns, mark.model_dump_json().encode())

    def event(self, time_ns: int, kind: str, text: str, **more: Any) -> None:
        """Write an event.

        Args:
            time_ns: bench clock [ns].
            kind: state, command, alarm, trip, late, checkpoint, ...
            text: what happened, in words.
            more: further fields of the message.
        """
        event = Event(timestamp=Timestamp(**_clock_fields(time_ns)), kind=kind, text=text, **more)
        with file_errors(self.path):
            self._file.put(EVENT, time_ns, event.model_dump_json(exclude_none=True).encode())

    def message(self, topic: str, time_ns: int, content: bytes) -> None:
        """Write a message of an instrument or its wire.

        Args:
            topic: one that begins like one of `bench.recorder.messages.FAMILIES`; known from its first message on.
            time_ns: bench clock [ns].
            content: JSON that keeps to the topic's schema.
        """
        with file_errors(self.path):
            self._file.register(topic)
            self._file.put(topic, time_ns, content)

    def record(self, name: str, values: Mapping[str, Any]) -> None:
        """Write a metadata record: what is known only after the recording has begun."""
        with file_errors(self.path):
            self._file.record(name, text_values(values))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Keep a document in the log: the method, a configuration, a certificate."""
        with file_errors(self.path):
            self._file.attach(max(self._last, 0), name, media_type, data)

    def lost(self, channel: str, samples: int = 1) -> None:
        """Count samples of a channel that could not be recorded; the log will close as ``lossy``."""
        self._lost[channel] += samples

    @property
    def lossy(self) -> bool:
        """Whether samples could not be recorded."""
        return bool(self._lost)

    def close(self, outcome: Outcome | None = None, reason: str = "") -> None:
        """Write the outcome and the index, and bring everything to the disk.

        Args:
            outcome: how the recording ended; by default ``clean``, or ``lossy`` where samples were lost.
            reason: why, in words.

        Raises:
            LogError: the file cannot be written, or is closed.
        """
        if self._closed:
            raise LogError(f"{self.path}: this log is closed")
        self._closed = True
        ended = outcome or ("lossy" if self._lost else "clean")
        with file_errors(self.path):
            try:
                self._file.record("outcome", self._outcome(ended, reason))
            except BaseException:
                self._file.abandon()
                raise
            self._file.close()

    def _outcome(self, outcome: Outcome, reason: str) -> dict[str, str]:
        counts = {topic: self._file.written[topic] for topic in self._file.topics}
        last = {"last_time_ns": self._last}
        return text_values({"outcome": outcome, "reason": reason, **counts, "lost": dict(self._lost), **last})

    def _put_sample(self, time_ns: int, message: bytes) -> None:
        if time_ns <= self._last:
            raise not_increasing(self._last, time_ns)
        self._last = time_ns
        self._file.put(SAMPLE, time_ns, message)


def _clock_fields(time_ns: int) -> dict[str, int]:
    seconds, rest = divmod(time_ns, SECOND)
    return {"sec": seconds, "nsec": rest}


def _given(names: list[str], values: Mapping[str, float | int]) -> dict[str, float | int]:
    """The values without a NaN, and without the segment between segments."""
    return {
        name: value for name in names if (value := values[name]) == value and (name != "segment" or value >= 0)
    }
