"""Records a run while it is made: takes everything at once from any thread, and writes it on one of its own.

Compression, disk and JSON happen where nobody waits for them. What comes is kept in a queue with an end: where the
disk cannot follow, wire frames are left out first, then the instruments' readings, then samples; each is counted,
and the log says that it is lossy.
"""

import contextlib
import threading
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TypeAlias, Unpack

import numpy as np
import numpy.typing as npt

from bench.errors import LogError
from bench.recorder.header import RunHeader
from bench.recorder.messages import INSTRUMENT, WIRE, Outcome
from bench.recorder.readings import Clocks, frames_message, readings_messages
from bench.recorder.writer import LogWriter, SegmentEnd
from drivers.channel import Block, Frame

PERIOD = 0.1
"""[s] between two turns of the writing thread."""
ROOM = 20_000
"""Things that wait to be written at most; a rig of five instruments makes some 2000 in a second."""
CLOSE_WITHIN = 30.0
"""[s] for all that waits to be written in the end."""

Kind: TypeAlias = Literal["frames", "readings", "samples"]
_SHARE: dict[Kind, float] = {"frames": 0.5, "readings": 0.75, "samples": 1.0}
"""How full the queue may be for each kind to be taken."""
_Write = Callable[[LogWriter], None]


class LiveRecorder:
    """One log while a run is made; a context manager.

    Its methods may be called from any thread and never wait for the disk. Leaving the block by an exception closes
    the log as incomplete.
    """

    def __init__(
        self, path: Path | str, header: RunHeader, *, maps: Mapping[str, Clocks] | None = None, room: int = ROOM
    ) -> None:
        """Open the log; it can be salvaged from now on, whatever happens.

        Args:
            path: of the log; a file there is replaced.
            header: what the log says of itself.
            maps: of the instruments' clocks, by name, for their readings; without one they are stamped on receipt.
            room: things that wait to be written at most.

        Raises:
            LogError: the file cannot be written.
        """
        self._log = LogWriter(path, header)
        self._maps, self._room = maps or {}, room
        self._queue: deque[tuple[str, Any]] = deque()
        self._dropped: Counter[str] = Counter()
        self._counting = threading.Lock()
        self._error: LogError | None = None
        self._ending = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        """The recorder itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the log; after an exception as ``incomplete``, with its reason."""
        if not self._closed:
            self.close(None if kind is None else "incomplete", "" if kind is None else f"{kind.__name__}: {error}")

    @property
    def path(self) -> Path:
        """Of the log."""
        return self._log.path

    @property
    def dropped(self) -> dict[str, int]:
        """What found the queue full: samples, readings of each instrument, frames of each wire."""
        with self._counting:
            return dict(self._dropped)

    def samples(self, time_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]) -> None:
        """Record bench samples.

        Args:
            time_ns: bench clock [ns], increasing, shape (samples,).
            values: by field, each of shape (samples,); a NaN in an optional field, or a negative segment, leaves
                the field out of that sample.

        Raises:
            LogError: the log could not be written, now or before.
        """
        self._check()
        if self._has_room("samples", "samples", len(time_ns)):
            self._do(lambda log: log.samples(time_ns, values))

    def blocks(self, name: str, blocks: Sequence[Block]) -> None:
        """Record an instrument's own readings, by its name."""
        if self._has_room("readings", f"{INSTRUMENT}{name}", sum(len(block.values) for block in blocks)):
            self._queue.append((f"{INSTRUMENT}{name}", blocks))

    def frame(self, name: str, frame: Frame) -> None:
        """Record what passed on the wire of an instrument, by its name."""
        if self._has_room("frames", f"{WIRE}{name}", 1):
            self._queue.append((f"{WIRE}{name}", frame))

    def segment(self, time_ns: int, **end: Unpack[SegmentEnd]) -> None:
        """Mark one end of a segment, as `LogWriter.segment` does."""
        self._do(lambda log: log.segment(time_ns, **end))

    def event(self, time_ns: int, kind: str, text: str, **more: Any) -> None:
        """Record an event, as `LogWriter.event` does."""
        self._do(lambda log: log.event(time_ns, kind, text, **more))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Keep a document in the log."""
        self._do(lambda log: log.attach(name, media_type, data))

    def lost(self, channel: str, samples: int = 1) -> None:
        """Count samples of a channel that could not be recorded; the log will close as ``lossy``."""
        self._do(lambda log: log.lost(channel, samples))

    def clocks(self, words: Mapping[str, Any]) -> None:
        """Record what is known of each clock in the end, by instrument: metadata record ``clock_skew``."""
        values = dict(words)
        self._do(lambda log: log.record("clock_skew", values))

    def close(self, outcome: Outcome | None = None, reason: str = "") -> Outcome:
        """Write all that waits, then the outcome and the index; returns how the log was closed.

        Args:
            outcome: how the recording ended; none, like ``clean``, becomes ``clean`` or ``lossy`` as the counts
                say.
            reason: why, in words.

        Raises:
            LogError: the log could not be written, now or before, or is closed.
        """
        if self._closed:
            raise LogError(f"{self.path}: this log is closed")
        self._closed = True
        self._ending.set()
        self._thread.join(CLOSE_WITHIN)
        if self._thread.is_alive():
            raise LogError(f"{self.path}: the disk has not taken what was recorded within {CLOSE_WITHIN:g} s")
        if self._error is not None:
            # What reached the disk can be mended; an end that says so makes it easier, if there is room for one.
            with contextlib.suppress(LogError):
                self._log.close("incomplete", str(self._error))
            raise self._error
        for what, count in self.dropped.items():
            self._log.lost(what, count)
        ended: Outcome = outcome if outcome not in (None, "clean") else "lossy" if self._log.lossy else "clean"
        self._log.close(ended, reason)
        return ended

    def _check(self) -> None:
        if self._error is not None:
            raise self._error

    def _has_room(self, kind: Kind, what: str, count: int) -> bool:
        if len(self._queue) < self._room * _SHARE[kind]:
            return True
        with self._counting:
            self._dropped[what] += count
        return False

    def _do(self, write: _Write) -> None:
        # However full it is: marks and events are few, and a log that lacks one cannot be understood.
        self._queue.append(("", write))

    # The writing thread

    def _run(self) -> None:
        ending = False
        while not ending:
            ending = self._ending.wait(PERIOD)
            try:
                self._write_waiting()
            except LogError as error:
                self._error = error
                return
            except Exception as error:  # a thread that dies in silence would leave a log that calls itself clean
                self._error = LogError(
                    f"{self.path}: cannot be written: {error!r}; this is a defect of the recorder"
                )
                return

    def _write_waiting(self) -> None:
        """Everything that waits now: readings and frames of one instrument together, all else one by one."""
        together: dict[str, list[Any]] = {}
        for _ in range(len(self._queue)):
            topic, content = self._queue.popleft()
            if topic:
                together.setdefault(topic, []).append(content)
            else:
                content(self._log)
        for topic, contents in together.items():
            if topic.startswith(WIRE):
                self._log.message(topic, *frames_message(contents))
            else:
                blocks = [block for several in contents for block in several]
                for moment, message in readings_messages(blocks, self._maps.get(topic.removeprefix(INSTRUMENT))):
                    self._log.message(topic, moment, message)
