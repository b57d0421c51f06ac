"""Recording thread: aligns samples, records them and publishes them.

It has no deadlines: wires and setpoints have threads of their own, and the interlocks check each sample before it
arrives here.
"""

import threading
import time
from collections import Counter
from collections.abc import Callable

from bench.errors import LogError
from bench.live import BatchMaker, LiveBatch
from bench.log import NS_PER_SECOND
from bench.recorder.run_recorder import Columns, RunRecorder
from bench.rig import AlignedSamples, Aligner, Batch

CYCLE_PERIOD = 0.05
"""[s] Interval between two turns, each of which publishes the new samples."""
_CLOCK_READINGS = 3
"""Number of readings of both clocks for one stamp."""
_JOIN_TIMEOUT = 2.0
"""[s] Time for the thread to end."""


class RecordingThread:
    """Thread that converts batches to bench samples; a context manager.

    Args:
        aligner: aligns the channels.
        batch_maker: makes live batches of the samples.
        clock: bench clock [ns].
        publish: receives all samples for live views; must not wait.
        on_cycle: is called in every turn.
        on_failed: receives the error if the log cannot be written.
    """

    def __init__(
        self,
        aligner: Aligner,
        batch_maker: BatchMaker,
        clock: Callable[[], int],
        publish: Callable[[LiveBatch], None],
        on_cycle: Callable[[], None],
        on_failed: Callable[[LogError], None],
    ) -> None:
        self.newest_ns = -1
        """Bench clock of the newest bench sample [ns]."""
        self._aligner, self._publish, self._on_cycle, self._on_failed = aligner, publish, on_cycle, on_failed
        self._batch_maker, self._clock = batch_maker, clock
        self._lock = threading.Lock()
        self._recording: RunRecorder | None = None
        self._lost_at_start: Counter[str] = Counter()
        self._live: list[tuple[AlignedSamples, Columns]] = []
        self._has_defect = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)

    def __enter__(self) -> "RecordingThread":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(_JOIN_TIMEOUT)

    def feed(self, batch: Batch) -> None:
        """Add a batch, on the thread of its wire."""
        self._aligner.feed(batch)

    def start_recording(self, recording: RunRecorder) -> None:
        """Record all samples from now on."""
        with self._lock:
            # Samples that were lost before are not losses of this run.
            self._lost_at_start = Counter(self._aligner.lost)
            self._recording, self._has_defect = recording, False

    def count_lost(self) -> dict[str, int]:
        """Return the number of samples lost since the recording began, by channel."""
        with self._lock:
            return self._count_lost()

    def finish_recording(self) -> dict[str, int]:
        """End the recording; return the number of samples lost during it, by channel."""
        with self._lock:
            if self._recording is not None:
                self._recording.finish()
            self._recording = None
            return self._count_lost()

    def _count_lost(self) -> dict[str, int]:
        return dict(Counter(self._aligner.lost) - self._lost_at_start)

    def _run(self) -> None:
        while not self._stopping.wait(CYCLE_PERIOD):
            for step in (self._process_samples, self._publish_live, self._on_cycle):
                try:
                    step()
                except Exception as error:
                    # The thread also monitors the force age, so an error must not end it.
                    self._report_defect(error)

    def _report_defect(self, error: Exception) -> None:
        """Report an internal error once per run, because it would repeat in every turn."""
        if not self._has_defect:
            self._has_defect = True
            self._on_failed(
                LogError(
                    f"sample processing failed: {error!r}; the run was stopped; internal error, please report"
                )
            )

    def _process_samples(self) -> None:
        with self._lock:
            failure = self._record_ready()
        if failure is not None:  # without the lock, because the receiver may ask for the lost samples
            self._on_failed(failure)

    def _record_ready(self) -> LogError | None:
        """Record the samples that are ready; return the error if the log cannot be written."""
        aligned = self._aligner.align()
        if aligned is None:
            return None
        columns: Columns = aligned.columns
        self.newest_ns = int(aligned.time_ns[-1])
        failure = None
        if self._recording is not None:
            try:
                columns = self._recording.add_samples(aligned)
            except LogError as error:
                self._recording, failure = None, error
        self._live.append((aligned, columns))
        return failure

    def _publish_live(self) -> None:
        live, self._live = self._live, []
        # A thread that is suspended between both readings makes the difference too small, never too large.
        utc_origin_s = max(time.time() - self._clock() / NS_PER_SECOND for _ in range(_CLOCK_READINGS))
        for aligned, columns in live:
            for batch in self._batch_maker.make(aligned.time_ns, columns, utc_origin_s):
                self._publish(batch)
