"""Writer of a log: header, messages and outcome.

`bench.log.chunked_writer` decides when data are written to the disk. ``mrbench salvage`` repairs the log of a
killed writer.
"""

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NotRequired, TypedDict, Unpack

import numpy as np
import numpy.typing as npt
import orjson

from bench.endings import RunEnding, derive_ending
from bench.errors import LogError
from bench.log.chunked_writer import ChunkedMcapWriter
from bench.log.columns import (
    check_fields,
    make_not_finite_error,
    make_not_increasing_error,
    make_sample_messages,
)
from bench.log.header import RunHeader, serialise_values
from bench.log.log_context import LogContext
from bench.log.mcap_file import convert_file_errors
from bench.log.messages import (
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
    make_timestamp,
)

_README = """This is a log of a damper test in the MCAP format, profile mrbench (https://mcap.dev).

/bench/sample   one message for each sample: displacement, velocity, force, drive and other measured channels
/bench/segment  start and end of each segment of the test
/bench/event    changes of state, commands, alarms
/instrument/*   in a log from a rig: readings of each instrument with its own clock and raw counts
/wire/*         in a log from a rig: bytes on the wire of each instrument

Messages are JSON; the schema of each topic contains the unit of every field. The metadata records `run`, `units`,
`calibration`, `clocks` and `channels` describe how the recording was made, `outcome` how it ended. Log time and
publish time are the bench clock. Displacement is positive in extension, force is positive in tension.
"""


_UNSET_VALUES: dict[str, Any] = {"amplitude": None, "frequency": None, "drive_value": None}
"""Values of a segment whose motion and drive vary."""


class SegmentMark(TypedDict):
    """Fields of the message at the start and at the end of a segment."""

    phase: Phase
    index: int
    """Index of the segment in the log, from 0."""
    name: str
    stretch: str
    """Name of the continuous recording that contains it."""
    motion: str
    """Kind of motion."""
    drive: str
    """Kind of drive programme."""
    amplitude: NotRequired[float | None]
    """[m]; None if the motion has none."""
    frequency: NotRequired[float | None]
    """[Hz]; None if the motion has none."""
    drive_value: NotRequired[float | None]
    """[V or A]; None if the drive varies."""
    shunt: NotRequired[bool]
    """True if the shunt of the load cell is on."""


class LogWriter(LogContext):
    """Writer of one log; use it in a ``with`` block.

    At the end of the block the log is closed as ``clean``, or as ``lossy`` if samples were lost. After an
    exception it is closed as ``incomplete``.
    """

    def __init__(self, path: Path | str, header: RunHeader, clock: Callable[[], float] = time.monotonic) -> None:
        """Open the log and write its header.

        Args:
            path: log to write; an existing file is replaced.
            header: description of the run.
            clock: wall time [s], for the intervals of chunks and syncs.

        Raises:
            LogError: the file cannot be written.
        """
        self.path = Path(path)
        self._lost: Counter[str] = Counter()
        self._last_ns = -1
        self._closed = False
        with convert_file_errors(self.path):
            self._file = ChunkedMcapWriter(self.path, clock)
            with self._abandon_on_error():
                self._write_header(header)

    def _write_header(self, header: RunHeader) -> None:
        """Write the records before the first sample, so that also a truncated log describes its run."""
        for topic in MESSAGES:
            self._file.register(topic)
        for name, record in header.make_metadata().items():
            self._file.write_metadata(name, record)
        self.attach("README.txt", "text/plain", _README.encode())
        self._file.sync()

    def write_sample(self, time_ns: int, values: Mapping[str, float | int]) -> None:
        """Write one sample.

        Args:
            time_ns: bench clock [ns], later than the sample before.
            values: values by field of a sample, in its unit.

        Raises:
            LogError: a field is unknown, missing or not finite, time does not increase, or writing fails.
        """
        names = check_fields(values)
        for name in REQUIRED_FIELDS:
            # Written as `not <`, because every comparison with NaN is false.
            if not abs(values[name]) < float("inf"):
                raise make_not_finite_error(name, values[name], time_ns)
        message = {"timestamp": make_timestamp(time_ns), **_select_values(names, values)}
        with convert_file_errors(self.path):
            self._write_sample_message(time_ns, orjson.dumps(message, option=orjson.OPT_SERIALIZE_NUMPY))

    def write_samples(self, time_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]) -> None:
        """Write many samples at once.

        Args:
            time_ns: bench clock [ns], increasing, shape (samples,).
            values: values by field, each of shape (samples,). A field that is NaN, or a negative segment, is
                omitted from that sample; only optional fields may be NaN.

        Raises:
            LogError: as for `write_sample`; nothing is written then.
        """
        messages = make_sample_messages(np.asarray(time_ns, dtype=np.int64), values)
        with convert_file_errors(self.path):
            for moment, message in messages:
                self._write_sample_message(moment, message)

    def write_segment(self, time_ns: int, **mark: Unpack[SegmentMark]) -> None:
        """Write a segment mark; ``time_ns`` is the bench clock [ns] of the segment's first or last sample."""
        segment = Segment(timestamp=Timestamp(**make_timestamp(time_ns)), **{**_UNSET_VALUES, **mark})
        omitted = None if segment.shunt else {"shunt"}
        with convert_file_errors(self.path):
            self._file.write_message(SEGMENT, time_ns, segment.model_dump_json(exclude=omitted).encode())

    def write_event(self, time_ns: int, kind: str, text: str, **more: Any) -> None:
        """Write an event.

        Args:
            time_ns: bench clock [ns].
            kind: state, command, alarm, trip, late, checkpoint, ...
            text: description of the event for a person.
            more: additional fields of the message.
        """
        event = Event(timestamp=Timestamp(**make_timestamp(time_ns)), kind=kind, text=text, **more)
        with convert_file_errors(self.path):
            self._file.write_message(EVENT, time_ns, event.model_dump_json(exclude_none=True).encode())

    def write_message(self, topic: str, time_ns: int, content: bytes) -> None:
        """Write a message of an instrument or its wire.

        Args:
            topic: topic with a prefix in `TOPIC_FAMILIES`; registered at its first message.
            time_ns: bench clock [ns].
            content: JSON according to the topic's schema.
        """
        with convert_file_errors(self.path):
            self._file.register(topic)
            self._file.write_message(topic, time_ns, content)

    def write_metadata(self, name: str, values: Mapping[str, Any]) -> None:
        """Write a metadata record that is known only after the start of the recording."""
        with convert_file_errors(self.path):
            self._file.write_metadata(name, serialise_values(values))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment: the method, a configuration, a certificate."""
        with convert_file_errors(self.path):
            self._file.attach(max(self._last_ns, 0), name, media_type, data)

    def count_lost(self, channel: str, samples: int = 1) -> None:
        """Count samples of a channel that could not be recorded; the log will be closed as ``lossy``."""
        self._lost[channel] += samples

    @property
    def is_lossy(self) -> bool:
        """True if samples were lost."""
        return bool(self._lost)

    def close(self, outcome: Outcome | None = None, reason: str = "", ending: RunEnding | None = None) -> None:
        """Write the outcome and the index, and sync the file to the disk.

        Args:
            outcome: end of the recording; by default ``clean``, or ``lossy`` if samples were lost.
            reason: reason of the outcome for a person.
            ending: ending of the run; by default ``completed`` for a clean or lossy log, else unknown.

        Raises:
            LogError: the file cannot be written, or the log is already closed.
        """
        if self._closed:
            raise LogError(f"{self.path}: this log is already closed")
        self._closed = True
        final = outcome or ("lossy" if self._lost else "clean")
        with convert_file_errors(self.path):
            with self._abandon_on_error():
                self._file.write_metadata("outcome", self._make_outcome(final, reason, ending))
            self._file.close()

    @contextlib.contextmanager
    def _abandon_on_error(self) -> Iterator[None]:
        """Close the file without an index if a block fails, so that it can be repaired."""
        try:
            yield
        except BaseException:
            self._file.abandon()
            raise

    def _make_outcome(self, outcome: Outcome, reason: str, ending: RunEnding | None) -> dict[str, str]:
        end = {"outcome": outcome, "reason": reason, "ending": ending or derive_ending(outcome, "")}
        counts = {topic: self._file.message_counts[topic] for topic in self._file.topics}
        last = {"last_time_ns": self._last_ns}
        return serialise_values({**end, **counts, "lost": dict(self._lost), **last})

    def _write_sample_message(self, time_ns: int, message: bytes) -> None:
        if time_ns <= self._last_ns:
            raise make_not_increasing_error(self._last_ns, time_ns)
        self._last_ns = time_ns
        self._file.write_message(SAMPLE, time_ns, message)


def _select_values(names: list[str], values: Mapping[str, float | int]) -> dict[str, float | int]:
    """Return the values except NaN and a negative segment."""
    return {
        name: value for name in names if (value := values[name]) == value and (name != "segment" or value >= 0)
    }
