"""Live recorder: log writer with a queue and a thread of its own.

Compression, JSON and the disk run on this thread, so no other thread waits for them. The queue is bounded. If the
disk is too slow, wire frames are dropped first, then the instruments' readings, then samples. Each is counted, and
the log closes as lossy.
"""

import contextlib
import threading
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias, Unpack

import numpy as np
import numpy.typing as npt

from bench.endings import RunEnding
from bench.errors import LogError
from bench.log import (
    INSTRUMENT,
    WIRE,
    ClockMapProtocol,
    LogContext,
    LogWriter,
    Outcome,
    RunHeader,
    SegmentMark,
    make_frames_message,
    make_readings_messages,
)
from drivers import Frame, SampleBlock

WRITE_PERIOD = 0.1
"""[s] Interval between two turns of the writing thread."""
QUEUE_CAPACITY = 20_000
"""Largest number of queued items; a rig of five instruments produces about 2000 per second."""
CLOSE_TIMEOUT = 30.0
"""[s] Time to write the rest of the queue at the end."""
CLOCKS_RECORD = "clock_error_bounds"
"""Name of the metadata record that describes the clocks at the end of a run."""

ContentKind: TypeAlias = Literal["frames", "readings", "samples"]
_QUEUE_SHARES: dict[ContentKind, float] = {"frames": 0.5, "readings": 0.75, "samples": 1.0}
"""Share of the queue's capacity up to which each kind of content is accepted."""
_WriteAction = Callable[[LogWriter], None]


class LiveRecorder(LogContext):
    """Log of a run in progress; a context manager.

    Its methods may be called from any thread and never wait for the disk. Leaving the block by an exception closes
    the log as ``incomplete``.
    """

    def __init__(
        self,
        path: Path | str,
        header: RunHeader,
        *,
        maps: Mapping[str, ClockMapProtocol] | None = None,
        capacity: int = QUEUE_CAPACITY,
    ) -> None:
        """Open the log; from now on it can be salvaged.

        Args:
            path: file of the log; an existing file is replaced.
            header: metadata at the begin of the log.
            maps: clock maps of the instruments by name, for their readings; without one, the time of receipt
                counts.
            capacity: largest number of queued items.

        Raises:
            LogError: the file cannot be written.
        """
        self._log = LogWriter(path, header)
        self._maps, self._capacity = maps or {}, capacity
        self._queue: deque[tuple[str, Any]] = deque()
        self._dropped_counts: Counter[str] = Counter()
        self._count_lock = threading.Lock()
        self._error: LogError | None = None
        self._stop_requested = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path:
        """Path of the log file."""
        return self._log.path

    @property
    def dropped_counts(self) -> dict[str, int]:
        """Numbers dropped by a full queue: samples, readings of each instrument, frames of each wire."""
        with self._count_lock:
            return dict(self._dropped_counts)

    def write_samples(self, time_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]) -> None:
        """Record bench samples, as `LogWriter.write_samples` does.

        Raises:
            LogError: the log could not be written, now or before.
        """
        if self._error is not None:
            raise self._error
        if self._has_room("samples", "samples", len(time_ns)):
            self._enqueue(lambda log: log.write_samples(time_ns, values))

    def write_blocks(self, name: str, blocks: Sequence[SampleBlock]) -> None:
        """Record an instrument's own readings, by its name."""
        if self._has_room("readings", f"{INSTRUMENT}{name}", sum(len(block.values) for block in blocks)):
            self._queue.append((f"{INSTRUMENT}{name}", blocks))

    def write_frame(self, name: str, frame: Frame) -> None:
        """Record a frame on the wire of an instrument, by its name."""
        if self._has_room("frames", f"{WIRE}{name}", 1):
            self._queue.append((f"{WIRE}{name}", frame))

    def write_segment(self, time_ns: int, **mark: Unpack[SegmentMark]) -> None:
        """Record a segment mark, as `LogWriter.write_segment` does."""
        self._enqueue(lambda log: log.write_segment(time_ns, **mark))

    def write_event(self, time_ns: int, kind: str, text: str, **details: Any) -> None:
        """Record an event, as `LogWriter.write_event` does."""
        self._enqueue(lambda log: log.write_event(time_ns, kind, text, **details))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add an attachment to the log."""
        self._enqueue(lambda log: log.attach(name, media_type, data))

    def count_lost(self, channel: str, samples: int = 1) -> None:
        """Count samples of a channel that could not be recorded; the log will close as ``lossy``."""
        self._enqueue(lambda log: log.count_lost(channel, samples))

    def write_clocks(self, descriptions: Mapping[str, Any]) -> None:
        """Record the description of each instrument's clock at the end of the run."""
        values = dict(descriptions)
        self._enqueue(lambda log: log.write_metadata(CLOCKS_RECORD, values))

    def close(self, outcome: Outcome | None = None, reason: str = "", ending: RunEnding | None = None) -> Outcome:
        """Write the rest of the queue, the outcome and the index; return the outcome of the log.

        Args:
            outcome: outcome of the recording; None and ``clean`` become ``clean`` or ``lossy`` by the counts.
            reason: reason of the outcome, for a person.

        Raises:
            LogError: the log could not be written, now or before, or is closed.
        """
        if self._closed:
            raise LogError(f"{self.path}: this log is closed")
        self._closed = True
        self._stop_requested.set()
        self._thread.join(CLOSE_TIMEOUT)
        if self._thread.is_alive():
            raise LogError(
                f"{self.path}: the disk has not taken the recording within {CLOSE_TIMEOUT:g} s; "
                "repair the log with `mrbench salvage`"
            )
        if self._error is not None:
            # The part on the disk can be salvaged; an outcome makes this easier, if the disk has room for it.
            with contextlib.suppress(LogError):
                self._log.close("incomplete", str(self._error), ending)
            raise self._error
        for content, count in self.dropped_counts.items():
            self._log.count_lost(content, count)
        result: Outcome = outcome if outcome not in (None, "clean") else "lossy" if self._log.is_lossy else "clean"
        self._log.close(result, reason, ending)
        return result

    def _has_room(self, kind: ContentKind, content: str, count: int) -> bool:
        if len(self._queue) < self._capacity * _QUEUE_SHARES[kind]:
            return True
        with self._count_lock:
            self._dropped_counts[content] += count
        return False

    def _enqueue(self, write: _WriteAction) -> None:
        # Regardless of the capacity: marks and events are few, and a log without them cannot be interpreted.
        self._queue.append(("", write))

    # Writing thread

    def _run(self) -> None:
        is_ending = False
        while not is_ending:
            # After the request to stop there is one more turn, for the rest of the queue.
            is_ending = self._stop_requested.wait(WRITE_PERIOD)
            try:
                self._write_queue()
            except LogError as error:
                self._error = error
                return
            except Exception as error:  # if the thread ended silently, the log would close as clean
                self._error = LogError(
                    f"{self.path}: cannot be written: {error!r}; internal error of the recorder, please report"
                )
                return

    def _write_queue(self) -> None:
        """Write all queued items: readings and frames grouped by topic, everything else in order."""
        groups: dict[str, list[Any]] = {}
        # Only the items queued now: those that arrive meanwhile belong to the next turn.
        for _ in range(len(self._queue)):
            topic, content = self._queue.popleft()
            if topic:
                groups.setdefault(topic, []).append(content)
            else:
                content(self._log)
        for topic, contents in groups.items():
            if topic.startswith(WIRE):
                self._log.write_message(topic, *make_frames_message(contents))
            else:
                blocks = [block for batch in contents for block in batch]
                clock_map = self._maps.get(topic.removeprefix(INSTRUMENT))
                for time_ns, message in make_readings_messages(blocks, clock_map):
                    self._log.write_message(topic, time_ns, message)
